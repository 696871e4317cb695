"""Synthetic RGB-D scenes with truth."""
