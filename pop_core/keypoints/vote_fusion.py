"""One person of many votes: the cells that know a joint best say where it is.

A cell on a hand knows where the wrist is; one on the chest has learned that arms are somewhere.
Averages over both draw limbs toward the trunk, however honest each is about its doubt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import SHARED_NAMES
from pop_core.keypoints.body_parts import N_CLASSES, PART_NAMES
from pop_core.keypoints.depth_votes import TRUNK, Cells

HUBER_M = 0.10
ROUNDS = 3
GOOD_M = 0.10  # a keypoint's score is the chance that it is nearer than this
DOUBTED_M2 = 0.12  # surface of which false people show less, true ones more
SUREST = 8  # joints; those that are hidden or out of the image make nobody less real
# The parts whose surface ends at a joint, by the last word of its name.
_BORDERS = {
    'pelvis': ('pelvis', 'hip'), 'hip': ('pelvis', 'hip'), 'knee': ('hip', 'knee'),
    'ankle': ('knee', 'ankle'), 'neck': ('spine3', 'head'), 'head': ('head',),
    'shoulder': ('spine3', 'shoulder'), 'elbow': ('shoulder', 'elbow'),
    'wrist': ('elbow', 'wrist'),
}
# Cells of other parts count this much where the joint is seen (squared); as much where it is not.
STRANGER = 0.05


def _bordering() -> Float[np.ndarray, '15 c']:
    """Return 1 where a class of body part ends at a joint."""
    out = np.zeros((len(SHARED_NAMES), N_CLASSES))
    for row, name in enumerate(SHARED_NAMES):
        side, _, kind = name.rpartition('_')
        for part in _BORDERS[kind]:
            for column, there in enumerate(PART_NAMES, start=1):
                other, _, word = there.rpartition('_')
                out[row, column] += word == part and (not side or not other or side == other)
    return out


BORDERING = _bordering()


@dataclass(frozen=True, slots=True, eq=False)
class VotedPerson:
    """One person.

    Args:
        joints: The 15 shared joints, camera frame [m].
        sigma_m: Laplace scale of each along one axis [m].
        visible: Probability that the camera sees each.
        probability: Mean probability that the person's cells show a person.
        area_m2: Surface seen [m^2].
        surface_m: Median depth of the surface seen [m].
    """

    joints: Float[np.ndarray, '15 3']
    sigma_m: Float[np.ndarray, '15']
    visible: Float[np.ndarray, '15']
    probability: float
    area_m2: float
    surface_m: float

    @property
    def existence(self) -> float:
        """Return a score 0..1 of there being a person: false ones are small and doubtful."""
        return self.probability * (1.0 - math.exp(-self.area_m2 / DOUBTED_M2))

    @property
    def certainty(self) -> Float[np.ndarray, '15']:
        """Return the chance that each joint is nearer than 10 cm, along each axis."""
        return np.asarray(1.0 - np.exp(-GOOD_M / self.sigma_m))

    @property
    def score(self) -> float:
        """Return a score 0..1: there is a person, and the surer half of the joints is right."""
        return self.existence * float(np.sort(self.certainty)[-SUREST:].mean())

    @property
    def trunk(self) -> Float[np.ndarray, '3']:
        """Return the middle of the trunk [m]."""
        return np.asarray(self.joints[TRUNK].mean(axis=0))


def fuse_votes(cells: Cells, shown: Cells | None = None) -> VotedPerson:
    """Return the person that cells agree on, votes weighted by the certainty they claim.

    Votes are averaged with weights 1 / sigma^4: errors of neighbouring cells are alike, so that
    many doubtful votes are worth less than 1 / sigma^2 says. Cells count by the surface they show,
    so that two looks at one person weigh alike. Those of a seen joint count by the
    probability that their cell shows a part which ends there; those far from the others count
    less (Huber).

    Args:
        cells: Cells that show the person, in one look or two.
        shown: Those of them that tell how much of the person is seen; all where none are given.
    """
    own = STRANGER + cells.part @ BORDERING.T
    surface = (cells.probability * cells.area_m2)[:, None]
    weight = surface / cells.sigma_m**4 * own ** (2.0 * cells.visible)
    mean = _weighted_mean(cells.joints, weight)
    robust = weight
    for _ in range(ROUNDS):
        off = cells.joints - mean
        distance = np.sqrt(np.einsum('njd,njd->nj', off, off))
        robust = weight * np.minimum(1.0, HUBER_M / np.maximum(distance, 1e-6))
        mean = _weighted_mean(cells.joints, robust)
    total = robust.sum(axis=0)
    sigma = (robust * cells.sigma_m).sum(axis=0) / total
    visible = (robust * cells.visible).sum(axis=0) / total
    shown = cells if shown is None else shown
    return VotedPerson(
        mean, sigma, visible, float(shown.probability.mean()), float(shown.area_m2.sum()),
        float(np.median(shown.depth_m)))


def _weighted_mean(
    points: Float[np.ndarray, 'n 15 3'], weight: Float[np.ndarray, 'n 15']
) -> Float[np.ndarray, '15 3']:
    return np.asarray(np.einsum('njd,nj->jd', points, weight) / weight.sum(axis=0)[:, None])
