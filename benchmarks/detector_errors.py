"""Where errors of a detector's joints come from: which joints, how far away, pixel or depth."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import SHARED_MIRROR, SHARED_NAMES

WITHIN_M = 0.10
GROUPS = ('pelvis', 'hip', 'neck', 'head', 'shoulder', 'elbow', 'wrist', 'knee', 'ankle')
DISTANCES_M = (0.0, 2.0, 3.0, 4.0, np.inf)
Joints = Float[np.ndarray, 'n 15 3']


class JointErrors:
    """Joints of people found, and where they really are; camera frame [m]."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.found: list[Float[np.ndarray, '15 3']] = []
        self.truth: list[Float[np.ndarray, '15 3']] = []
        self.seen: list[Bool[np.ndarray, '15']] = []
        self.inside: list[Bool[np.ndarray, '15']] = []

    def add(
        self, found: Float[np.ndarray, '15 3'], truth: Float[np.ndarray, '15 3'],
        seen: Bool[np.ndarray, '15'], inside: Bool[np.ndarray, '15'],
    ) -> None:
        """Take a person; joints that were not found are NaN."""
        self.found.append(found)
        self.truth.append(truth)
        self.seen.append(seen)
        self.inside.append(inside)

    def text(self) -> str:
        """Return PCK of visible and hidden joints by cause, joint and distance, in lines."""
        if not self.found:
            return 'nobody was found'
        found, truth = np.array(self.found), np.array(self.truth)
        seen, inside = np.array(self.seen), np.array(self.inside)
        near = _near(found, truth)
        kinds = inside & seen, inside & ~seen
        lines = ['PCK at 10 cm of people found                 visible   hidden']
        for name, right in (('as found', near), *(
                (name, _near(given(found, truth), truth)) for name, given in CAUSES.items())):
            lines.append(_line(name, right, kinds))
        words = np.array([name.split('_')[-1] for name in SHARED_NAMES])
        lines += [_line(f'  {word}', near, tuple(kind & (words == word) for kind in kinds))
                  for word in GROUPS]
        distance = np.median(truth[..., 2], axis=1)
        for low, high in pairwise(DISTANCES_M):
            there = ((distance >= low) & (distance < high))[:, None]
            name = f'  {low:.0f} to {high:.0f} m' if np.isfinite(high) else f'  beyond {low:.0f} m'
            lines.append(_line(name, near, tuple(kind & there for kind in kinds)))
        return '\n'.join(lines)


def _true_pixel(found: Joints, truth: Joints) -> Joints:
    return truth * (found[..., 2:] / truth[..., 2:])


def _true_depth(found: Joints, truth: Joints) -> Joints:
    return found * (truth[..., 2:] / found[..., 2:])


def _better_sides(found: Joints, truth: Joints) -> Joints:
    """Return people with left and right exchanged as a whole where more joints are right then."""
    other = found[:, SHARED_MIRROR]
    better = _near(other, truth).sum(axis=1) > _near(found, truth).sum(axis=1)
    return np.where(better[:, None, None], other, found)


CAUSES: dict[str, Callable[[Joints, Joints], Joints]] = {
    'given the true pixel': _true_pixel,
    'given the true depth': _true_depth,
    'given who faces the camera': _better_sides,
}


def _near(found: Joints, truth: Joints) -> Bool[np.ndarray, 'n 15']:
    return np.linalg.norm(found - truth, axis=2) < WITHIN_M  # NaN is not near


def _line(
    name: str, right: Bool[np.ndarray, 'n 15'], kinds: tuple[Bool[np.ndarray, 'n 15'], ...]
) -> str:
    shares = (f'{right[kind].mean():8.2f}' if kind.any() else f'{"-":>8}' for kind in kinds)
    return f'{name:42} ' + ' '.join(shares)
