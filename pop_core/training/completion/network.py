"""The completion network: where the 15 joints of a person are, from depth and keypoints.

A small residual encoder of the depth around the person, into which the keypoints are drawn as
spots, and the keypoints' numbers beside it. It says of every joint, seen or not, where it is and
how far off that may be.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor, nn

from pop_core.completion.person_view import CELL_M, FEATURES, RELIEF_M, VIEW_PX
from pop_core.training.network import JOINTS, ResidualBlock, convolution

WIDTHS = (24, 48, 96, 96)  # channels at strides 2, 4, 8 and 16
HIDDEN = 384
NEAR_M = 0.25  # range of the second relief channel: limbs on trunks
SPOT_CELLS = 5.0  # spread of a keypoint's spot, in cells of the view
SIGMA_LOG_RANGE = (-4.6, 0.7)  # a centimetre to two metres
SPOT_STRIDE = 4  # of the image in which spots are drawn


class Completion(NamedTuple):
    """What the network says: places in the view [m] and the logarithm of their spread."""

    places: Float[Tensor, 'n 15 3']
    log_sigma: Float[Tensor, 'n 15']


class CompletionNet(nn.Module):
    """All joints of a person from a view of them."""

    def __init__(self) -> None:
        """Build with random weights."""
        super().__init__()
        first, second, third, last = WIDTHS
        self.stem = nn.Sequential(convolution(3, first, stride=2), convolution(first, second, 2))
        self.mixed = nn.Sequential(
            convolution(second + JOINTS, second), ResidualBlock(second),
            convolution(second, third, 2), ResidualBlock(third),
            convolution(third, last, 2), ResidualBlock(last))
        cells = (VIEW_PX // 16) ** 2 * last
        self.seen = nn.Linear(cells, HIDDEN)
        self.told = nn.Sequential(
            nn.Linear(JOINTS * FEATURES, HIDDEN // 2), nn.ReLU(), nn.Linear(HIDDEN // 2, HIDDEN))
        self.joined = nn.Sequential(
            nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU())
        self.head = nn.Linear(HIDDEN, 4 * JOINTS)
        grid = (torch.arange(VIEW_PX // SPOT_STRIDE) + 0.5) * SPOT_STRIDE - VIEW_PX / 2
        self.register_buffer('grid_m', grid * CELL_M, persistent=False)

    def forward(
        self, relief_m: Float[Tensor, 'n h w'], measured: Float[Tensor, 'n h w'],
        keypoints: Float[Tensor, 'n 15 f'],
    ) -> Completion:
        """Return joints of views."""
        channels = torch.stack(
            [relief_m / RELIEF_M, (relief_m / NEAR_M).clamp(-1.0, 1.0), measured], dim=1)
        x = self.mixed(torch.cat([self.stem(channels), self._spots(keypoints)], dim=1))
        y = self.joined(self.seen(x.flatten(1)) + self.told(keypoints.flatten(1)))
        said = self.head(y).unflatten(1, (JOINTS, 4))
        # Joints are told relative to their keypoint and the surface beneath it.
        known = torch.cat([keypoints[..., :2], keypoints[..., 4:5] * keypoints[..., 5:6]], dim=2)
        return Completion(said[..., :3] + known, said[..., 3].clamp(*SIGMA_LOG_RANGE))

    def hidden_weights(self) -> Iterator[nn.Parameter]:
        """Yield all matrices between the first and the last, but the largest: it costs most."""
        outer = {id(self.stem[0][0].weight), id(self.seen.weight), id(self.head.weight)}
        for weight in self.parameters():
            if weight.ndim >= 2 and id(weight) not in outer:
                yield weight

    def _spots(self, keypoints: Float[Tensor, 'n 15 f']) -> Float[Tensor, 'n 15 h w']:
        """Return an image per keypoint with a spot where it is, as bright as its score."""
        width = SPOT_CELLS * CELL_M
        across = torch.exp(-0.5 * ((self.grid_m - keypoints[..., :1]) / width) ** 2)
        down = torch.exp(-0.5 * ((self.grid_m - keypoints[..., 1:2]) / width) ** 2)
        return (down * keypoints[..., 2:3])[..., :, None] * across[..., None, :]


def completion_loss(
    said: Completion, truth: Float[Tensor, 'n 15 3'], farthest_m: float = 1.5
) -> Float[Tensor, '']:
    """Return the mean negative log likelihood of joints, Laplace's in three dimensions."""
    off_m = (said.places.float() - truth).norm(dim=2)
    off_m = torch.where(off_m < farthest_m, off_m, farthest_m + 0.1 * (off_m - farthest_m))
    log_sigma = said.log_sigma.float()
    # The mean distance of this distribution is 3 b, its variance along an axis 4 b^2.
    return (2.0 * off_m * torch.exp(-log_sigma) + 3.0 * log_sigma).mean()
