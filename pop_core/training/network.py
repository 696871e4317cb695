"""The depth network: a small residual encoder, an additive feature pyramid, one head at stride 4.

Every cell of the output says which body part it shows, where the 15 joints of its person are
relative to its own measured surface and how sure it is of each, and which of them the camera sees.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F  # noqa: N812 - torch's own word for it

from pop_core.keypoints.body_parts import N_CLASSES

JOINTS = 15
# Distances from the local mean that fill the relief channels' range [m]: limbs on trunks, people
# before walls.
RELIEF_M = (0.08, 0.5)
RELIEF_CELLS = (4, 16)  # pixels per cell of the local means
MIDDLE_M = 4.0
SIGMA_LOG_RANGE = (-4.6, 1.0)  # a centimetre to three metres


@dataclass(frozen=True, slots=True)
class NetworkConfig:
    """Size of the network; stored with its weights.

    Args:
        widths: Channels at strides 2, 4, 8, 16 and 32.
        blocks: Residual blocks at strides 4, 8, 16 and 32.
        pyramid: Channels of the feature pyramid.
        focal_px: Focal length that inputs are resampled to [px].
        shown_at_m: Depth at which the network is shown one person at a time; None for a network
            that looks at whole images.
    """

    widths: tuple[int, ...] = (16, 24, 48, 96, 144)
    blocks: tuple[int, ...] = (1, 1, 1, 1)
    pyramid: int = 48
    focal_px: float = 160.0
    shown_at_m: float | None = None


class DepthMaps(NamedTuple):
    """What the network says, per cell of stride 4.

    `votes` are (du, dv, dz) of each joint: offset of its pixel from the cell's middle, times the
    cell's depth over the focal length [m], and of its depth from the cell's [m].
    """

    parts: Float[Tensor, 'n c h w']
    votes: Float[Tensor, 'n 45 h w']
    log_sigma: Float[Tensor, 'n 15 h w']
    visible: Float[Tensor, 'n 15 h w']


OUTPUT_CHANNELS = (N_CLASSES, 3 * JOINTS, JOINTS, JOINTS)


class DepthNet(nn.Module):
    """People in a depth image, every cell voting for the joints of its own person."""

    def __init__(self, config: NetworkConfig | None = None) -> None:
        """Build with random weights."""
        super().__init__()
        self.config = config or NetworkConfig()
        first, *widths = self.config.widths
        self.stem = convolution(2 + len(RELIEF_M), first, stride=2)
        stages, before = [], first
        for width, count in zip(widths, self.config.blocks, strict=True):
            blocks = [ResidualBlock(width) for _ in range(count)]
            stages.append(nn.Sequential(convolution(before, width, stride=2), *blocks))
            before = width
        self.stages = nn.ModuleList(stages)
        pyramid = self.config.pyramid
        self.laterals = nn.ModuleList(nn.Conv2d(width, pyramid, 1) for width in widths)
        self.head = nn.Sequential(
            convolution(pyramid, pyramid), nn.Conv2d(pyramid, sum(OUTPUT_CHANNELS), 1))

    def forward(self, depth_m: Float[Tensor, 'n 1 h w']) -> DepthMaps:
        """Return maps of depth images [m], 0 where nothing was measured; sides divisible by 32."""
        x = self.stem(relief_channels(depth_m))
        features = []
        for stage in self.stages:
            x = stage(x)
            features.append(x)
        y = self.laterals[-1](features[-1])
        for lateral, feature in zip(self.laterals[-2::-1], features[-2::-1], strict=True):
            y = F.interpolate(y, scale_factor=2.0, mode='nearest') + lateral(feature)
        parts, votes, log_sigma, visible = self.head(y).split(OUTPUT_CHANNELS, dim=1)
        return DepthMaps(parts, votes, log_sigma.clamp(*SIGMA_LOG_RANGE), visible)


    def hidden_weights(self) -> Iterator[nn.Parameter]:
        """Yield the filters of all convolutions but the first and the last."""
        outer = {id(self.stem[0].weight), id(self.head[-1].weight)}
        for weight in self.parameters():
            if weight.ndim == 4 and id(weight) not in outer:
                yield weight


class ResidualBlock(nn.Module):
    """Two 3x3 convolutions beside an identity (He et al. 2016)."""

    def __init__(self, width: int) -> None:
        """Build with random weights."""
        super().__init__()
        self.first = convolution(width, width)
        self.second = nn.Sequential(
            nn.Conv2d(width, width, 3, padding=1, bias=False), nn.BatchNorm2d(width))

    def forward(self, x: Float[Tensor, 'n c h w']) -> Float[Tensor, 'n c h w']:
        """Return the block's features."""
        return F.relu(x + self.second(self.first(x)))


def relief_channels(depth_m: Float[Tensor, 'n 1 h w']) -> Float[Tensor, 'n 4 h w']:
    """Return depth, validity, and depth relative to the local mean of what was measured.

    Metres over a range of eight hide the centimetres that tell an arm from the trunk behind it.
    """
    valid = (depth_m > 0).to(depth_m.dtype)
    channels = [(depth_m / MIDDLE_M - 1.0).clamp(-1.0, 1.0) * valid, valid]
    for cell, range_m in zip(RELIEF_CELLS, RELIEF_M, strict=True):
        pooled = [F.avg_pool2d(F.avg_pool2d(x, cell), 3, 1, 1) for x in (depth_m * valid, valid)]
        mean = pooled[0] / pooled[1].clamp(min=1e-3)
        near = F.interpolate(mean, scale_factor=float(cell), mode='bilinear')
        channels.append(((depth_m - near) / range_m).clamp(-1.0, 1.0) * valid)
    return torch.cat(channels, dim=1)


def convolution(before: int, width: int, stride: int = 1) -> nn.Sequential:
    """Return a 3x3 convolution, its normalisation (Ioffe and Szegedy 2015) and ReLU."""
    return nn.Sequential(
        nn.Conv2d(before, width, 3, stride, 1, bias=False), nn.BatchNorm2d(width),
        nn.ReLU(inplace=True))
