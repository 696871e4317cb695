"""Muon: momentum whose steps have all singular values equal (Jordan et al. 2024).

A few images teach the weak directions of a weight matrix as much as the strong ones, which brings
a small network further than AdamW does with the same images.
"""

from __future__ import annotations

from collections.abc import Iterable

import torch
from jaxtyping import Float
from torch import Tensor

# Odd quintic whose iterates push singular values of (0, 1] to about 1 (Jordan et al. 2024).
COEFFICIENTS = (3.4445, -4.7750, 2.0315)
ITERATIONS = 5


class Muon(torch.optim.Optimizer):
    """Steps of matrices; filters of convolutions are matrices of output by everything else."""

    def __init__(
        self, weights: Iterable[Tensor], rate: float, momentum: float = 0.95, decay: float = 0.01
    ) -> None:
        """Take weights of two or more axes."""
        super().__init__(weights, {'lr': rate, 'momentum': momentum, 'decay': decay})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # noqa: ARG002 - the shape of all optimisers
        """Change the weights by their gradients."""
        for group in self.param_groups:
            for weight in group['params']:
                if weight.grad is None:
                    continue
                state = self.state[weight]
                velocity = state.setdefault('velocity', torch.zeros_like(weight))
                velocity.lerp_(weight.grad, 1.0 - group['momentum'])
                ahead = weight.grad.lerp(velocity, group['momentum'])  # Nesterov's
                matrix = ahead.reshape(len(ahead), -1)
                growth = max(1.0, matrix.shape[0] / matrix.shape[1]) ** 0.5
                weight.mul_(1.0 - group['lr'] * group['decay'])
                weight.add_(
                    orthogonal(matrix).reshape(weight.shape), alpha=-group['lr'] * growth)


def orthogonal(matrix: Float[Tensor, 'r c']) -> Float[Tensor, 'r c']:
    """Return nearly U V^T of a matrix U S V^T by Newton-Schulz iterations."""
    a, b, c = COEFFICIENTS
    tall = matrix.shape[0] > matrix.shape[1]
    x = matrix.T if tall else matrix
    x = x / x.norm().clamp(min=1e-7)
    for _ in range(ITERATIONS):
        gram = x @ x.T
        x = a * x + (b * gram + c * gram @ gram) @ x
    return x.T if tall else x
