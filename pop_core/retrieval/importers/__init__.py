"""Readers of pose collections that users hold: SURREAL, AMASS and other npz, BVH."""
