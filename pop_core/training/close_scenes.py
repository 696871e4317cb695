"""Training scenes as a near look shows them: one person each, at one size, or nobody.

The same scenes as for the whole image, drawn finer; each person in them is shown as
`pop_core.keypoints.close_view` will show them, around a guess that errs as first looks err. Holes
stay holes here: the detector fills single ones from beside.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pop_core.keypoints.close_view import (
    BEFORE_M,
    NetworkView,
    border_rays,
    centred_camera,
    shown_pixels,
)
from pop_core.synthesis.training_scenes import TrainingScene, TrainingScenes

# Scenes are drawn with this focal length, about a sensor's own: what a near look can resolve.
FINE_FOCAL_PX = 400.0
FINE_SIZE = (480, 400)
FEWEST_SHOWN = 40  # pixels of a near look that show the person; less is no look's subject
NOBODY_SHARE = 0.12  # of looks that are aimed at something else than a person
NOBODY_M = (0.8, 6.0)  # where that stands
GUESSED_M = 0.10   # how far the middle of a first guess lies beside the person's
SURFACE_M = 0.06   # how far its depth lies before or behind


class CloseScenes:
    """The stream of near looks of a seed."""

    def __init__(
        self, scenes: TrainingScenes, seed: int, *, width: int, height: int, focal_px: float,
        shown_at_m: float,
    ) -> None:
        """Prepare to look.

        Args:
            scenes: Where people come from; fine images.
            seed: Decides the looks.
            width: Width of a look [px].
            height: Height of a look [px].
            focal_px: Focal length that the network believes in [px].
            shown_at_m: Depth at which everybody appears [m].
        """
        self.scenes = scenes
        self.size = (width, height)
        self.focal_px = focal_px
        self.shown_at_m = shown_at_m
        self._rng = np.random.default_rng([seed, 12])
        self._looks = self._drawn()

    def draw(self) -> TrainingScene:
        """Return the next look: depth, truth and camera as the network is to believe in them."""
        return next(self._looks)

    def _drawn(self) -> Iterator[TrainingScene]:
        while True:
            scene = self.scenes.draw()
            for index in range(len(scene.people)):
                own = scene.depth_m[(scene.owner == index) & np.isfinite(scene.depth_m)]
                if not len(own):
                    continue
                shown = self._look_at(scene, index, float(np.median(own)))
                if np.count_nonzero(shown.owner == index) >= FEWEST_SHOWN:
                    yield shown
            if self._rng.random() < NOBODY_SHARE * max(len(scene.people), 1):
                yield self._look_at_nobody(scene)

    def _look_at(self, scene: TrainingScene, index: int, surface_m: float) -> TrainingScene:
        """Return a look around the joints of a person who lie in the image."""
        points = scene.people[index].shared_points
        rays = np.clip(
            points[:, :2] / np.maximum(points[:, 2:], 0.1), *border_rays(scene.camera))
        return self._shown(scene, (rays.min(axis=0) + rays.max(axis=0)) / 2, surface_m)

    def _look_at_nobody(self, scene: TrainingScene) -> TrainingScene:
        """Return a look around some surface that is nobody's, as false first looks take it."""
        near = (scene.owner < 0) & (scene.depth_m > NOBODY_M[0]) & (scene.depth_m < NOBODY_M[1])
        rows, columns = np.nonzero(near)
        if not len(rows):
            return self._shown(scene, np.zeros(2), NOBODY_M[1] / 2)
        k = int(self._rng.integers(len(rows)))
        camera = scene.camera
        ray = (np.array([columns[k], rows[k]]) - [camera.cx, camera.cy]) / camera.fx
        return self._shown(scene, ray, float(scene.depth_m[rows[k], columns[k]]))

    def _shown(
        self, scene: TrainingScene, middle: Float[np.ndarray, '2'], surface_m: float
    ) -> TrainingScene:
        """Return the view around a ray, at a depth, both guessed with an error."""
        rng = self._rng
        surface_m = max(surface_m + rng.normal(0.0, SURFACE_M), 0.3)
        middle = middle + rng.normal(0.0, GUESSED_M, 2) / surface_m
        enlarged = surface_m / self.shown_at_m
        camera = centred_camera(middle, *self.size, self.focal_px, enlarged)
        return seen_from_near(scene, NetworkView(
            camera, enlarged, surface_m - self.shown_at_m, self.shown_at_m - BEFORE_M))


def seen_from_near(scene: TrainingScene, view: NetworkView) -> TrainingScene:
    """Return a scene as a view shows it, with the truth in the camera that the view pretends.

    Args:
        scene: Fine image and truth.
        view: What to show.
    """
    fine = scene.camera
    rows, columns = shown_pixels(fine, view)
    inside = (((rows >= 0) & (rows < fine.height))[:, None]
              & ((columns >= 0) & (columns < fine.width)))
    at = np.ix_(rows.clip(0, fine.height - 1), columns.clip(0, fine.width - 1))
    depth_m = scene.depth_m[at] - np.float32(view.nearer_m)
    with np.errstate(invalid='ignore'):
        there = inside & (depth_m >= view.nearest_m)
    return TrainingScene(
        np.where(there, depth_m, np.float32(np.nan)),
        np.where(there, scene.owner[at], np.int8(-1)),
        np.where(there, scene.part_labels[at], np.int8(-1)),
        tuple(replace(p, shared_points=view.from_camera(p.shared_points)) for p in scene.people),
        view.camera)
