"""Detections of a distorted image in the pixels of the pure pinhole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection


def undistort_detection(detection: Detection, camera: Camera) -> Detection:
    """Return a detection whose pixels are those of the pure pinhole.

    Masks and part maps are dropped: they belong to the distorted image.
    """
    if not camera.is_distorted:
        return detection
    known = np.isfinite(detection.keypoints_px).all(axis=1)
    pinhole = camera.without_distortion()
    uv = np.full_like(detection.keypoints_px, np.nan)
    points = camera.unproject(detection.keypoints_px[known], np.ones(int(known.sum())))
    uv[known] = pinhole.project(points)
    corners = camera.unproject(detection.box_px.reshape(2, 2), np.ones(2))
    return replace(
        detection, keypoints_px=uv, box_px=pinhole.project(corners).reshape(4),
        person_mask=None, part_labels=None)
