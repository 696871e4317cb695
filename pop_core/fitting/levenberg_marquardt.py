"""Levenberg-Marquardt on blocks of weighted residuals; knows nothing of bodies.

Cost 1/2 sum w r^2. The damping follows the gain ratio (Nielsen 1999).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import blas, lapack

from pop_core.fitting import normal_kernels as kernels

StateT = TypeVar('StateT')

FIRST_DAMPING = 1e-3
LARGEST_DAMPING = 1e6
LEAST_CURVATURE = 1e-9  # where nothing bends the cost


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """A block of residuals at one state.

    Args:
        r: Residuals.
        J: Their derivative with respect to the step, or None when only the cost is wanted.
        w: Weights that multiply squared residuals; robust weights count as constant.
    """

    r: Float[np.ndarray, 'n']
    J: Float[np.ndarray, 'n x'] | None
    w: Float[np.ndarray, 'n']

    @property
    def cost(self) -> float:
        """Return 1/2 sum w r^2."""
        return 0.5 * float((self.w * self.r).dot(self.r))

    def first(self, n: int) -> Residual:
        """Return the first n residuals."""
        return Residual(self.r[:n], None if self.J is None else self.J[:n], self.w[:n])


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """A term at one state that knows its own quadratic model, at less than the price of rows.

    Args:
        cost: What it costs.
        gradient: Derivative of the cost with respect to the parameters it is of, or None when only
            the cost is wanted.
        hessian: J'WJ of those parameters, as Gauss and Newton have it, or None.
        first: Where these begin among all parameters.
    """

    cost: float
    gradient: Float[np.ndarray, 'y'] | None = None
    hessian: Float[np.ndarray, 'y y'] | None = None
    first: int = 0


Term = Residual | Quadratic


def no_residual(size: int) -> Residual:
    """Return the block of a term that is switched off, of `size` parameters."""
    return Residual(np.zeros(0), np.zeros((0, size)), np.zeros(0))


@dataclass(frozen=True, slots=True, eq=False)
class NormalEquations:
    """The quadratic model of the cost: cost + gradient . step + 1/2 step' hessian step."""

    cost: float
    gradient: Float[np.ndarray, 'x']
    hessian: Float[np.ndarray, 'x x']


@dataclass(frozen=True, slots=True)
class StepReport(Generic[StateT]):
    """What one damped step did."""

    state: StateT
    cost_before: float
    cost_after: float
    damping: float
    accepted: bool


def cost_of(blocks: Sequence[Term]) -> float:
    """Return what all terms cost."""
    return sum((block.cost for block in blocks), 0.0)


def assemble(blocks: Sequence[Term], size: int) -> NormalEquations:
    """Return J'wr and J'wJ summed over all terms."""
    linear = [
        block for block in blocks
        if isinstance(block, Residual) and block.J is not None and len(block.r)]
    rows = np.empty((sum(len(block.r) for block in linear), size + 1))
    first = 0
    for block in linear:
        last = first + len(block.r)
        kernels.weigh(block.J, block.r, block.w, rows[first:last])
        first = last
    # dsyrk forms one triangle only, half the work of a product; once, not block by block.
    upper = blas.dsyrk(1.0, rows.T) if len(rows) else np.zeros((size + 1, size + 1), order='F')
    gradient, hessian = kernels.unfold(upper)
    for model in blocks:
        if isinstance(model, Quadratic) and model.gradient is not None:
            kernels.add(model.gradient, model.hessian, model.first, gradient, hessian)
    return NormalEquations(cost_of(blocks), gradient, hessian)


def with_lower(upper: Float[np.ndarray, 'x x']) -> Float[np.ndarray, 'x x']:
    """Return the symmetric matrix of an upper triangle."""
    return np.asarray(kernels.with_lower(upper))


def damped_step(
    equations: NormalEquations, damping: float, active: Bool[np.ndarray, 'x']
) -> Float[np.ndarray, 'x']:
    """Return the step that minimises the damped quadratic over the active parameters.

    Raises:
        np.linalg.LinAlgError: If the damped Hessian is not positive definite.
    """
    free = active.nonzero()[0]
    # Damping relative to the diagonal makes the step independent of units (Marquardt 1963).
    damped, gradient = kernels.damp(
        equations.hessian, equations.gradient, free, damping, LEAST_CURVATURE)
    # Cholesky: symmetric positive definite by construction. LAPACK reads columns: of a symmetric
    # matrix they are the rows.
    factor, failed = lapack.dpotrf(damped.T, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError('the damped Hessian is not positive definite')
    step = np.zeros(len(equations.gradient))
    step[free] = -lapack.dpotrs(factor, gradient)[0]
    return step


def levenberg_marquardt_step(
    state: StateT,
    evaluate: Callable[[StateT, bool], Sequence[Term]],
    retract: Callable[[StateT, Float[np.ndarray, 'x']], StateT],
    active: Bool[np.ndarray, 'x'],
    damping: float,
) -> StepReport[StateT]:
    """Take one accepted step, raising the damping until the cost falls (or give up).

    Where the cost has no derivative, as when a body has shrunk to nothing, nothing moves.

    Args:
        state: Where to linearise.
        evaluate: Returns the terms at a state, with derivatives when asked.
        retract: Moves a state by a step.
        active: Which parameters may move.
        damping: Damping of the last step.
    """
    equations = assemble(evaluate(state, True), len(active))
    if not np.isfinite(equations.gradient).all():
        return StepReport(state, equations.cost, equations.cost, FIRST_DAMPING, False)
    growth = 4.0
    while damping < LARGEST_DAMPING:
        step = damped_step(equations, damping, active)
        moved = retract(state, step)
        cost = cost_of(evaluate(moved, False))
        predicted = -(equations.gradient @ step + 0.5 * step @ equations.hessian @ step)
        if cost < equations.cost and np.isfinite(cost):
            ratio = (equations.cost - cost) / max(predicted, 1e-12)
            damping *= max(1 / 10, 1 - (2 * ratio - 1) ** 3)
            return StepReport(moved, equations.cost, cost, max(damping, 1e-7), True)
        damping *= growth
        growth *= 2
    return StepReport(state, equations.cost, equations.cost, FIRST_DAMPING, False)
