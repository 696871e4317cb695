"""Weighted similarity without reflection between joints of poses and measured joints (Eq. 1)."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.retrieval import procrustes_kernels as kernels

SMALL = 20_000  # poses below which starting threads costs more than they save


@dataclass(frozen=True, slots=True, eq=False)
class Similarities:
    """Similarities `target ~ scale * R @ p + t`, one per pose.

    Args:
        scale: Clamped scale.
        R: Rotation (no reflection).
        t: Translation [m].
        residual_m: Weighted RMS distance after the transform [m].
        prior_cost: Price of leaning and of size [m^2], in the units of the squared residual.
    """

    scale: Float[np.ndarray, 'n']
    R: Float[np.ndarray, 'n 3 3']
    t: Float[np.ndarray, 'n 3']
    residual_m: Float[np.ndarray, 'n']
    prior_cost: Float[np.ndarray, 'n']

    def apply(self, points: Float[np.ndarray, 'n k 3']) -> Float[np.ndarray, 'n k 3']:
        """Return the transformed points of each pose [m]."""
        turned = np.einsum('nrc,nkc->nkr', self.R, points)
        return np.asarray(self.scale[:, None, None] * turned + self.t[:, None])


def solve_similarities(
    points: Float[np.ndarray, 'n k 3'],
    target: Float[np.ndarray, 'k 3'],
    weight: Float[np.ndarray, 'k'],
    scale_limits: tuple[float, float],
    *,
    yaw_only: bool = False,
    upright: float = 0.0,
    sized: float = 0.0,
) -> Similarities:
    """Return the weighted similarity that maps each set of points onto the target (Eq. 1).

    R maximises trace(R^T C) of the cross-covariance C by its singular vectors, the last one turned
    where a reflection would win (Horn 1987; Umeyama 1991); the scale follows and is clamped, which
    is exact because the cost is a parabola in it.

    Args:
        points: Joints of each pose [m].
        target: Measured joints [m].
        weight: Positive weights; only their ratios matter.
        scale_limits: Smallest and largest scale.
        yaw_only: Restrict rotations to turns about y.
        upright: Price [m^2] per unit of scale * |y - R y|^2 in the mean squared distance: makes
            rotations prefer turns about y.
        sized: Price [m^2] per unit of (scale - 1)^2: few joints alone tell little of the size.
    """
    w = weight / weight.sum()
    centre = np.einsum('k,nkc->nc', w, points)
    middle = w @ target
    p, q = points - centre[:, None], target - middle
    cross = np.einsum('k,kr,nkc->nrc', w, q, p)
    pull = upright * np.outer([0.0, 1.0, 0.0], [0.0, 1.0, 0.0])
    R = _best_yaw(cross) if yaw_only else _best_rotation(cross + pull)
    reach = np.einsum('nrc,nrc->n', R, cross)
    own = np.einsum('k,nkc->n', w, p**2)
    lean = upright * (1.0 - R[:, 1, 1])
    scale = np.clip((reach - lean + sized) / np.maximum(own + sized, 1e-12), *scale_limits)
    cost = w @ np.sum(q**2, axis=1) + scale * (scale * own - 2.0 * reach)
    t = middle - scale[:, None] * np.einsum('nrc,nc->nr', R, centre)
    price = 2.0 * scale * lean + sized * (scale - 1.0) ** 2
    return Similarities(scale, R, t, np.sqrt(np.maximum(cost, 0.0)), price)


def rank_similarities(
    columns: Float32[np.ndarray, 's 3 m'],
    target: Float[np.ndarray, 's 3'],
    weight: Float[np.ndarray, 's'],
    scale_limits: tuple[float, float],
    *,
    yaw_only: bool = False,
    upright: float = 0.0,
    sized: float = 0.0,
    threads: int = 2,
) -> Float32[np.ndarray, 'm']:
    """Return the mean squared distance [m^2], and the prices of lean and size, of every pose.

    Single precision, good to a millimetre: a first ranking whose best `solve_similarities`
    settles.

    Args:
        columns: Joints of the library [m].
        target: Measured joints [m]; rows of zero weight are ignored and may be NaN.
        weight: Weights, zero for joints that were not measured.
        scale_limits: Smallest and largest scale.
        yaw_only: Restrict rotations to turns about y.
        upright: Price of leaning as in `solve_similarities`.
        sized: Price of size as in `solve_similarities`.
        threads: Most threads to use.
    """
    chosen = np.flatnonzero(weight > 0)
    w = weight[chosen] / weight[chosen].sum()
    centred = target[chosen] - w @ target[chosen]
    arguments = (
        chosen, centred.astype(np.float32), w.astype(np.float32),
        np.asarray(scale_limits, dtype=np.float32), yaw_only, np.float32(upright),
        np.float32(sized),
    )
    m = columns.shape[2]
    out = np.empty(m, dtype=np.float32)
    parts = threads if m > SMALL else 1
    # Parts of whole blocks: what is left over of one may be rounded otherwise.
    edges = np.linspace(0, m, parts + 1).astype(int) // kernels.BLOCK * kernels.BLOCK
    edges[-1] = m

    def fill(part: int) -> None:
        kernels.similarity_costs(columns, *arguments, out, edges[part], edges[part + 1])

    if parts == 1:
        fill(0)
    else:
        with ThreadPoolExecutor(parts) as pool:
            list(pool.map(fill, range(parts)))
    return out


def best_indices(costs: Float32[np.ndarray, 'm'], n: int) -> Int[np.ndarray, 'k']:
    """Return the indices of the n smallest costs, or of all, best first."""
    n = min(n, len(costs))
    nearest = np.argpartition(costs, n - 1)[:n]
    return np.asarray(nearest[np.argsort(costs[nearest], kind='stable')])


def _best_rotation(cross: Float[np.ndarray, 'n 3 3']) -> Float[np.ndarray, 'n 3 3']:
    u, _, vt = np.linalg.svd(cross)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    return np.asarray(u @ vt)


def _best_yaw(cross: Float[np.ndarray, 'n 3 3']) -> Float[np.ndarray, 'n 3 3']:
    cosine = cross[:, 0, 0] + cross[:, 2, 2]
    sine = cross[:, 0, 2] - cross[:, 2, 0]
    length = np.maximum(np.hypot(cosine, sine), 1e-12)
    c, s = cosine / length, sine / length
    zero, one = np.zeros_like(c), np.ones_like(c)
    return np.stack([c, zero, s, zero, one, zero, -s, zero, c], axis=1).reshape(-1, 3, 3)
