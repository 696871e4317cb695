"""Losses of the depth network: cross-entropy and Dice on parts, likelihoods on votes and sight."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F  # noqa: N812 - torch's own word for it

from pop_core.training.network import JOINTS, DepthMaps
from pop_core.training.targets import Targets

# Background cells are twenty times as many as a person's and mostly easy.
PERSON_WEIGHT = 3.0
VISIBLE_WEIGHT = 0.3
DICE_WEIGHT = 0.3
FARTHEST_M = 2.5  # a vote further off teaches nothing that half of it would not


def losses(maps: DepthMaps, targets: Targets) -> dict[str, Float[Tensor, '']]:
    """Return the weighted terms whose sum is minimised."""
    said = person_cells(maps, targets)
    parts = maps.parts.float()
    return {
        'parts': _part_loss(parts, targets),
        'votes': _vote_loss(said, targets),
        'visible': VISIBLE_WEIGHT * _visible_loss(said, targets),
        'dice': DICE_WEIGHT * _dice_loss(parts, targets),
    }


class PersonCells(NamedTuple):
    """What the network says in the cells that show a person."""

    votes: Float[Tensor, 'm 15 3']
    log_sigma: Float[Tensor, 'm 15']
    visible: Float[Tensor, 'm 15']


def person_cells(maps: DepthMaps, targets: Targets) -> PersonCells:
    """Return the maps in the listed cells of the targets."""
    votes, log_sigma, visible = (
        x.permute(0, 2, 3, 1)[targets.person].float() for x in maps[1:])
    return PersonCells(votes.reshape(-1, JOINTS, 3), log_sigma, visible)


def _part_loss(logits: Float[Tensor, 'n c h w'], targets: Targets) -> Float[Tensor, '']:
    each = F.cross_entropy(logits, targets.part, reduction='none')
    weight = targets.measured * (1.0 + (PERSON_WEIGHT - 1.0) * targets.person)
    return (each * weight).sum() / weight.sum().clamp(min=1.0)


def _dice_loss(logits: Float[Tensor, 'n c h w'], targets: Targets) -> Float[Tensor, '']:
    """Return 1 - Dice of person against background (Milletari et al. 2016)."""
    person = (1.0 - logits.softmax(dim=1)[:, 0]) * targets.measured
    both = (person * targets.person).sum()
    return 1.0 - (2.0 * both + 1.0) / (person.sum() + targets.person.sum() + 1.0)


def _vote_loss(said: PersonCells, targets: Targets) -> Float[Tensor, '']:
    """Return the mean negative log likelihood of Laplace's distribution, up to a constant."""
    error = (said.votes - targets.votes).abs().clamp(max=FARTHEST_M).mean(dim=-1)
    return _mean(error * torch.exp(-said.log_sigma) + said.log_sigma, targets)


def _visible_loss(said: PersonCells, targets: Targets) -> Float[Tensor, '']:
    return _mean(F.binary_cross_entropy_with_logits(
        said.visible, targets.visible.float(), reduction='none'), targets)


def _mean(each: Float[Tensor, 'm 15'], targets: Targets) -> Float[Tensor, '']:
    weight = targets.known * targets.weight[:, None]
    return (each * weight).sum() / weight.sum().clamp(min=1.0)
