"""Fitting the body to the scene (steps 5, 7 and 8 of the paper)."""
