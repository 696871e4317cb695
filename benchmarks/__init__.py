"""Accuracy and speed, measured the same way every time."""
