"""Scenes kept on the network's device, the oldest replaced as new ones are drawn or read."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from jaxtyping import Float, Int
from torch import Tensor

from pop_core.training.shards import OWNER_SHIFT, Shard
from pop_core.training.targets import Batch

SHOWN_PX = 200.0  # scenes with this many pixels of people are drawn twice as often as empty ones


class ScenePool:
    """A ring of scenes of one size."""

    def __init__(self, capacity: int, device: torch.device) -> None:
        """Begin empty, for at most `capacity` scenes."""
        self.capacity = capacity
        self.device = device
        self.count = 0
        self.received = 0
        self._arrays: list[Tensor] = []
        self._hidden = torch.zeros(capacity)
        self._worth = torch.zeros(capacity)

    def add(self, shard: Shard) -> None:
        """Take scenes in, in place of the oldest when full."""
        arrays = [torch.from_numpy(array) for array in (
            shard.depth_mm.clip(0, 32767).astype('int16'), shard.labels, shard.points,
            shard.visible, shard.lens)]
        if not self._arrays:
            self._arrays = [
                torch.empty((self.capacity, *a.shape[1:]), dtype=a.dtype, device=self.device)
                for a in arrays]
        at = torch.arange(self.received, self.received + len(shard)) % self.capacity
        for stored, array in zip(self._arrays, arrays, strict=True):
            stored[at.to(self.device)] = array.to(self.device)
        self._hidden[at] = hidden_share(shard)
        self._worth[at] = worth(shard)
        self.received += len(shard)
        self.count = min(self.received, self.capacity)

    def draw(
        self, size: int, generator: torch.Generator, most_hidden: float = 1.0
    ) -> Batch:
        """Return a random batch of scenes of which at most a share of joints is hidden."""
        allowed = self._hidden[: self.count] <= most_hidden
        chance = self._worth[: self.count] * (allowed if allowed.sum() >= size else 1.0)
        return self.at(torch.multinomial(chance, size, replacement=True, generator=generator))

    def at(self, rows: Int[Tensor, 'n'] | Sequence[int]) -> Batch:
        """Return given scenes."""
        chosen = torch.as_tensor(rows, device=self.device)
        depth, labels, points, visible, lens = (array[chosen] for array in self._arrays)
        return Batch(depth.float() / 1e3, labels, points, visible, lens)


def hidden_share(shard: Shard) -> Float[Tensor, 'n']:
    """Return the share of joints that the camera does not see, over each scene's people."""
    there = torch.from_numpy((shard.points != 0).any(axis=(2, 3)))
    hidden = ~torch.from_numpy(shard.visible) & there[:, :, None]
    return hidden.sum(dim=(1, 2)) / (15.0 * there.sum(dim=1)).clamp(min=1.0)


def worth(shard: Shard) -> Float[Tensor, 'n']:
    """Return how often each scene is drawn: the more it shows of people, the more it teaches."""
    shown = (torch.from_numpy(shard.labels) >= 1 << OWNER_SHIFT).sum(dim=(1, 2))
    return 1.0 + (shown / SHOWN_PX).sqrt()
