"""Ten shape directions in units of standard deviations, and a joint regressor that fits them."""

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import cKDTree

N_BETAS = 10


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


def fit_betas(
    people: np.ndarray, mean: np.ndarray, directions: np.ndarray, area: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the betas (p, 10) of people and the distance of each vertex (p, v) [m] left over."""
    scale = np.sqrt(area)[:, None]
    basis = (directions * scale[:, :, None]).reshape(-1, N_BETAS)
    offsets = ((people - mean) * scale).reshape(len(people), -1)
    betas = np.linalg.solve(basis.T @ basis, basis.T @ offsets.T).T
    left = people - mean - np.einsum('vcb,pb->pvc', directions, betas)
    return betas, np.linalg.norm(left, axis=2)


def joint_regressor(
    mean: np.ndarray, directions: np.ndarray, joint_mean: np.ndarray,
    joint_directions: np.ndarray, mirror_of: np.ndarray, joint_mirror: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return non-negative rows (24, v) that give the joints of the shape space.

    Each joint is a weighted mean of about thirty of its nearest vertices, for the mean body and
    along every direction at once; right joints take the mirrored rows of left ones.
    """
    regressor = np.zeros((len(joint_mean), len(mean)))
    for joint, twin in enumerate(joint_mirror):
        if joint > twin:
            regressor[joint, mirror_of] = regressor[twin]
            continue
        near = cKDTree(mean).query(joint_mean[joint], k=700)[1]
        if joint == twin:
            near = np.union1d(near, mirror_of[near])
        # Sum to one counts a hundred times a metre: a free body would otherwise drift.
        columns = np.concatenate([
            mean[near].T, directions[near].transpose(1, 2, 0).reshape(-1, len(near)),
            np.full((1, len(near)), 100.0),
        ])
        goal = np.concatenate([joint_mean[joint], joint_directions[joint].ravel(), [100.0]])
        weights = nnls(columns, goal)[0]
        regressor[joint, near] = weights / weights.sum()
        if joint == twin:
            regressor[joint] = (regressor[joint] + regressor[joint, mirror_of]) / 2
    return regressor
