"""One registered colour and depth image, and the point cloud of its pixels (step 1)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from pop_core.errors import FrameError
from pop_core.geometry.camera import USUAL_FOCAL_PX, Camera
from pop_core.geometry.flying_pixel_kernels import flying
from pop_core.geometry.lens_maps import lens_maps


@dataclass(frozen=True, slots=True, eq=False)
class RgbdFrame:
    """A colour image and the depth of the same pixels.

    Args:
        rgb: Colour image, RGB order.
        depth_m: Distance along z [m] in the colour camera's frame; NaN is no measurement.
        camera: Intrinsics of both.
        stamp_ns: Time of the colour image [ns].

    Raises:
        FrameError: If colour is no RGB of bytes, depth no float32, sizes differ, any depth is
            not NaN and not positive and finite, or the stamp is no integer.
    """

    rgb: UInt8[np.ndarray, 'h w 3']
    depth_m: Float32[np.ndarray, 'h w']
    camera: Camera
    stamp_ns: int = 0

    def __post_init__(self) -> None:
        size = (self.camera.height, self.camera.width)
        if self.rgb.dtype != np.uint8 or self.rgb.shape[2:] != (3,):
            raise FrameError(
                f'frame: expected colour as uint8 of (height, width, 3) in RGB order, found '
                f'{self.rgb.dtype} of {self.rgb.shape}: cv2.cvtColor converts')
        if self.depth_m.dtype != np.float32:
            raise FrameError(
                f'frame: expected depth in metres as float32, found {self.depth_m.dtype}: divide '
                'integers by their scale (1000 for millimetres), then .astype(np.float32)')
        if self.rgb.shape[:2] != size or self.depth_m.shape != size:
            raise FrameError(
                f'frame: expected colour and depth of {size[1]}x{size[0]} as the camera says, '
                f'found colour {self.rgb.shape} and depth {self.depth_m.shape}'
            )
        no_distance = (self.depth_m <= 0) | np.isinf(self.depth_m)
        if no_distance.any():
            raise FrameError(
                'frame: expected depth in metres and NaN where nothing was measured, found '
                f'{np.count_nonzero(no_distance)} pixels of 0, below, or infinite: '
                'pop_core.rgbd.clean_depth makes them NaN')
        if isinstance(self.stamp_ns, bool) or not isinstance(self.stamp_ns, int | np.integer):
            raise FrameError(
                f'frame: expected stamp_ns as an integer of nanoseconds, found {self.stamp_ns!r}: '
                'round(1e9 * seconds) converts')
        # Differences of unsigned stamps would wrap around.
        object.__setattr__(self, 'stamp_ns', int(self.stamp_ns))


def clean_depth(depth_m: Float32[np.ndarray, 'h w']) -> Float32[np.ndarray, 'h w']:
    """Return depth [m] in which every value that is not a distance (0, negative, inf) is NaN."""
    with np.errstate(invalid='ignore'):
        return np.where((depth_m > 0) & np.isfinite(depth_m), depth_m, np.float32(np.nan))


def undistort_frame(frame: RgbdFrame, *, colour: bool = True) -> RgbdFrame:
    """Return the frame as a pure pinhole of the same intrinsics sees it.

    Depth is sampled by nearest neighbour: interpolation would invent points between a limb and
    the wall behind it.

    Args:
        frame: The frame as the camera gave it.
        colour: Whether colours are wanted; whoever looks at depth alone gets them as they are.
    """
    camera = frame.camera
    if not camera.is_distorted:
        return frame
    seen = lens_maps(camera).of_pinhole
    return RgbdFrame(
        seen.interpolated(frame.rgb) if colour else frame.rgb,
        seen.nearest(frame.depth_m, float('nan')), camera.without_distortion(), frame.stamp_ns)


def undistort_mask(
    mask: Bool[np.ndarray, 'h w'], camera: Camera
) -> Bool[np.ndarray, 'h w']:
    """Return a mask of the camera's image in the pixels of its pinhole."""
    return lens_maps(camera).of_pinhole.mask(mask) if camera.is_distorted else mask


def distort_mask(
    mask: Bool[np.ndarray, 'h w'], camera: Camera
) -> Bool[np.ndarray, 'h w']:
    """Return a mask of the pinhole image in the pixels of the camera's own image."""
    return lens_maps(camera).of_camera.mask(mask) if camera.is_distorted else mask


def point_cloud(
    frame: RgbdFrame, mask: Bool[np.ndarray, 'h w']
) -> tuple[Float[np.ndarray, 'n 3'], Float[np.ndarray, 'n 2']]:
    """Return the measured points of a mask (step 1: PC from D_in and K).

    Returns:
        Points in the camera frame [m] and their pixels (u, v), in row order.
    """
    shown = cv2.findNonZero((mask & (frame.depth_m > 0)).view(np.uint8))
    uv = np.zeros((0, 2), dtype=np.int32) if shown is None else shown.reshape(-1, 2)
    u, v = uv.T
    uv = uv.astype(np.float64)
    camera, seen = frame.camera, uv
    if camera.is_distorted:
        at = lens_maps(camera).of_camera
        camera, seen = camera.without_distortion(), np.column_stack([at.u[v, u], at.v[v, u]])
    return camera.unproject(seen, frame.depth_m[v, u].astype(np.float64)), uv


def flying_pixels(
    depth_m: Float32[np.ndarray, 'h w'], focal_px: float, jump_ratio: float = 0.02
) -> Bool[np.ndarray, 'h w']:
    """Return pixels whose depth lies between two surfaces, as sensors give at edges.

    A pixel flies when a neighbour on one side is nearer and the opposite one is farther, both by
    more than `jump_ratio` of its depth: no surface seen by a camera does that. Depth aligned to a
    finer colour image repeats its pixels: neighbours there are farther apart.

    Args:
        depth_m: Depth [m], NaN where nothing was measured.
        focal_px: Focal length of the image.
        jump_ratio: Least jump to either side, as a share of the pixel's depth.
    """
    out = np.empty(depth_m.shape, dtype=bool)
    reach = max(round(focal_px / USUAL_FOCAL_PX), 1)
    flying(np.ascontiguousarray(depth_m), jump_ratio, reach, out)
    return out
