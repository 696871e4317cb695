"""Batches varied on the device: shifted, mirrored, scaled, with noise and holes."""

from __future__ import annotations

from dataclasses import replace

import torch
from jaxtyping import UInt8
from torch import Tensor

from pop_core.body.joints import SHARED_MIRROR
from pop_core.keypoints.body_parts import CLASS_MIRROR
from pop_core.training.shards import OWNER_SHIFT
from pop_core.training.targets import Batch

SCALES = (0.93, 1.08)
MISSING_SHARE = 0.04
NOISE_M = 0.004


def varied(batch: Batch, size: tuple[int, int], generator: torch.Generator) -> Batch:
    """Return a batch cut to (width, height) and varied.

    Scaling all depths and joints by one factor leaves every pixel where it is: the same picture
    of a larger world, further away.

    Args:
        batch: Images larger than `size`.
        size: Width and height of the network's input [px].
        generator: Randomness, of the CPU.
    """
    spare_w = batch.depth_m.shape[2] - size[0]
    spare_h = batch.depth_m.shape[1] - size[1]
    left = int(torch.randint(spare_w + 1, (1,), generator=generator))
    top = int(torch.randint(spare_h + 1, (1,), generator=generator))
    batch = cropped(batch, left, top, size)
    if torch.rand(1, generator=generator) < 0.5:
        batch = mirrored(batch)
    n, device = len(batch.depth_m), batch.depth_m.device
    factor = (SCALES[0] + (SCALES[1] - SCALES[0]) * torch.rand(n, generator=generator)).to(device)
    batch = scaled(batch, factor)
    seed = int(torch.randint(2**31, (1,), generator=generator))
    own = torch.Generator(device).manual_seed(seed)
    shape = batch.depth_m.shape
    noise = torch.randn(shape, generator=own, device=device) * NOISE_M * torch.rand(
        (n, 1, 1), generator=own, device=device)
    share = MISSING_SHARE * torch.rand((n, 1, 1), generator=own, device=device)
    kept = torch.rand(shape, generator=own, device=device) > share
    depth_m = torch.where((batch.depth_m > 0) & kept, batch.depth_m + noise, 0.0)
    return replace(batch, depth_m=depth_m)


def cropped(batch: Batch, left: int, top: int, size: tuple[int, int]) -> Batch:
    """Return the part of all images that begins at a pixel."""
    rows, columns = slice(top, top + size[1]), slice(left, left + size[0])
    shift = torch.tensor([0.0, 0.0, left, top], device=batch.lens.device)
    return replace(
        batch, depth_m=batch.depth_m[:, rows, columns], labels=batch.labels[:, rows, columns],
        lens=batch.lens - shift)


def scaled(batch: Batch, factor: Tensor) -> Batch:
    """Return each scene with every distance multiplied by its own factor (n)."""
    return replace(
        batch, depth_m=batch.depth_m * factor[:, None, None],
        points=batch.points * factor[:, None, None, None])


def mirrored(batch: Batch) -> Batch:
    """Return the scenes seen in a mirror: left is right in pixels, joints and parts."""
    other = torch.as_tensor(SHARED_MIRROR, device=batch.points.device)
    points = batch.points[:, :, other] * torch.tensor(
        [-1.0, 1.0, 1.0], device=batch.points.device)
    lens = batch.lens.clone()
    lens[:, 2] = batch.depth_m.shape[2] - 1 - lens[:, 2]
    return replace(
        batch, depth_m=batch.depth_m.flip(2), labels=_other_sides(batch.labels.flip(2)),
        points=points, visible=batch.visible[:, :, other], lens=lens)


def _other_sides(labels: UInt8[Tensor, 'n h w']) -> UInt8[Tensor, 'n h w']:
    low = (1 << OWNER_SHIFT) - 1
    every = torch.arange(256)
    table = torch.as_tensor(CLASS_MIRROR)[every & low] | (every & ~low)
    return table.to(labels.device, torch.uint8)[labels.int()]
