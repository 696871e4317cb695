"""Numba kernel of robust weights (see robust_loss.py for their meaning)."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def geman_mcclure(square, scale, power):
    """Return (c^2 / (c^2 + d^2))^power of a squared length d^2 at a scale c."""
    return (scale * scale / (scale * scale + square)) ** power
