"""What the network should say about a batch: the truth of each cell of stride 4."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int, UInt8
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own word for it

from pop_core.keypoints.canonical_depth import STRIDE
from pop_core.training.shards import MAX_PEOPLE, OWNER_SHIFT

NOTHING_M = 1e3
FEWEST_CELLS = 4  # people with fewer do not weigh more
BEHIND_M = 0.1  # joints nearer to the camera plane than this have no pixel


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Depth images and their truth, on the device of the network.

    Args:
        depth_m: Depth [m], 0 where nothing was measured.
        labels: Part and owner, packed as in shards.
        points: The shared points [m].
        visible: Whether the camera sees them.
        lens: fx, fy, cx, cy [px].
    """

    depth_m: Float[Tensor, 'n h w']
    labels: UInt8[Tensor, 'n h w']
    points: Float[Tensor, 'n 6 15 3']
    visible: Bool[Tensor, 'n 6 15']
    lens: Float[Tensor, 'n 4']


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Truth per cell (n h w) and per cell that shows a person (m), listed image by image.

    Args:
        part: Class of the body part.
        measured: Cells in which anything was measured.
        person: Cells that show a person.
        who: Person of each listed cell: 6 times the image, plus the index in the image.
        votes: Offsets of its joints, as in DepthMaps.
        known: Joints with a pixel.
        visible: Joints that the camera sees.
        weight: Weight of the cell: everybody counts, the near not by their pixels.
    """

    part: Int[Tensor, 'n h w']
    measured: Bool[Tensor, 'n h w']
    person: Bool[Tensor, 'n h w']
    who: Int[Tensor, 'm']
    votes: Float[Tensor, 'm 15 3']
    known: Bool[Tensor, 'm 15']
    visible: Bool[Tensor, 'm 15']
    weight: Float[Tensor, 'm']


def cell_depth(
    depth_m: Float[Tensor, 'n h w'],
) -> tuple[Float[Tensor, 'n h4 w4'], Int[Tensor, 'n h4 w4']]:
    """Return the nearest depth of each cell [m] (NOTHING_M when none) and its flat pixel."""
    filled = torch.where(depth_m > 0, depth_m, NOTHING_M)
    negative, index = F.max_pool2d(-filled[:, None], STRIDE, return_indices=True)
    return -negative[:, 0], index[:, 0]


def make_targets(batch: Batch) -> Targets:
    """Return the truth of each cell: that of its nearest pixel."""
    nearest, index = cell_depth(batch.depth_m)
    n, h, w = nearest.shape
    labels = batch.labels.reshape(n, -1).gather(1, index.reshape(n, -1)).reshape(n, h, w).long()
    measured = nearest < NOTHING_M
    person = measured & (labels >= 1 << OWNER_SHIFT)
    image, row, column = torch.nonzero(person, as_tuple=True)
    owner = (labels[person] >> OWNER_SHIFT) - 1
    points = batch.points[image, owner]
    middle = torch.stack([cell_middle(column), cell_middle(row)], dim=1)
    who = image * MAX_PEOPLE + owner
    count = torch.bincount(who, minlength=n * MAX_PEOPLE)
    return Targets(
        part=labels & ((1 << OWNER_SHIFT) - 1), measured=measured, person=person, who=who,
        votes=_votes(points, nearest[person], middle, batch.lens[image]),
        known=points[..., 2] > BEHIND_M, visible=batch.visible[image, owner],
        weight=count[who].clamp(min=FEWEST_CELLS).rsqrt())


def cell_middle(index: Int[Tensor, 'm']) -> Float[Tensor, 'm']:
    """Return the pixel of the input in the middle of a row or column of cells [px]."""
    return index * float(STRIDE) + (STRIDE - 1) / 2


def _votes(
    points: Float[Tensor, 'm 15 3'], depth_m: Float[Tensor, 'm'], middle: Float[Tensor, 'm 2'],
    lens: Float[Tensor, 'm 4'],
) -> Float[Tensor, 'm 15 3']:
    """Return the offsets of points from cells."""
    z = points[..., 2:].clamp(min=BEHIND_M)
    focal, centre = lens[:, None, :2], lens[:, None, 2:]
    uv = points[..., :2] / z * focal + centre
    reference = depth_m[:, None, None]
    shift = (uv - middle[:, None]) * reference / focal
    return torch.cat([shift, points[..., 2:] - reference], dim=-1)
