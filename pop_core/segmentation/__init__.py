"""Segmentation of the human in the depth image (step 6 of the paper)."""
