"""How far off the joints are that a completion network says, by how much is seen of people."""

from __future__ import annotations

from collections.abc import Iterator

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from pop_core.training.completion.network import CompletionNet
from pop_core.training.completion.view_pool import ViewPool

BATCH = 256
SEEN = (range(5), range(5, 8), range(8, 11), range(11, 16))  # joints seen of a person
ROW = '{:<14} {:>8} {:>20} {:>20}'


@torch.no_grad()
def errors(network: CompletionNet, pool: ViewPool) -> Float[Tensor, 'n 15']:
    """Return how far off every joint of every view is [m]."""
    batches = (pool.at(rows) for rows in torch.arange(len(pool)).split(BATCH))
    return torch.cat([
        (network(v.relief_m, v.measured, v.keypoints).places - v.places).norm(dim=2)
        for v in batches])


def figures(network: CompletionNet, pool: ViewPool) -> str:
    """Return mean and median errors of visible and hidden joints as a line."""
    off_m, visible = errors(network, pool), pool.state == 0
    return f'visible {_told(off_m[visible])}, hidden {_told(off_m[~visible])}'


def error_table(network: CompletionNet, pool: ViewPool) -> Iterator[str]:
    """Yield the lines of a table: errors by how many joints of a person are seen."""
    off_m, visible = errors(network, pool), pool.state == 0
    yield ROW.format('joints seen', 'people', 'visible mean/median', 'hidden mean/median')
    count = visible.sum(dim=1)
    for seen in SEEN:
        those: Bool[Tensor, 'n 1'] = ((count >= seen.start) & (count < seen.stop))[:, None]
        yield ROW.format(
            f'{seen.start} to {seen.stop - 1}', int(those.sum()),
            _told(off_m[those & visible]), _told(off_m[those & ~visible]))


def _told(off_m: Float[Tensor, 'k']) -> str:
    """Return mean and median; of no joints neither."""
    if not len(off_m):
        return '-'
    return f'{1e3 * off_m.mean():.0f}/{1e3 * off_m.median():.0f} mm'
