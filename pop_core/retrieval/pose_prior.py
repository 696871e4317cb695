"""Pose prior: a mixture of low-rank Gaussians over swing-twist coordinates of the 23 joints [rad].

Each component has covariance W W^T + diag(v): a few directions in which people move, and a floor
of variance for what the data never showed. Some components are learned from captured motion, the
others from the rules of `procedural`: the motion at hand shows nobody who sits, kneels or lies,
and a fit must not pull such people upright. Learned by `scripts/learn_pose_prior.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joint_limits import TWIST_AXES, pose_coordinates
from pop_core.errors import LibraryFileError
from pop_core.geometry.swing_twist import from_swing_twist
from pop_core.retrieval import pose_prior_kernels as kernels

DEFAULT_FILE = Path(__file__).resolve().parents[1] / 'data' / 'pose_prior.npz'
N_COORDINATES = 69


@dataclass(frozen=True, slots=True, eq=False)
class PosePrior:
    """A mixture of k Gaussians over 69 coordinates.

    Args:
        weights: Share of each component; they sum to one.
        means: Mean coordinates [rad].
        factors: W of each component [rad].
        variances: Diagonal floor v of each component [rad^2].
        from_motion: Whether each component was learned from captured motion.

    Raises:
        LibraryFileError: If shapes do not fit together or a variance is not positive.
    """

    weights: Float[np.ndarray, 'k']
    means: Float[np.ndarray, 'k x']
    factors: Float[np.ndarray, 'k x r']
    variances: Float[np.ndarray, 'k x']
    from_motion: Bool[np.ndarray, 'k']
    # Derived once: L^-1 and inverse of each covariance L L^T, -log of each peak density.
    whiteners: Float[np.ndarray, 'k x x'] = field(init=False)
    precisions: Float[np.ndarray, 'k x x'] = field(init=False)
    peak_costs: Float[np.ndarray, 'k'] = field(init=False)

    def __post_init__(self) -> None:
        shapes = (self.means.shape, self.factors.shape[:2], self.variances.shape)
        k = len(self.weights)
        if shapes != ((k, N_COORDINATES),) * 3 or not (self.variances > 0).all():
            raise LibraryFileError(
                f'pose prior: expected {k} components of {N_COORDINATES} coordinates with '
                f'positive variances, found {shapes}'
            )
        covariance = self.factors @ self.factors.transpose(0, 2, 1)
        covariance[:, np.arange(N_COORDINATES), np.arange(N_COORDINATES)] += self.variances
        lower = np.linalg.cholesky(covariance)
        half_log_det = np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
        normaliser = 0.5 * N_COORDINATES * np.log(2.0 * np.pi)
        whiteners = np.linalg.inv(lower)
        object.__setattr__(self, 'whiteners', whiteners)
        object.__setattr__(self, 'precisions', whiteners.transpose(0, 2, 1) @ whiteners)
        object.__setattr__(self, 'peak_costs', half_log_det + normaliser - np.log(self.weights))

    def motion_part(self) -> PosePrior:
        """Return the mixture of the components learned from captured motion alone."""
        part = self.from_motion
        weights = self.weights[part] / self.weights[part].sum()
        return PosePrior(
            weights, self.means[part], self.factors[part], self.variances[part],
            np.ones(len(weights), dtype=bool))

    def component_costs(self, c: Float[np.ndarray, 'n x']) -> Float[np.ndarray, 'n k']:
        """Return -log(weight * density) of each component at coordinates c [rad]."""
        # A product of matrices: einsum takes four times as long for a single pose.
        white = ((c - self.means[:, None]) @ self.whiteners.transpose(0, 2, 1)).transpose(1, 0, 2)
        return np.asarray(0.5 * np.sum(white**2, axis=2) + self.peak_costs)

    def log_density(self, body_pose: Float[np.ndarray, 'n 23 3']) -> Float[np.ndarray, 'n']:
        """Return the log density of poses in coordinate space [rad^-69]."""
        c = pose_coordinates(body_pose).reshape(len(body_pose), -1)
        return np.asarray(np.logaddexp.reduce(-self.component_costs(c), axis=1))

    def cost(self, c: Float[np.ndarray, '23 3']) -> float:
        """Return -log p of the most likely component at coordinates c [rad], but for a constant.

        What the component's weight and volume cost above the cheapest component is part of it, so
        that the energy does not jump when another component takes over. It is never below zero.
        """
        return self._nearest(c)[0]

    def quadratic(
        self, c: Float[np.ndarray, '23 3']
    ) -> tuple[float, Float[np.ndarray, '69'], Float[np.ndarray, '69 69']]:
        """Return `cost` with its gradient and Gauss-Newton Hessian.

        Derivatives are with respect to left increments R_j <- exp(delta_j) R_j of the 23 joints.
        """
        cost, best = self._nearest(c)
        gradient, hessian = kernels.increment_model(
            c, self.means[best], self.precisions[best], TWIST_AXES)
        return cost, gradient, hessian

    def _nearest(self, c: Float[np.ndarray, '23 3']) -> tuple[float, int]:
        """Return `cost`, and the component it is of."""
        cost, best = kernels.nearest_component(
            c.reshape(-1), self.means, self.whiteners, self.peak_costs)
        return float(cost - self.peak_costs.min()), int(best)

    def sample(self, rng: np.random.Generator, n: int) -> Float[np.ndarray, 'n 23 3']:
        """Return n poses (rotation vectors [rad]) drawn from the mixture, limits not applied."""
        return self.sample_components(rng, rng.choice(len(self.weights), n, p=self.weights))

    def sample_components(
        self, rng: np.random.Generator, component: Int[np.ndarray, 'n']
    ) -> Float[np.ndarray, 'n 23 3']:
        """Return one pose (rotation vectors [rad]) from each given component."""
        n, rank = len(component), self.factors.shape[2]
        along = rng.normal(size=(n, rank))
        noise = rng.normal(size=(n, N_COORDINATES)) * np.sqrt(self.variances[component])
        c = self.means[component] + np.einsum('nxr,nr->nx', self.factors[component], along) + noise
        return from_swing_twist(c.reshape(n, 23, 3), TWIST_AXES)


@cache
def load_pose_prior(path: Path = DEFAULT_FILE) -> PosePrior:
    """Return the prior of a file, the committed one by default; it is read once.

    Raises:
        LibraryFileError: If the file is not a pose prior.
    """
    try:
        with np.load(path) as data:
            weights, means, factors, variances = (
                data[name].astype(np.float64)
                for name in ('weights', 'means', 'factors', 'variances')
            )
            from_motion = data['from_motion']
    except (OSError, KeyError, ValueError) as error:
        raise LibraryFileError(
            f'{path}: expected an npz with weights, means, factors, variances and '
            f'from_motion, found {error}'
        ) from error
    return PosePrior(weights, means, factors, variances, from_motion)
