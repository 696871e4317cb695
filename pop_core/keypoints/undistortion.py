"""Detections of a distorted image in the pixels of the pure pinhole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Int8

from pop_core.geometry.camera import Camera
from pop_core.geometry.lens_maps import lens_maps
from pop_core.keypoints.detection import Detection
from pop_core.rgbd import undistort_mask


def undistort_detection(detection: Detection, camera: Camera) -> Detection:
    """Return a detection whose pixels, mask and parts are those of the pure pinhole."""
    if not camera.is_distorted:
        return detection
    known = np.isfinite(detection.keypoints_px).all(axis=1)
    pinhole = camera.without_distortion()
    uv = np.full_like(detection.keypoints_px, np.nan)
    points = camera.unproject(detection.keypoints_px[known], np.ones(int(known.sum())))
    uv[known] = pinhole.project(points)
    corners = camera.unproject(detection.box_px.reshape(2, 2), np.ones(2))
    mask, labels = detection.person_mask, detection.part_labels
    return replace(
        detection, keypoints_px=uv, box_px=pinhole.project(corners).reshape(4),
        person_mask=None if mask is None else undistort_mask(mask, camera),
        part_labels=None if labels is None else _undistort_labels(labels, camera))


def _undistort_labels(labels: Int8[np.ndarray, 'h w'], camera: Camera) -> Int8[np.ndarray, 'h w']:
    shown = (labels + 1).view(np.uint8)  # OpenCV moves no signed bytes
    return lens_maps(camera).of_pinhole.nearest(shown, 0.0).view(np.int8) - np.int8(1)
