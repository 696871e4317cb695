"""One optimisation of the depth network: step, learning rate, averaged weights, state on disk."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from pop_core.errors import PopError
from pop_core.training.losses import losses
from pop_core.training.muon import Muon
from pop_core.training.network import DepthNet, NetworkConfig
from pop_core.training.targets import Batch, make_targets

REQUIRED = {'network_config', 'averaged', 'history', 'images'}


class CheckpointError(PopError):
    """A file of weights that is damaged or of another network."""


@dataclass(frozen=True, slots=True)
class TrainConfig:
    """How the network is trained.

    Args:
        batch: Images per step.
        rate: Largest learning rate of AdamW (Loshchilov and Hutter 2019), which changes the first
            and last layers, norms and biases.
        matrix_rate: Largest learning rate of Muon, which changes all other convolutions.
        decay: Weight decay of both.
        warm_up: Steps over which the rate rises.
        average: Share of the old average kept per step.
        curriculum: Images over which scenes go from hardly hidden people to all.
        first_hidden: Largest share of hidden joints at the beginning.
        clip: Largest norm of the gradient.
    """

    batch: int = 32
    rate: float = 2e-3
    matrix_rate: float = 0.006
    decay: float = 0.02
    warm_up: int = 200
    average: float = 0.99
    curriculum: int = 10_000
    first_hidden: float = 0.3
    clip: float = 5.0


class Trainer:
    """Network, averaged network and optimisers."""

    def __init__(
        self, device: torch.device, network: NetworkConfig | None = None,
        config: TrainConfig | None = None,
    ) -> None:
        """Begin with random weights."""
        self.device = device
        self.config = config or TrainConfig()
        self.network = DepthNet(network).to(device, memory_format=torch.channels_last)
        self.averaged = deepcopy(self.network).eval()
        matrices = list(self.network.hidden_weights())
        known = {id(weight) for weight in matrices}
        others = [weight for weight in self.network.parameters() if id(weight) not in known]
        self.optimisers: dict[str, torch.optim.Optimizer] = {
            'matrices': Muon(matrices, self.config.matrix_rate, decay=self.config.decay),
            'others': torch.optim.AdamW(
                others, self.config.rate, weight_decay=self.config.decay, fused=True),
        }
        self.steps = 0
        self.images = 0
        self.history: list[dict[str, float]] = []

    def step(self, batch: Batch, rate_factor: float = 1.0) -> dict[str, Tensor]:
        """Learn from a batch; return the terms of the loss, on the device.

        Args:
            batch: Images of the network's input size.
            rate_factor: Multiplies the learning rate, for the end of a training.
        """
        factor = min(1.0, (self.steps + 1) / self.config.warm_up) * rate_factor
        rates = {'matrices': self.config.matrix_rate, 'others': self.config.rate}
        for name, optimiser in self.optimisers.items():
            for group in optimiser.param_groups:
                group['lr'] = rates[name] * factor
        targets = make_targets(batch)
        self.network.train()
        # bfloat16 needs no scaling of the loss.
        with torch.autocast(self.device.type, torch.bfloat16, has_bfloat16(self.device)):
            maps = self.network(batch.depth_m[:, None].contiguous(
                memory_format=torch.channels_last))
        terms = losses(maps, targets)
        total = torch.stack(list(terms.values())).sum()
        self.network.zero_grad(set_to_none=True)
        total.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), self.config.clip)
        for optimiser in self.optimisers.values():
            optimiser.step()
        self.steps += 1
        self.images += len(batch.depth_m)
        self._average()
        return {name: term.detach() for name, term in terms.items()}

    @property
    def most_hidden(self) -> float:
        """Return the largest share of hidden joints that the curriculum allows by now."""
        first = self.config.first_hidden
        return min(1.0, first + (1.0 - first) * self.images / max(self.config.curriculum, 1))

    @torch.no_grad()
    def _average(self) -> None:
        keep = min(self.config.average, (1 + self.steps) / (10 + self.steps))
        current = self.network.state_dict()
        for name, average in self.averaged.state_dict().items():
            # Statistics of norms are averaged too: today's do not fit yesterday's weights.
            if average.is_floating_point():
                average.lerp_(current[name], 1.0 - keep)
            else:
                average.copy_(current[name])

    def save(self, path: Path) -> None:
        """Write everything that a later run needs to go on."""
        _write(path, {
            'network_config': asdict(self.network.config), 'network': self.network.state_dict(),
            'averaged': self.averaged.state_dict(),
            'optimisers': {name: o.state_dict() for name, o in self.optimisers.items()},
            'steps': self.steps, 'images': self.images, 'history': self.history,
        })

    def save_weights(self, path: Path) -> None:
        """Write the averaged weights alone, in half precision: small enough to be kept."""
        state = self.averaged.state_dict()
        half = {name: value.half() if value.is_floating_point() else value
                for name, value in state.items()}
        _write(path, {
            'network_config': asdict(self.network.config), 'averaged': half,
            'images': self.images, 'history': self.history,
        })

    def load(self, path: Path) -> None:
        """Go on from a file written by `save`, or begin with the weights of `save_weights`.

        Weights of a network for another look are a beginning: what they learned is not counted.

        Raises:
            CheckpointError: If it is no checkpoint of a network of this size, or one to go on from
                that was trained for another look.
        """
        state = read_checkpoint(path)
        is_same = config_of(state, path) == self.network.config
        if 'network' in state and not is_same:
            raise CheckpointError(
                f'{path}: expected a training of {self.network.config} to go on with, '
                f'found one of {state["network_config"]}')
        try:
            self.averaged.load_state_dict(state['averaged'])
            self.network.load_state_dict(state.get('network', state['averaged']))
            for name, content in state.get('optimisers', {}).items():
                self.optimisers[name].load_state_dict(content)
        except (RuntimeError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise CheckpointError(
                f'{path}: expected weights of a network as {self.network.config}, found '
                f'{state["network_config"]}') from error
        if is_same:
            self.steps, self.images = state.get('steps', 0), state['images']
            self.history = list(state['history'])


def has_bfloat16(device: torch.device) -> bool:
    """Return whether a device has bfloat16 itself: imitated it is slower than float32."""
    if device.type == 'cuda':
        return torch.cuda.is_bf16_supported(including_emulation=False)
    return bool(torch.cpu.get_capabilities().get('avx512_bf16', False))


def load_network(path: Path) -> DepthNet:
    """Return the averaged network of a checkpoint, ready to be used on the CPU.

    Raises:
        CheckpointError: If it is no checkpoint.
    """
    state = read_checkpoint(path)
    network = DepthNet(config_of(state, path))
    network.load_state_dict(state['averaged'])
    return network.eval()


def config_of(state: Mapping[str, Any], path: Path) -> NetworkConfig:
    """Return the size of the network whose weights a checkpoint holds.

    Raises:
        CheckpointError: If the weights are not those of a network of the size it states.
    """
    found, weights = state['network_config'], state['averaged']
    try:
        config = NetworkConfig(**found)
        # Every stage and block has weights: what states more is not built, however large.
        if min(config.blocks) < 0 or sum(config.blocks) + len(config.widths) > len(weights):
            raise ValueError('more blocks than weights')
        with torch.device('meta'):  # and what is built here has no memory
            DepthNet(config).load_state_dict(weights, assign=True)
    except (TypeError, ValueError, RuntimeError, AttributeError) as error:
        raise CheckpointError(
            f'{path}: expected weights of a depth network, found others than those of {found}'
        ) from error
    return config


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Return the content of a checkpoint; nothing but tensors and numbers is ever read.

    Raises:
        CheckpointError: If it is none.
    """
    try:
        state = torch.load(path, map_location='cpu', weights_only=True)
    except Exception as error:  # noqa: BLE001 - torch tells damaged files by many exceptions
        reason = ' '.join(str(error).split())[:120]
        raise CheckpointError(f'{path}: expected a checkpoint, found: {reason}') from None
    if not isinstance(state, dict) or not REQUIRED <= set(state):
        raise CheckpointError(f'{path}: expected a checkpoint of the depth network, found another')
    return state


def _write(path: Path, state: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix('.part')
    torch.save(state, part)
    part.replace(path)
