"""Rotations, rigid transforms, cameras and depth registration."""
