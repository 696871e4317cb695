"""Frames as a camera sees them that is mounted on its side or upside down."""

from dataclasses import replace

import numpy as np

from pop_core.rgbd import RgbdFrame


def mounted(frame: RgbdFrame, quarter_turns: int) -> RgbdFrame:
    """Return what is upright as seen by a camera whose image needs counterclockwise turns."""
    camera = frame.camera
    for _ in range(-quarter_turns % 4):
        camera = camera.turned()
    return RgbdFrame(
        np.rot90(frame.rgb, -quarter_turns).copy(), np.rot90(frame.depth_m, -quarter_turns).copy(),
        replace(camera, quarter_turns=quarter_turns), frame.stamp_ns)


def turned_points(points: np.ndarray, quarter_turns: int) -> np.ndarray:
    """Return points of a mounted camera in the frame of the upright one."""
    for _ in range(quarter_turns):
        points = np.column_stack([points[:, 1], -points[:, 0], points[:, 2]])
    return points
