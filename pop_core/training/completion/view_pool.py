"""Packed views in memory, and batches of them, varied for learning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from jaxtyping import Float, Int
from torch import Tensor

from pop_core.body.joints import SHARED_MIRROR
from pop_core.completion.person_view import RELIEF_M
from pop_core.training.completion.views import OUTSIDE, STEPS, PackedViews, load_views
from pop_core.training.shards import shard_paths

FEWER_SHARE, FEWER = 0.3, 0.25  # views from which keypoints are taken, and how many of them
SCORE_SPREAD = 0.08  # other sources' scores mean something else
DEPTH_SPREAD_M = 0.06  # the person's depth is a guess


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """A batch of views as the network takes them, and the truth."""

    relief_m: Float[Tensor, 'n h w']
    measured: Float[Tensor, 'n h w']
    keypoints: Float[Tensor, 'n 15 f']
    places: Float[Tensor, 'n 15 3']


class ViewPool:
    """All views of some files, in memory."""

    def __init__(self, packed: Sequence[PackedViews]) -> None:
        """Take views."""
        self.relief, self.keypoints, self.places, self.state = (
            torch.cat([torch.from_numpy(getattr(views, name)) for views in packed])
            for name in ('relief', 'keypoints', 'places', 'state'))

    def __len__(self) -> int:
        """Return the number of views."""
        return len(self.relief)

    def at(self, rows: Int[Tensor, 'n']) -> Views:
        """Return given views."""
        coded = self.relief[rows]
        known = coded > OUTSIDE
        measured = known.float() - (coded == OUTSIDE).float()
        relief_m = torch.where(known, coded.float() * (RELIEF_M / STEPS), 0.0)
        return Views(relief_m, measured, self.keypoints[rows], self.places[rows])


def load_pool(folder: Path) -> ViewPool:
    """Return all packed views of a folder.

    Raises:
        ShardError: If there are none, or a file holds none.
    """
    return ViewPool([load_views(path) for path in shard_paths(folder)])


def varied(views: Views, generator: torch.Generator) -> Views:
    """Return views with some mirrored, keypoints missing, and depths a little off."""
    n = len(views.places)
    views = _mirrored(views, torch.rand(n, generator=generator) < 0.5)
    keypoints = views.keypoints
    fewer = torch.rand(n, 1, generator=generator) < FEWER_SHARE
    lost = fewer & (torch.rand(keypoints.shape[:2], generator=generator) < FEWER)
    off = SCORE_SPREAD * torch.randn(n, 1, generator=generator)
    scores = (keypoints[..., 2] + off).clamp(0.05, 1.0) * keypoints[..., 3]
    farther = DEPTH_SPREAD_M * torch.randn(n, 1, generator=generator)
    beneath = (keypoints[..., 4] + farther) * keypoints[..., 5]
    changed = torch.stack([scores, keypoints[..., 3], beneath, keypoints[..., 5]], dim=2)
    keypoints = torch.cat([keypoints[..., :2], changed], dim=2) * ~lost[..., None]
    relief_m = (views.relief_m + farther[..., None]).clamp(-RELIEF_M, RELIEF_M)
    places = views.places.clone()
    places[..., 2] += farther
    return Views(relief_m * (views.measured > 0), views.measured, keypoints, places)


def _mirrored(views: Views, chosen: Tensor) -> Views:
    """Return views of which some are seen in a mirror: left is right."""
    other = torch.as_tensor(SHARED_MIRROR)
    side = torch.ones(views.keypoints.shape[2])
    side[0] = -1.0
    rows = chosen[:, None, None]
    return Views(
        torch.where(rows, views.relief_m.flip(2), views.relief_m),
        torch.where(rows, views.measured.flip(2), views.measured),
        torch.where(rows, views.keypoints[:, other] * side, views.keypoints),
        torch.where(rows, views.places[:, other] * side[:3], views.places))
