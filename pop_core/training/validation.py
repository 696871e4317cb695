"""How good the maps are, cell by cell: quick figures for curves, with people told apart by truth.

The benchmark `detector` measures the whole detector, grouping included.
"""

from __future__ import annotations

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from pop_core.keypoints.body_parts import N_CLASSES
from pop_core.training.losses import person_cells
from pop_core.training.network import DepthMaps
from pop_core.training.shards import MAX_PEOPLE
from pop_core.training.targets import Targets

WITHIN_M = 0.10
FEWEST_CELLS = 6  # people with fewer have a hand in the image at most


class MapScores:
    """Counts over batches."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.inside = torch.zeros(2)
        self.people = torch.zeros(2)
        self.confusion = torch.zeros(N_CLASSES, N_CLASSES)
        self.sight = torch.zeros(2)

    def add(self, maps: DepthMaps, targets: Targets) -> None:
        """Count a batch."""
        part = maps.parts.argmax(dim=1)
        code = targets.part[targets.measured] * N_CLASSES + part[targets.measured]
        counted = torch.bincount(code, minlength=N_CLASSES**2)
        self.confusion += counted.reshape(N_CLASSES, N_CLASSES).cpu()
        error, seen, known = person_errors(maps, targets)
        for row, chosen in enumerate((known & seen, known & ~seen)):
            self.inside[row] += (error[chosen] < WITHIN_M).sum().cpu()
            self.people[row] += chosen.sum().cpu()
        said = person_cells(maps, targets).visible > 0
        right = (said == targets.visible)[targets.known]
        self.sight += torch.tensor([float(right.sum()), float(right.numel())])

    def figures(self) -> dict[str, float]:
        """Return PCK at 10 cm of visible and hidden joints, mean IoU of parts, sight."""
        hit = self.confusion.diagonal()
        union = self.confusion.sum(dim=0) + self.confusion.sum(dim=1) - hit
        pck = self.inside / self.people.clamp(min=1.0)
        return {
            'pck_visible': float(pck[0]), 'pck_hidden': float(pck[1]),
            'part_iou': float((hit / union.clamp(min=1.0))[1:].mean()),
            'person_iou': float(_person_iou(self.confusion)),
            'sight': float(self.sight[0] / self.sight[1].clamp(min=1.0)),
        }


def person_errors(
    maps: DepthMaps, targets: Targets
) -> tuple[Float[Tensor, 'p 15'], Bool[Tensor, 'p 15'], Bool[Tensor, 'p 15']]:
    """Return the error of each person's joints [m], whether they are seen, whether they count.

    Votes are averaged over the person's cells with the weights 1 / sigma^2 they ask for. Errors
    are those of votes: lateral ones at the depth of the cell.
    """
    said = person_cells(maps, targets)
    weight = (torch.exp(-2.0 * said.log_sigma) * targets.known)[..., None]
    people = len(targets.part) * MAX_PEOPLE
    total = weight.new_zeros(people, 15, 3)
    total.index_add_(0, targets.who, (said.votes - targets.votes) * weight)
    mass = weight.new_zeros(people, 15, 1).index_add_(0, targets.who, weight)
    seen = weight.new_zeros(people, 15).index_add_(0, targets.who, targets.visible.float())
    cells = torch.bincount(targets.who, minlength=people)
    error = (total / mass.clamp(min=1e-9)).norm(dim=-1)
    known = (mass[..., 0] > 0) & (cells >= FEWEST_CELLS)[:, None]
    return error, seen > 0, known


def _person_iou(confusion: Float[Tensor, 'c c']) -> Float[Tensor, '']:
    both = confusion[1:, 1:].sum()
    return both / (confusion.sum() - confusion[0, 0]).clamp(min=1.0)
