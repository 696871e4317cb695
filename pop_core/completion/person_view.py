"""What the completion network sees of one person: depth around the keypoints, and those.

A view is a square window of `2 * HALF_M` at the person's depth, `VIEW_PX` cells wide, in depth
relative to the person's own: people far and near, large and small images look alike. Points in a
view are ((x/z - a) z0, (y/z - b) z0, z - z0) [m], with (a, b) the ray in its middle and z0 the
person's depth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32

from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection

VIEW_PX = 80
HALF_M = 1.3  # somebody of whom only the upper half is known reaches this far down
CELL_M = 2.0 * HALF_M / VIEW_PX
RELIEF_M = 1.2  # relative depth is cut off here
SURE_SCORE = 0.5  # keypoints that are not, may lie on what hides the person
BESIDE = ((0.0, 0.0), (0.3, 0.3), (-0.3, 0.3), (0.3, -0.3), (-0.3, -0.3))  # of a cell
FEATURES = 6  # per keypoint


@dataclass(frozen=True, slots=True, eq=False)
class PersonView:
    """What the network sees of one person.

    Args:
        relief_m: Depth relative to the person's own [m], within RELIEF_M; 0 where nothing was
            measured.
        measured: 1 where something was measured, 0 where not, -1 outside the image.
        keypoints: Per joint: place in the view (x, y) [m], score, whether detected, relative
            depth of the surface there [m], whether measured.
        middle: Ray (x/z, y/z) in the middle.
        depth_m: The person's depth [m].
    """

    relief_m: Float32[np.ndarray, 'h w']
    measured: Float32[np.ndarray, 'h w']
    keypoints: Float32[np.ndarray, 's 6']
    middle: Float[np.ndarray, '2']
    depth_m: float

    def to_camera(self, shown: Float[np.ndarray, '... 3']) -> Float[np.ndarray, '... 3']:
        """Return points of the view in the camera frame [m]."""
        z = shown[..., 2:] + self.depth_m
        return np.concatenate([(shown[..., :2] / self.depth_m + self.middle) * z, z], axis=-1)

    def from_camera(self, p_camera: Float[np.ndarray, '... 3']) -> Float[np.ndarray, '... 3']:
        """Return points of the camera frame [m] as the view has them."""
        z = p_camera[..., 2:]
        xy = (p_camera[..., :2] / z - self.middle) * self.depth_m
        return np.concatenate([xy, z - self.depth_m], axis=-1)


def view_person(
    depth_m: Float32[np.ndarray, 'h w'], camera: Camera, detection: Detection,
    taken: Bool[np.ndarray, 'h w'] | None = None,
) -> PersonView | None:
    """Return the view of a person, None when no depth was measured at any keypoint.

    Args:
        depth_m: Depth [m], NaN where nothing was measured.
        camera: Camera without distortion, upright.
        detection: The person's keypoints.
        taken: Pixels of others, who do not tell how far this person is; None for nobody's.
    """
    scores = detection.scores
    found = (scores > 0) & _inside(detection.keypoints_px, camera)
    if not found.any():
        return None
    focal, centre = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    rays = (np.where(found[:, None], detection.keypoints_px, centre) - centre) / focal
    person_m = _person_depth(depth_m, detection.keypoints_px, scores, found, taken)
    if person_m is None:
        return None
    middle = (rays[found].min(axis=0) + rays[found].max(axis=0)) / 2
    relief_m, measured = _window(depth_m, camera, middle, person_m)
    places = np.where(found[:, None], (rays - middle) * person_m, 0.0)
    surface_m, known = _beneath(relief_m, measured, places)
    keypoints = np.column_stack([
        places, np.where(found, scores, 0.0), found, np.where(found, surface_m, 0.0),
        known & found])
    return PersonView(relief_m, measured, keypoints.astype(np.float32), middle, person_m)


def _inside(
    keypoints_px: Float[np.ndarray, 's 2'], camera: Camera
) -> Bool[np.ndarray, 's']:
    """Return which keypoints there are in the image."""
    with np.errstate(invalid='ignore'):
        pixel = np.rint(keypoints_px)
        return np.asarray(((pixel >= 0) & (pixel < [camera.width, camera.height])).all(axis=1))


def _person_depth(
    depth_m: Float32[np.ndarray, 'h w'], keypoints_px: Float[np.ndarray, 's 2'],
    scores: Float[np.ndarray, 's'], found: Bool[np.ndarray, 's'],
    taken: Bool[np.ndarray, 'h w'] | None,
) -> float | None:
    """Return the median depth at keypoints [m], at those that are sure where there are any."""
    u, v = np.rint(np.where(found[:, None], keypoints_px, 0.0)).astype(np.int64).T
    own = found if taken is None else found & ~taken[v, u]
    for chosen in (own & (scores >= SURE_SCORE), own):
        read = depth_m[v[chosen], u[chosen]]
        read = read[np.isfinite(read)]
        if len(read):
            return float(np.median(read))
    return None


def _window(
    depth_m: Float32[np.ndarray, 'h w'], camera: Camera, middle: Float[np.ndarray, '2'],
    person_m: float,
) -> tuple[Float32[np.ndarray, 'n n'], Float32[np.ndarray, 'n n']]:
    """Return relative depth [m] of every cell, and whether it was measured."""
    steps = (np.arange(VIEW_PX) - (VIEW_PX - 1) / 2) * (CELL_M / person_m)
    relief = np.full((VIEW_PX, VIEW_PX), np.nan, dtype=np.float32)
    cell = CELL_M / person_m
    inside = np.zeros(relief.shape, dtype=bool)
    for right, down in BESIDE:
        u = np.rint((steps + middle[0] + right * cell) * camera.fx + camera.cx).astype(np.int64)
        v = np.rint((steps + middle[1] + down * cell) * camera.fy + camera.cy).astype(np.int64)
        there = ((v >= 0) & (v < camera.height))[:, None] & ((u >= 0) & (u < camera.width))
        read = depth_m[np.ix_(v.clip(0, camera.height - 1), u.clip(0, camera.width - 1))]
        missing = np.isnan(relief) & there
        relief[missing] = read[missing] - person_m
        inside |= there
    known = np.isfinite(relief)
    relief = np.where(known, np.clip(relief, -RELIEF_M, RELIEF_M), 0.0).astype(np.float32)
    return relief, np.where(inside, known, -1.0).astype(np.float32)


def _beneath(
    relief_m: Float32[np.ndarray, 'n n'], measured: Float32[np.ndarray, 'n n'],
    places: Float[np.ndarray, 's 2'],
) -> tuple[Float[np.ndarray, 's'], Bool[np.ndarray, 's']]:
    """Return the median relative depth [m] of the nine cells at places, and if there is any."""
    column, row = np.rint(places / CELL_M + (VIEW_PX - 1) / 2).astype(np.int64).T
    around = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
    columns, rows = column[:, None] + around[:, 0], row[:, None] + around[:, 1]
    inside = (columns >= 0) & (columns < VIEW_PX) & (rows >= 0) & (rows < VIEW_PX)
    at = rows.clip(0, VIEW_PX - 1), columns.clip(0, VIEW_PX - 1)
    known = inside & (measured[at] > 0)
    count = known.sum(axis=1)
    ordered = np.sort(np.where(known, relief_m[at], np.inf), axis=1)
    middle = ordered[np.arange(len(count)), np.maximum((count - 1) // 2, 0)]
    return np.where(count > 0, middle, 0.0), count > 0
