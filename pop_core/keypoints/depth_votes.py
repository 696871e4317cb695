"""What the cells of the depth network's output say: body parts, and votes for joints in 3D.

Every cell that shows a person votes for the 15 joints of that person, in 3D and with a sigma of
its own (Girshick et al. 2011 vote so for one person).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from pop_core.body.joints import SHARED_INDEX
from pop_core.geometry.camera import Camera
from pop_core.keypoints.body_parts import BACKGROUND
from pop_core.keypoints.canonical_depth import STRIDE
from pop_core.keypoints.close_view import NetworkView
from pop_core.keypoints.network import Tensor
from pop_core.settings import setting

TRUNK = np.array([SHARED_INDEX[name] for name in (
    'pelvis', 'left_hip', 'right_hip', 'neck', 'left_shoulder', 'right_shoulder')])
NEAREST_M = 0.15  # from the camera: votes before this have no pixel


@dataclass(frozen=True, slots=True)
class DepthNetConfig:
    """Settings of the depth network's decoding."""

    min_person_probability: float = setting(
        0.5, minimum=0.05, maximum=0.95, about='Cells that show a person with less are left out.')
    min_area_m2: float = setting(
        0.015, unit='m^2', minimum=0.0, maximum=1.0,
        about='Smallest visible surface, as seen from the camera, that makes a person.')
    min_candidate_score: float = setting(
        0.09, minimum=0.0, maximum=1.0,
        about='Smallest score of the first look that earns a near one.')
    min_person_score: float = setting(
        0.30, minimum=0.0, maximum=1.0,
        about='Smallest score of a person: of surface and surest joints, in the near look first.')
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
        part: Probability of each class of body part, the background first.
        joints: Where each joint of its person is, camera frame [m].
        sigma_m: Laplace scale of each [m].
        visible: Probability that the camera sees it.
    """

    row: Int[np.ndarray, 'n']
    column: Int[np.ndarray, 'n']
    depth_m: Float[np.ndarray, 'n']
    area_m2: Float[np.ndarray, 'n']
    probability: Float[np.ndarray, 'n']
    part: Float[np.ndarray, 'n c']
    joints: Float[np.ndarray, 'n 15 3']
    sigma_m: Float[np.ndarray, 'n 15']
    visible: Float[np.ndarray, 'n 15']

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.row)

    def chosen(self, rows: Bool[np.ndarray, 'n'] | Int[np.ndarray, 'k']) -> Cells:
        """Return some of the cells."""
        return Cells(*(getattr(self, name)[rows] for name in Cells.__slots__))

    def joined(self, others: Cells) -> Cells:
        """Return these cells and others."""
        return Cells(*(np.concatenate([getattr(self, name), getattr(others, name)])
                       for name in Cells.__slots__))


def read_cells(
    outputs: Sequence[Tensor], shown_m: Float32[np.ndarray, 'H W'], view: NetworkView,
    min_probability: float,
) -> Cells:
    """Return the cells that show people.

    Args:
        outputs: Parts, votes, log sigma and visibility.
        shown_m: The network's input [m].
        view: What the input shows.
        min_probability: Least probability of a person.
    """
    parts, votes, log_sigma, visible = outputs
    nearest = cell_depth(shown_m)
    probability = _softmax(parts)
    person = 1.0 - probability[BACKGROUND]
    row, column = np.nonzero((person > min_probability) & np.isfinite(nearest))
    z = nearest[row, column].astype(np.float64)
    depth_m = z + view.nearer_m
    return Cells(
        row, column, depth_m, (depth_m * STRIDE / (view.camera.fx * view.enlarged)) ** 2,
        person[row, column].astype(np.float64),
        probability[:, row, column].T.astype(np.float64),
        view.to_camera(read_votes(
            votes, row, column, z, view.camera, NEAREST_M + max(-view.nearer_m, 0.0))),
        np.exp(log_sigma[:, row, column].T.astype(np.float64)),
        1.0 / (1.0 + np.exp(-visible[:, row, column].T.astype(np.float64))))


def cell_depth(depth_m: Float32[np.ndarray, 'h w']) -> Float32[np.ndarray, 'h4 w4']:
    """Return the nearest depth of each cell [m], +inf where nothing was measured."""
    filled = np.where(depth_m > 0, depth_m, np.float32(np.inf))
    # Row by row, then column by column: ten times as fast as the least of blocks.
    rows = np.minimum.reduce([filled[k::STRIDE] for k in range(STRIDE)])
    return np.minimum.reduce([rows[:, k::STRIDE] for k in range(STRIDE)])


def read_votes(
    votes: Float32[np.ndarray, '45 h w'], row: Int[np.ndarray, 'n'], column: Int[np.ndarray, 'n'],
    depth_m: Float[np.ndarray, 'n'], camera: Camera, nearest_m: float = NEAREST_M,
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
        nearest_m: Depth that no joint is nearer than [m].
    """
    offset = votes[:, row, column].T.reshape(-1, 15, 3).astype(np.float64)
    middle = np.column_stack([column, row]) * float(STRIDE) + (STRIDE - 1) / 2
    scale = (camera.fx / depth_m)[:, None, None]
    uv = middle[:, None] + offset[..., :2] * scale
    z = np.maximum(depth_m[:, None] + offset[..., 2], nearest_m)
    xy = (uv - [camera.cx, camera.cy]) / [camera.fx, camera.fy] * z[..., None]
    return np.concatenate([xy, z[..., None]], axis=2)


def _softmax(logits: Tensor) -> Tensor:
    shifted = np.exp(logits - logits.max(axis=0, keepdims=True))
    return np.asarray(shifted / shifted.sum(axis=0, keepdims=True))
