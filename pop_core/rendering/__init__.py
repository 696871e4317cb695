"""Depth rendering of meshes and pictures of results."""
