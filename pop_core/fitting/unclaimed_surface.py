"""Surface that hangs together with a person's skeleton, though no hypothesis explains it.

A hypothesis calls the pixels near itself the person's. A leg that stands clear, but whose
keypoints were missed or lie elsewhere, is then nobody's, and a body without it costs no more than
one with it. What hangs together with the bones that were lifted, and is no large flat surface as
walls, tables and seats are, is the person's as far as depth can tell.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import SHARED_INDEX
from pop_core.fitting.observation import Observation
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.skeleton import linked
from pop_core.segmentation.flat_surfaces import LEAST_M2, find_planes, pieces_of_plane
from pop_core.segmentation.growth_kernels import creep

SAMPLES = 8  # points along each bone
BONE_WIDTH_M = 0.14
NEAR_M, ALONG_M = 0.15, 0.3  # surface this near to a bone, along the ray, may be its own
NAMED_SHARE = 0.3  # a flat surface that bones cover to less than this is no person's
STEP_M, STEP_SIGMAS = 0.025, 2.0  # of depth between neighbouring pixels of one surface
SMALLEST_M2, LARGEST_M2 = 0.003, 0.2  # of a limb or what is seen of it
MOST_M2 = 0.3  # where more is left out, the surface went on to a soft seat, say
# How far a person reaches from joints of the trunk [m].
REACH_M = {
    'left_shoulder': 0.75, 'right_shoulder': 0.75, 'neck': 0.8,
    'left_hip': 1.0, 'right_hip': 1.0, 'pelvis': 1.0}


class UnclaimedSurface:
    """What hangs together with the lifted bones of one observation.

    `found` holds every piece that was ever left out, None before the first.
    """

    def __init__(self, observation: Observation) -> None:
        """Find what hangs together with the lifted bones of an observation."""
        self.observation = observation
        self._bones = _BonePixels.of(observation)
        depth_m, camera = np.nan_to_num(observation.depth_m), observation.camera
        self._pixel_m2 = (depth_m / camera.fx) * (depth_m / camera.fy)
        self._person: Bool[np.ndarray, 'h w'] | None = None
        self._with_flats = self._reached(observation.own)
        self.found: Bool[np.ndarray, 'h w'] | None = None

    def pieces(self, claimed: Bool[np.ndarray, 'h w']) -> Bool[np.ndarray, 'h w']:
        """Return the pieces as large as limbs that hypotheses leave out, and remember them.

        Args:
            claimed: Pixels that some hypothesis explains.
        """
        out = self._limb_sized(self._with_flats & ~claimed, np.inf)
        if not out.any():
            return out
        if self._person is None:
            self._person = self._reached(self.observation.own & ~self._flats())
        left_out = self._person & ~claimed
        if self._pixel_m2[left_out].sum() > MOST_M2:
            return np.zeros_like(claimed)
        out = self._limb_sized(left_out, LARGEST_M2)
        if out.any():
            self.found = out if self.found is None else self.found | out
        return out

    def _reached(self, allowed: Bool[np.ndarray, 'h w']) -> Bool[np.ndarray, 'h w']:
        """Return the allowed pixels that hang together with bones, within a person's reach."""
        observation, camera = self.observation, self.observation.camera
        lifted = observation.lifted
        trunk = [name for name in REACH_M if lifted.lifted[SHARED_INDEX[name]]]
        centres = lifted.positions_camera[[SHARED_INDEX[name] for name in trunk]]
        out = np.zeros(allowed.shape, dtype=bool)
        bones = self._bones.within(NEAR_M)
        out[bones.v, bones.u] = allowed[bones.v, bones.u]
        creep(
            out, allowed, observation.depth_m, STEP_M, STEP_SIGMAS * observation.noise.per_m,
            centres, np.array([REACH_M[name] for name in trunk]),
            camera.fx, camera.fy, camera.cx, camera.cy)
        return out

    def _flats(self) -> Bool[np.ndarray, 'h w']:
        """Return the pixels of large flat surfaces that bones do not name."""
        observation, camera = self.observation, self.observation.camera
        bones = self._bones.within(ALONG_M)
        out = np.zeros(observation.own.shape, dtype=bool)
        for plane in find_planes(observation.depth_m, camera, observation.noise):
            number, area_m2 = pieces_of_plane(
                plane, observation.depth_m, observation.rays, camera, observation.noise)
            named_m2 = np.bincount(
                number[bones.v, bones.u], weights=bones.area_m2, minlength=len(area_m2))
            flat = (area_m2 > LEAST_M2) & (named_m2 < NAMED_SHARE * area_m2)
            out |= flat[number]
        return out

    def _limb_sized(
        self, mask: Bool[np.ndarray, 'h w'], largest_m2: float
    ) -> Bool[np.ndarray, 'h w']:
        """Return the connected pieces of a mask that are neither rims nor larger than limbs."""
        opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        count, number = cv2.connectedComponents(opened, connectivity=4)
        rows = opened > 0
        area_m2 = np.bincount(number[rows], weights=self._pixel_m2[rows], minlength=count)
        fits = (area_m2 > SMALLEST_M2) & (area_m2 < largest_m2)
        return np.asarray(fits[number])


class _BonePixels:
    """Pixels along the lifted bones, and how far behind the measured surface the bone lies."""

    def __init__(
        self, u: Int[np.ndarray, 'n'], v: Int[np.ndarray, 'n'], behind_m: Float[np.ndarray, 'n'],
        area_m2: Float[np.ndarray, 'n'],
    ) -> None:
        self.u, self.v, self.behind_m, self.area_m2 = u, v, behind_m, area_m2

    @classmethod
    def of(cls, observation: Observation) -> _BonePixels:
        """Return the pixels of an observation's bones that lie in its window."""
        points, area_m2 = _along_bones(observation.lifted)
        measured_m, uv = observation.depth_at(points)
        behind_m = np.abs(points[:, 2] - measured_m)
        inside = np.isfinite(behind_m)
        u, v = uv[inside].T
        return cls(u, v, behind_m[inside], area_m2[inside])

    def within(self, most_m: float) -> _BonePixels:
        """Return the pixels whose surface lies no farther than this from the bone [m]."""
        near = self.behind_m < most_m
        return _BonePixels(self.u[near], self.v[near], self.behind_m[near], self.area_m2[near])


def _along_bones(
    lifted: LiftedJoints,
) -> tuple[Float[np.ndarray, 'n 3'], Float[np.ndarray, 'n']]:
    """Return points along the lifted bones [m], and the area each stands for [m^2]."""
    parent = linked(lifted.lifted)
    ends = np.flatnonzero(parent >= 0)
    start = lifted.positions_camera[parent[ends]]
    bone = lifted.positions_camera[ends] - start
    shares = np.linspace(0.0, 1.0, SAMPLES)
    points = start[:, None] + shares[None, :, None] * bone[:, None]
    area_m2 = np.linalg.norm(bone, axis=1) * BONE_WIDTH_M / SAMPLES
    return points.reshape(-1, 3), np.repeat(area_m2, SAMPLES)
