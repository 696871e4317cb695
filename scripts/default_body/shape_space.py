"""Ten shape directions in units of standard deviations, and a joint regressor that fits them."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

N_BETAS = 10
# Vertices that each joint is regressed from.
N_NEAREST = 400
# Position error that a weight of one may cost: keeps the weights small, a mean of the vertices.
WEIGHT_COST_M = 3e-3


@dataclass(frozen=True, eq=False)
class ShapeSpace:
    """The mean adult, the directions about it, and the area that each vertex stands for."""

    mean: np.ndarray  # (v, 3) [m]
    directions: np.ndarray  # (v, 3, 10) [m per sigma]
    area: np.ndarray  # (v,) [m^2]

    def fit(self, people: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return betas (p, 10) of people and the distance of each vertex (p, v) left over [m]."""
        scale = np.sqrt(self.area)[:, None]
        basis = (self.directions * scale[:, :, None]).reshape(-1, N_BETAS)
        offsets = ((people - self.mean) * scale).reshape(len(people), -1)
        betas = np.linalg.solve(basis.T @ basis, basis.T @ offsets.T).T
        left = people - self.mean - np.einsum('vcb,pb->pvc', self.directions, betas)
        return betas, np.linalg.norm(left, axis=2)


def shape_directions(
    adults: np.ndarray, children: np.ndarray, child_share: float, area: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean adult (v, 3) and ten directions (v, 3, 10) [m per sigma].

    The directions are the principal axes of the second moment about the mean adult of a
    population with the given share of children; vertices count by their area (v,). Signs: more
    volume is positive, so that beta 1 grows with stature.
    """
    mean = adults.mean(0)
    scale = np.sqrt(area / area.sum())[:, None]
    rows = np.concatenate([
        (adults - mean) * scale * np.sqrt((1 - child_share) / len(adults)),
        (children - mean) * scale * np.sqrt(child_share / len(children)),
    ]).reshape(len(adults) + len(children), -1)
    values, vectors = np.linalg.eigh(rows @ rows.T)
    largest = np.argsort(-values)[:N_BETAS]
    axes = (rows.T @ vectors[:, largest]).reshape(len(mean), 3, N_BETAS)
    directions = axes / scale[:, :, None]
    outward = (directions * (mean * area[:, None])[:, :, None]).sum((0, 1))
    return mean, directions * np.where(outward < 0, -1.0, 1.0)


def joint_regressor(
    space: ShapeSpace, joint_mean: np.ndarray, joint_directions: np.ndarray,
    mirror_of: np.ndarray, joint_mirror: np.ndarray,
) -> np.ndarray:
    """Return sparse rows (24, v) that give the joints of the shape space.

    Each joint is a combination of its nearest vertices, small in squares, that fits
    the mean body and every direction at once; right joints take the mirrored rows of left ones.
    """
    mean, directions = space.mean, space.directions
    regressor = np.zeros((len(joint_mean), len(mean)))
    for joint, twin in enumerate(joint_mirror):
        if joint > twin:
            regressor[joint, mirror_of] = regressor[twin]
            continue
        near = cKDTree(mean).query(joint_mean[joint], k=N_NEAREST)[1]
        if joint == twin:
            near = np.union1d(near, mirror_of[near])
        columns = np.concatenate([
            mean[near].T,
            directions[near].transpose(1, 2, 0).reshape(-1, len(near)),
            np.ones((1, len(near))),
            WEIGHT_COST_M * np.eye(len(near)),
        ])
        goal = np.concatenate([joint_mean[joint], joint_directions[joint].ravel(), [1.0]])
        goal = np.concatenate([goal, np.zeros(len(near))])
        regressor[joint, near] = np.linalg.lstsq(columns, goal, rcond=None)[0]
        if joint == twin:
            regressor[joint] = (regressor[joint] + regressor[joint, mirror_of]) / 2
    return regressor
