"""The part of space and of the image in which people are looked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pop_core.errors import SettingError
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.settings import setting

FAR_M = 100.0
WIDE_PX = 100_000


@dataclass(frozen=True, slots=True)
class RegionConfig:
    """A box in the camera frame and a rectangle in the image; people outside are left alone."""

    x_min_m: float = setting(
        -FAR_M, unit='m', minimum=-FAR_M, maximum=FAR_M, about='Left side of the box.')
    x_max_m: float = setting(
        FAR_M, unit='m', minimum=-FAR_M, maximum=FAR_M, about='Right side of the box.')
    y_min_m: float = setting(
        -FAR_M, unit='m', minimum=-FAR_M, maximum=FAR_M,
        about='Top of the box; y points down in the camera frame.')
    y_max_m: float = setting(
        FAR_M, unit='m', minimum=-FAR_M, maximum=FAR_M, about='Bottom of the box.')
    z_min_m: float = setting(
        0.0, unit='m', minimum=0.0, maximum=FAR_M, about='Near side of the box.')
    z_max_m: float = setting(
        FAR_M, unit='m', minimum=0.0, maximum=FAR_M, about='Far side of the box.')
    left_px: int = setting(
        0, unit='px', minimum=0, maximum=WIDE_PX, about='First column of the rectangle.')
    right_px: int = setting(
        WIDE_PX, unit='px', minimum=0, maximum=WIDE_PX, about='Last column of the rectangle.')
    top_px: int = setting(
        0, unit='px', minimum=0, maximum=WIDE_PX, about='First row of the rectangle.')
    bottom_px: int = setting(
        WIDE_PX, unit='px', minimum=0, maximum=WIDE_PX, about='Last row of the rectangle.')

    def __post_init__(self) -> None:
        for low, high in (
            ('x_min_m', 'x_max_m'), ('y_min_m', 'y_max_m'), ('z_min_m', 'z_max_m'),
            ('left_px', 'right_px'), ('top_px', 'bottom_px'),
        ):
            if getattr(self, low) > getattr(self, high):
                raise SettingError(
                    f'region: expected {low} below {high}, found {getattr(self, low)} and '
                    f'{getattr(self, high)}: nobody could be inside')


def is_inside(lifted: LiftedJoints, region: RegionConfig) -> bool:
    """Return whether a person stands inside, by the median of the lifted joints.

    Joints that are hidden, or lie on something else, do not move a median; those of a body that
    reaches across the border do not cut it in two.
    """
    if not lifted.lifted.any():
        return False
    low = np.array([region.x_min_m, region.y_min_m, region.z_min_m])
    high = np.array([region.x_max_m, region.y_max_m, region.z_max_m])
    place = np.median(lifted.positions_camera[lifted.lifted], axis=0)
    first, last = [region.left_px, region.top_px], [region.right_px, region.bottom_px]
    uv = np.median(lifted.keypoints_px[lifted.lifted], axis=0)
    in_box = bool(np.all((low <= place) & (place <= high)))
    return in_box and bool(np.all((first <= uv) & (uv <= last)))
