"""One training of the completion network: views varied, steps, averaged weights, state on disk."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Float, Int
from torch import Tensor

from pop_core.body.joints import SHARED_MIRROR
from pop_core.completion.person_view import RELIEF_M
from pop_core.training.completion.network import CompletionNet, completion_loss
from pop_core.training.completion.views import OUTSIDE, STEPS, PackedViews, load_views
from pop_core.training.muon import Muon
from pop_core.training.shards import shard_paths
from pop_core.training.trainer import CheckpointError, has_bfloat16

BATCH = 128
RATE, MATRIX_RATE, DECAY = 2e-3, 0.01, 0.01  # of AdamW, of Muon, of both
WARM_UP = 100  # steps
AVERAGE = 0.998  # of the old average kept per step
COOLDOWN = 0.5  # share of a run, at its end, in which the rates fall to nothing
CLIP = 1.0
FEWER_SHARE, FEWER = 0.3, 0.25  # views from which keypoints are taken, and how many of them
SCORE_SPREAD = 0.08  # other sources' scores mean something else
DEPTH_SPREAD_M = 0.06  # the person's depth is a guess
REPORT_S = 60.0


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
    one, two = chosen[:, None, None], chosen[:, None, None]
    return Views(
        torch.where(one, views.relief_m.flip(2), views.relief_m),
        torch.where(one, views.measured.flip(2), views.measured),
        torch.where(two, views.keypoints[:, other] * side, views.keypoints),
        torch.where(two, views.places[:, other] * side[:3], views.places))


class CompletionTrainer:
    """Network, averaged network and optimisers."""

    def __init__(self) -> None:
        """Begin with random weights."""
        self.network = CompletionNet()
        self.averaged = deepcopy(self.network).eval()
        matrices = list(self.network.hidden_weights())
        known = {id(weight) for weight in matrices}
        others = [weight for weight in self.network.parameters() if id(weight) not in known]
        self._optimisers: list[tuple[torch.optim.Optimizer, float]] = [
            (Muon(matrices, MATRIX_RATE, decay=DECAY), MATRIX_RATE),
            (torch.optim.AdamW(others, RATE, weight_decay=DECAY), RATE)]
        self._others = others
        self.steps = self.views = 0

    def step(self, views: Views, rate_factor: float = 1.0) -> float:
        """Learn from a batch; return the loss."""
        factor = rate_factor * min(1.0, (self.steps + 1) / WARM_UP)
        for optimiser, rate in self._optimisers:
            for group in optimiser.param_groups:
                group['lr'] = rate * factor
        self.network.train()
        with torch.autocast('cpu', torch.bfloat16, has_bfloat16(torch.device('cpu'))):
            said = self.network(views.relief_m, views.measured, views.keypoints)
        loss = completion_loss(said, views.places)
        self.network.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self._others, CLIP)
        for optimiser, _ in self._optimisers:
            optimiser.step()
        self.steps += 1
        self.views += len(views.places)
        self._average()
        return float(loss.detach())

    @torch.no_grad()
    def _average(self) -> None:
        keep = min(AVERAGE, (1 + self.steps) / (10 + self.steps))
        current = self.network.state_dict()
        for name, average in self.averaged.state_dict().items():
            if average.is_floating_point():
                average.lerp_(current[name], 1.0 - keep)
            else:
                average.copy_(current[name])

    def save(self, path: Path) -> None:
        """Write the averaged weights in half precision: small enough to be kept."""
        half = {name: value.half() if value.is_floating_point() else value
                for name, value in self.averaged.state_dict().items()}
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix('.part')
        torch.save({'averaged': half, 'views': self.views}, part)
        part.replace(path)

    def load(self, path: Path) -> None:
        """Go on with the weights of a file; the optimisers begin anew.

        Raises:
            CheckpointError: If it is no checkpoint of this network.
        """
        try:
            state: dict[str, Any] = torch.load(path, map_location='cpu', weights_only=True)
            for network in (self.network, self.averaged):
                network.load_state_dict(state['averaged'])
            self.views = int(state['views'])
        except Exception as error:  # noqa: BLE001 - torch tells damaged files by many exceptions
            reason = ' '.join(str(error).split())[:120]
            raise CheckpointError(
                f'{path}: expected a checkpoint of the completion network, found: {reason}'
            ) from None


def train(
    trainer: CompletionTrainer, folder: Path, validation: Path | None, out: Path, minutes: float,
    say: Callable[[str], None],
) -> None:
    """Train on the views of a folder for some minutes; `say` is told a line a minute."""
    pool = ViewPool([load_views(path) for path in shard_paths(folder)])
    held_out = None if validation is None else ViewPool(
        [load_views(path) for path in shard_paths(validation)])
    generator = torch.Generator().manual_seed(trainer.views)
    begin = told = time.monotonic()
    end, losses = begin + 60.0 * minutes, []
    while (now := time.monotonic()) < end:
        left = (end - now) / (end - begin)
        rows = torch.randint(len(pool), (BATCH,), generator=generator)
        views = varied(pool.at(rows), generator)
        losses.append(trainer.step(views, min(1.0, left / COOLDOWN)))
        if now - told > REPORT_S:
            told = now
            trainer.save(out)
            say(f'{trainer.views} views of {len(pool)}, loss {sum(losses) / len(losses):.3f}'
                + ('' if held_out is None else f', {figures(trainer.averaged, held_out)}'))
            losses = []
    trainer.save(out)
    if held_out is not None:
        say(figures(trainer.averaged, held_out))


@torch.no_grad()
def figures(network: CompletionNet, pool: ViewPool) -> str:
    """Return mean and median errors of visible and hidden joints [mm] as a line."""
    off_m = torch.cat([
        (network(v.relief_m, v.measured, v.keypoints).places - v.places).norm(dim=2)
        for v in (pool.at(rows) for rows in torch.arange(len(pool)).split(2 * BATCH))])
    visible = pool.state == 0
    words = (
        f'{name} {1e3 * off_m[rows].mean():.1f} mm mean, {1e3 * off_m[rows].median():.1f} median'
        for name, rows in (('visible', visible), ('hidden', ~visible)))
    return ', '.join(words)
