"""People from votes: cells that agree where a trunk is are one person, and tell its joints.

Every cell that shows a person votes for the 15 joints of that person, in 3D and with a sigma of
its own (Girshick et al. 2011 vote so for one person). Two people cannot have their trunks in one
place, however much they overlap in the image.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from pop_core.body.joints import SHARED_INDEX
from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth import STRIDE
from pop_core.settings import setting

TRUNK = np.array([SHARED_INDEX[name] for name in (
    'pelvis', 'left_hip', 'right_hip', 'neck', 'left_shoulder', 'right_shoulder')])
BANDWIDTH_M = 0.12
SHIFTS = 4
MOST_CELLS = 700  # of a trunk's search; more are thinned out
NEAREST_M = 0.15   # votes before this have no pixel
HUBER_M = 0.10
ROUNDS = 3
GOOD_M = 0.10  # a keypoint's score is the chance that it is nearer than this
DOUBTED_M2 = 0.12  # surface of which false people show less, true ones more


@dataclass(frozen=True, slots=True)
class DepthNetConfig:
    """Settings of the depth network's decoding."""

    min_person_probability: float = setting(
        0.5, minimum=0.05, maximum=0.95, about='Cells that show a person with less are left out.')
    min_area_m2: float = setting(
        0.03, unit='m^2', minimum=0.0, maximum=1.0,
        about='Smallest visible surface, as seen from the camera, that makes a person.')
    min_person_score: float = setting(
        0.32, minimum=0.0, maximum=1.0,
        about='Smallest score of a person: that of the surface seen and of the surest joints.')
    trunk_gap_m: float = setting(
        0.30, unit='m', minimum=0.05, maximum=1.0,
        about='Two trunks nearer to each other than this are the same person.')
    reach_m: float = setting(
        0.45, unit='m', minimum=0.1, maximum=2.0,
        about='Farthest that a cell may place the trunk of the person that it is counted to.')


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The cells that show people.

    Args:
        row: Row of the output.
        column: Column of the output.
        depth_m: Nearest depth of the cell [m].
        area_m2: Surface that the cell shows, as seen from the camera [m^2].
        probability: That the cell shows a person.
        joints: Where each joint of its person is, camera frame [m].
        sigma_m: Laplace scale of each [m].
        visible: Probability that the camera sees it.
    """

    row: Int[np.ndarray, 'n']
    column: Int[np.ndarray, 'n']
    depth_m: Float[np.ndarray, 'n']
    area_m2: Float[np.ndarray, 'n']
    probability: Float[np.ndarray, 'n']
    joints: Float[np.ndarray, 'n 15 3']
    sigma_m: Float[np.ndarray, 'n 15']
    visible: Float[np.ndarray, 'n 15']

    def chosen(self, rows: Bool[np.ndarray, 'n'] | Int[np.ndarray, 'k']) -> Cells:
        """Return some of the cells."""
        return Cells(*(getattr(self, name)[rows] for name in Cells.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class VotedPerson:
    """One person.

    Args:
        joints: The 15 shared joints, camera frame [m].
        sigma_m: Laplace scale of each along one axis [m].
        visible: Probability that the camera sees each.
        probability: Mean probability that the person's cells show a person.
        area_m2: Surface seen [m^2].
    """

    joints: Float[np.ndarray, '15 3']
    sigma_m: Float[np.ndarray, '15']
    visible: Float[np.ndarray, '15']
    probability: float
    area_m2: float

    @property
    def existence(self) -> float:
        """Return a score 0..1 of there being a person: false ones are small and doubtful."""
        return self.probability * (1.0 - math.exp(-self.area_m2 / DOUBTED_M2))

    @property
    def certainty(self) -> Float[np.ndarray, '15']:
        """Return the chance that each joint is nearer than 10 cm, along each axis."""
        return np.asarray(1.0 - np.exp(-GOOD_M / self.sigma_m))


def read_votes(
    votes: Float32[np.ndarray, '45 h w'], row: Int[np.ndarray, 'n'], column: Int[np.ndarray, 'n'],
    depth_m: Float[np.ndarray, 'n'], camera: Camera,
) -> Float[np.ndarray, 'n 15 3']:
    """Return the points [m] that cells vote for.

    A vote is (du, dv, dz): the joint's pixel lies du * focal / depth beside the cell's middle,
    and the joint dz behind the cell's surface.

    Args:
        votes: The network's output.
        row: Rows of the cells.
        column: Columns of the cells.
        depth_m: Depth of the cells [m].
        camera: Pinhole of the network's input.
    """
    offset = votes[:, row, column].T.reshape(-1, 15, 3).astype(np.float64)
    middle = np.column_stack([column, row]) * float(STRIDE) + (STRIDE - 1) / 2
    scale = (camera.fx / depth_m)[:, None, None]
    uv = middle[:, None] + offset[..., :2] * scale
    z = np.maximum(depth_m[:, None] + offset[..., 2], NEAREST_M)
    xy = (uv - [camera.cx, camera.cy]) / [camera.fx, camera.fy] * z[..., None]
    return np.concatenate([xy, z[..., None]], axis=2)


def group_cells(cells: Cells, config: DepthNetConfig) -> Int[np.ndarray, 'n']:
    """Return the person of each cell, the largest first; -1 for cells that belong to nobody.

    Args:
        cells: Cells that show people.
        config: Settings.
    """
    trunk = _trunks(cells)
    mass = cells.probability * cells.area_m2
    centres = _modes(trunk, mass, config.trunk_gap_m)
    owner = np.full(len(trunk), -1, dtype=np.int64)
    if len(centres) == 0:
        return owner
    distance = np.linalg.norm(trunk[:, None] - centres[None], axis=2)
    nearest = distance.argmin(axis=1)
    owner = np.where(distance.min(axis=1) < config.reach_m, nearest, -1)
    total = np.array([mass[owner == k].sum() for k in range(len(centres))])
    order = np.argsort(-total, kind='stable')
    rank = np.full(len(centres) + 1, -1)
    kept = order[total[order] >= config.min_area_m2]
    rank[kept] = np.arange(len(kept))
    return rank[owner]


def fuse_votes(cells: Cells) -> VotedPerson:
    """Return the person that cells agree on, votes weighted by the certainty they claim.

    Votes are averaged with weights 1 / sigma^4; those far from the others count less (Huber).
    Errors of neighbouring cells are alike, so that many doubtful votes are worth less than
    1 / sigma^2 says.
    """
    weight = cells.probability[:, None] / cells.sigma_m**4
    mean = _weighted_mean(cells.joints, weight)
    robust = weight
    for _ in range(ROUNDS):
        distance = np.linalg.norm(cells.joints - mean, axis=2)
        robust = weight * np.minimum(1.0, HUBER_M / np.maximum(distance, 1e-6))
        mean = _weighted_mean(cells.joints, robust)
    total = robust.sum(axis=0)
    sigma = (robust * cells.sigma_m).sum(axis=0) / total
    visible = (robust * cells.visible).sum(axis=0) / total
    return VotedPerson(
        mean, sigma, visible, float(cells.probability.mean()), float(cells.area_m2.sum()))


def _weighted_mean(
    points: Float[np.ndarray, 'n 15 3'], weight: Float[np.ndarray, 'n 15']
) -> Float[np.ndarray, '15 3']:
    return np.asarray((points * weight[..., None]).sum(axis=0) / weight.sum(axis=0)[:, None])


def _trunks(cells: Cells) -> Float[np.ndarray, 'n 3']:
    """Return where each cell sees the middle of the trunk [m]."""
    weight = 1.0 / cells.sigma_m[:, TRUNK] ** 2
    points = (cells.joints[:, TRUNK] * weight[..., None]).sum(axis=1)
    return np.asarray(points / weight.sum(axis=1, keepdims=True))


def _modes(
    points: Float[np.ndarray, 'n 3'], mass: Float[np.ndarray, 'n'], gap_m: float
) -> Float[np.ndarray, 'k 3']:
    """Return the places where mass gathers, most first, at least a gap apart (mean shift)."""
    step = -(-len(points) // MOST_CELLS)
    some, their_mass = points[::max(step, 1)], mass[::max(step, 1)]
    free = np.ones(len(some), dtype=bool)
    modes: list[Float[np.ndarray, '3']] = []
    density = _kernel(some, some) @ their_mass
    while free.any():
        start = int(np.argmax(np.where(free, density, -1.0)))
        centre = some[start]
        for _ in range(SHIFTS):
            weight = _kernel(centre[None], some)[0] * their_mass
            centre = weight @ some / weight.sum()
        free &= np.linalg.norm(some - centre, axis=1) > gap_m
        free[start] = False
        if all(np.linalg.norm(centre - mode) >= gap_m for mode in modes):
            modes.append(centre)
    return np.array(modes).reshape(-1, 3)


def _kernel(a: Float[np.ndarray, 'm 3'], b: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'm n']:
    squared = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.exp(-np.maximum(squared, 0.0) / (2 * BANDWIDTH_M**2))
