"""Captions and colour maps of pictures."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from pop_core.rendering.palette import INK, PAPER

NEAR_SHARE, FAR_SHARE = 2.0, 98.0  # percentiles between which the colours of depth are spread


def captioned(picture: UInt8[np.ndarray, 'h w 3'], text: str) -> UInt8[np.ndarray, 'h w 3']:
    """Return the picture with a line of text on a plate in its upper left corner."""
    out = picture.copy()
    scale = max(0.45, picture.shape[1] / 1400)
    thickness = max(1, round(1.4 * scale))
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, thickness)
    pad = round(8 * scale) + 2
    plate = out[: height + below + 2 * pad, : width + 2 * pad]
    plate[:] = np.rint(0.2 * plate + 0.8 * np.array(INK))
    cv2.putText(
        out, text, (pad, pad + height), cv2.FONT_HERSHEY_SIMPLEX, scale, PAPER, thickness,
        cv2.LINE_AA)
    return out


def colored_depth(depth_m: Float32[np.ndarray, 'h w']) -> UInt8[np.ndarray, 'h w 3']:
    """Return depth as colours, near yellow, far blue, black where nothing was measured."""
    measured = np.isfinite(depth_m)
    if not measured.any():
        return np.zeros((*depth_m.shape, 3), dtype=np.uint8)
    near, far = np.percentile(depth_m[measured], [NEAR_SHARE, FAR_SHARE])
    share = (far - np.where(measured, depth_m, far)) / max(float(far - near), 1e-6)
    level = np.rint(np.clip(share, 0, 1) * 255).astype(np.uint8)
    picture = cv2.cvtColor(cv2.applyColorMap(level, cv2.COLORMAP_VIRIDIS), cv2.COLOR_BGR2RGB)
    return np.where(measured[..., None], picture, 0).astype(np.uint8)
