"""One training of the completion network: steps, averaged weights, state on disk."""

from __future__ import annotations

import time
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import torch

from pop_core.training.completion.network import CompletionNet, completion_loss
from pop_core.training.completion.validation import figures
from pop_core.training.completion.view_pool import Views, load_pool, varied
from pop_core.training.muon import Muon
from pop_core.training.trainer import CheckpointError, has_bfloat16

BATCH = 128
RATE, MATRIX_RATE, DECAY = 2e-3, 0.01, 0.01  # of AdamW, of Muon, of both
WARM_UP = 100  # steps
AVERAGE = 0.998  # of the old average kept per step
COOLDOWN = 0.5  # share of a run, at its end, in which the rates fall to nothing
CLIP = 1.0
REPORT_S = 60.0


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
    pool = load_pool(folder)
    held_out = None if validation is None else load_pool(validation)
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
