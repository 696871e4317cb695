"""Occlusion-aware retrieval of poses from a library (step 4 of the paper)."""
