"""What the sensor says about one person, cut out and thinned to the size the fit needs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from pop_core.body.joints import SHARED_MIRROR
from pop_core.depth_noise import USUAL_NOISE, DepthNoise
from pop_core.geometry.camera import Camera
from pop_core.keypoints.body_parts import LABEL_MIRROR
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.rgbd import RgbdFrame, flying_pixels
from pop_core.segmentation.ground import Ground

REACH_M = 1.25  # half size of the window around a person: a tall one with a raised arm fits
RAY_SIGMA_PX = 12.0  # a detector's guess of a hidden joint is rarely better
WINDOW_PX = 240  # longest side of the thinned window


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of the image, every `stride`-th pixel of it."""

    left: int
    top: int
    width: int
    height: int
    stride: int

    def view(self, image: np.ndarray) -> np.ndarray:
        """Return the thinned part of an image itself: what is written there, is in the image."""
        bottom, right = self.top + self.height, self.left + self.width
        return image[self.top: bottom: self.stride, self.left: right: self.stride]

    def cut(self, image: np.ndarray) -> np.ndarray:
        """Return the thinned cut-out of an image."""
        return np.ascontiguousarray(self.view(image))

    def camera(self, camera: Camera) -> Camera:
        """Return the pinhole that sees the cut-out."""
        s = self.stride
        return Camera(
            -(-self.width // s), -(-self.height // s), camera.fx / s, camera.fy / s,
            (camera.cx - self.left) / s, (camera.cy - self.top) / s,
        )


@dataclass(frozen=True, slots=True, eq=False)
class KeypointRays:
    """The rays of keypoints that were detected but could not be lifted.

    Args:
        joint: Shared joint of each ray.
        across: Two unit vectors across each ray.
        score: Confidence 0..1 of each keypoint.
        sigma: Standard deviation as a slope: metres per metre of depth.
    """

    joint: Int[np.ndarray, 'n']
    across: Float[np.ndarray, 'n 2 3']
    score: Float[np.ndarray, 'n']
    sigma: float


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One person's window of the depth image, and the joints lifted in it.

    Args:
        window: Where the cut-out lies in the frame.
        camera: Pinhole of the cut-out.
        depth_m: Measured depth [m]; NaN is no measurement.
        rays: (x/z, y/z) of every pixel.
        own: Pixels that may show this person: measured, no flying pixel, no floor, nobody else.
        labels: Body part per pixel as a joint index, -1 where unknown; None without a part map.
        lifted: Lifted joints of the person.
        keypoint_rays: Rays of the keypoints that were not lifted.
        ground: The floor, or None when none is seen.
        noise: Noise of the measured depth.
        standing_clear: Surface of limbs that was found beside the first bodies fitted; None
            before it was looked for.
        expected: What is believed of all joints, seen or hidden; None if nothing is.
    """

    window: Window
    camera: Camera
    depth_m: Float32[np.ndarray, 'h w']
    rays: Float[np.ndarray, 'h w 2']
    own: Bool[np.ndarray, 'h w']
    labels: Int[np.ndarray, 'h w'] | None
    lifted: LiftedJoints
    keypoint_rays: KeypointRays
    ground: Ground | None
    noise: DepthNoise = USUAL_NOISE
    standing_clear: Bool[np.ndarray, 'h w'] | None = None
    expected: JointBelief | None = None

    def points(self, mask: Bool[np.ndarray, 'h w']) -> Float[np.ndarray, 'n 3']:
        """Return the measured points of a mask [m], camera frame, in row order."""
        return self.points_at(np.flatnonzero(mask))

    def points_at(self, pixel: Int[np.ndarray, 'n']) -> Float[np.ndarray, 'n 3']:
        """Return the measured points [m], camera frame, of pixels numbered row by row."""
        out = np.empty((len(pixel), 3))
        out[:, 2] = self.depth_m.reshape(-1)[pixel]
        np.multiply(self.rays.reshape(-1, 2)[pixel], out[:, 2:], out=out[:, :2])
        return out

    @property
    def recognised(self) -> Bool[np.ndarray, 'h w']:
        """Return the pixels that the keypoint source itself calls this person's."""
        if self.labels is None:
            return np.zeros_like(self.own)
        return self.own & (self.labels >= 0)

    def with_sides_exchanged(self) -> Observation:
        """Return the observation with everything that was called left called right."""
        rays, labels = self.keypoint_rays, self.labels
        return replace(
            self, lifted=self.lifted.with_sides_exchanged(),
            keypoint_rays=replace(rays, joint=SHARED_MIRROR[rays.joint]),
            labels=None if labels is None else LABEL_MIRROR[labels],
            expected=None if self.expected is None else self.expected.with_sides_exchanged())

    def depth_at(
        self, p_camera: Float[np.ndarray, 'n 3']
    ) -> tuple[Float[np.ndarray, 'n'], Int[np.ndarray, 'n 2']]:
        """Return measured depth [m] at the pixels of points, and those pixels (u, v).

        Depth is NaN where nothing was measured and +inf outside the window: the camera does not
        see there, so nothing contradicts a body.
        """
        uv = np.rint(self.camera.project(p_camera))
        uv = np.where(np.isfinite(uv), uv, -1).astype(np.int64)
        u, v = uv.T
        inside = (u >= 0) & (v >= 0) & (u < self.camera.width) & (v < self.camera.height)
        safe = np.where(inside[:, None], uv, 0)
        depth = self.depth_m[safe[:, 1], safe[:, 0]].astype(np.float64)
        return np.where(inside, depth, np.inf), uv


def observe(
    frame: RgbdFrame,
    lifted: LiftedJoints,
    others: Bool[np.ndarray, 'h w'],
    ground: Ground | None = None,
    labels: Int[np.ndarray, 'h w'] | None = None,
    noise: DepthNoise = USUAL_NOISE,
    *,
    expected: JointBelief | None = None,
) -> Observation:
    """Return the observation of one person.

    Args:
        frame: The undistorted frame.
        lifted: The person's joints; at least one is lifted.
        others: Pixels already explained by nearer people; they stay in the depth as occluders.
        ground: The floor of the scene, if one is seen.
        labels: Body part per pixel as a joint index, -1 where unknown.
        noise: Noise of the measured depth.
        expected: What is believed of all joints.
    """
    window = person_window(lifted, frame.camera)
    lifted = lifted.without_guesses()
    camera = window.camera(frame.camera)
    depth_m = window.cut(frame.depth_m)
    flying = window.cut(flying_pixels(frame.depth_m, frame.camera.fx))
    own = np.isfinite(depth_m) & ~window.cut(others) & ~flying
    parts = None if labels is None else window.cut(labels)
    rays = camera.ray_grid()
    if ground is not None:
        own &= ~ground.floor_pixels(depth_m, camera)
    of_keypoints = keypoint_rays(lifted, frame.camera)
    return Observation(
        window, camera, depth_m, rays, own, parts, lifted, of_keypoints, ground, noise,
        expected=expected)


def keypoint_rays(lifted: LiftedJoints, camera: Camera) -> KeypointRays:
    """Return the rays of keypoints with a pixel but no position."""
    known = np.isfinite(lifted.keypoints_px).all(axis=1) & (lifted.scores > 0)
    joint = np.flatnonzero(known & ~lifted.lifted)
    ray = camera.unproject(lifted.keypoints_px[joint], np.ones(len(joint)))
    unit = ray / np.linalg.norm(ray, axis=1, keepdims=True)
    first = np.cross(unit, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    across = np.stack([first, np.cross(unit, first)], axis=1)
    return KeypointRays(joint, across, lifted.scores[joint], RAY_SIGMA_PX / camera.fx)


def person_window(lifted: LiftedJoints, camera: Camera) -> Window:
    """Return the window of everything a person at the lifted joints can reach."""
    seen = lifted.positions_camera[lifted.lifted]
    low = seen.min(axis=0) / 2 + seen.max(axis=0) / 2 - REACH_M
    high = low + 2 * REACH_M
    z = max(float(np.median(seen[:, 2])), 0.5)
    # A person close to the camera reaches beyond every border: the whole image then.
    left = _clamp(low[0] / z * camera.fx + camera.cx, camera.width)
    right = _clamp(high[0] / z * camera.fx + camera.cx, camera.width)
    top = _clamp(low[1] / z * camera.fy + camera.cy, camera.height)
    bottom = _clamp(high[1] / z * camera.fy + camera.cy, camera.height)
    width, height = max(right - left, 1), max(bottom - top, 1)
    stride = max(1, -(-max(width, height) // WINDOW_PX))
    return Window(min(left, camera.width - 1), min(top, camera.height - 1), width, height, stride)


def _clamp(value: float, size: int) -> int:
    return int(np.clip(round(value), 0, size))
