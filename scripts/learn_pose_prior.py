"""Learn the committed pose prior from motion capture: a mixture of low-rank Gaussians by EM.

    python scripts/learn_pose_prior.py --mocap ../shared/data/mocap/cmu_smpl_train.npz

Half of the components come from the motion, half from the procedural families: the motion shows
nobody who sits, kneels or lies. Subjects are balanced, every pose is joined by its mirror image,
and the number of components is judged on subjects held out whole: frames of one subject leak. The
saved prior never saw the held-out subjects either, so that all figures about them stay honest.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.joint_limits import LOWER, UPPER, mirrored_pose, pose_coordinates
from pop_core.body.joints import JOINT_NAMES
from pop_core.retrieval.canonical_pose import canonical_pose, hinge_elbows
from pop_core.retrieval.pose_prior import DEFAULT_FILE, PosePrior
from pop_core.retrieval.procedural.families import FAMILIES, draw_batch

RANK = 12
LARGEST_SUBJECT = 1500  # frames that one subject may count for
HELD_OUT = ('02', '06', '09', '12')
# Standard deviation [rad] added to what the data show: they are retargeted, their spine, feet,
# collars and hands never move, and their forearms never turn.
FLOOR_RAD = {
    'spine': 0.09, 'foot': 0.15, 'collar': 0.12, 'hand': 0.25, 'wrist': 0.2, 'elbow': 0.12,
    'shoulder': 0.1, 'neck': 0.1, 'head': 0.1, 'hip': 0.08, 'knee': 0.08, 'ankle': 0.12,
}
FOREARM_TURN_RAD = 0.5


def load_coordinates(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates (n, 69) [rad] of plausible frames and the subject of each."""
    with np.load(path) as data:
        body_pose = data['pose'][:, 1:].astype(np.float64)
        subjects = np.array([name.split('_')[0] for name in data['clip_names']])[data['clip']]
    shoulders = [JOINT_NAMES.index(f'{side}_shoulder') - 1 for side in ('left', 'right')]
    turn = pose_coordinates(hinge_elbows(body_pose))[:, shoulders, 0]
    # An upper arm turned further than this comes from an elbow the retargeting bent backwards.
    plausible = (np.abs(turn) < UPPER[shoulders, 0]).all(axis=1)
    pose = canonical_pose(body_pose[plausible])
    return pose_coordinates(pose).reshape(len(pose), -1), subjects[plausible]


def with_mirror(c: np.ndarray) -> np.ndarray:
    """Return coordinates and those of the mirrored poses (they mirror like rotation vectors)."""
    return np.vstack([c, mirrored_pose(c.reshape(-1, 23, 3)).reshape(c.shape)])


def subject_weights(subjects: np.ndarray) -> np.ndarray:
    """Return a weight per frame, of mean one, that bounds what a subject counts for."""
    names, index, counts = np.unique(subjects, return_inverse=True, return_counts=True)
    del names
    weight = np.minimum(1.0, LARGEST_SUBJECT / counts)[index]
    return weight / weight.mean()


def floor_variances() -> np.ndarray:
    """Return the variance floor (69) [rad^2] of each coordinate."""
    keys = [''.join(filter(str.isalpha, name.split('_')[-1])) for name in JOINT_NAMES[1:]]
    floor = np.repeat(np.array([[FLOOR_RAD[key]] for key in keys]), 3, axis=1)
    floor[[JOINT_NAMES.index('left_elbow') - 1, JOINT_NAMES.index('right_elbow') - 1], 0] = (
        FOREARM_TURN_RAD)
    return floor.reshape(-1) ** 2


def fit_component(c: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return mean, factors and variances of weighted samples (probabilistic PCA with a floor)."""
    total = weight.sum()
    mean = weight @ c / total
    centred = c - mean
    covariance = (centred * weight[:, None]).T @ centred / total
    values, vectors = np.linalg.eigh(covariance)
    factors = vectors[:, -RANK:] * np.sqrt(np.maximum(values[-RANK:], 0.0))
    rest = np.maximum(np.diag(covariance) - np.sum(factors**2, axis=1), 0.0)
    return mean, factors, rest + floor_variances()


def learn(c: np.ndarray, weight: np.ndarray, k: int, seed: int = 0) -> PosePrior:
    """Return the mixture that 40 rounds of expectation maximisation find from a spread start."""
    rng = np.random.default_rng(seed)
    centres = c[[rng.integers(len(c))]]
    for _ in range(k - 1):  # k-means++ seeding (Arthur and Vassilvitskii 2007)
        nearest = np.min(np.sum((c[:, None] - centres) ** 2, axis=2), axis=1) * weight
        centres = np.vstack([centres, c[rng.choice(len(c), p=nearest / nearest.sum())]])
    distance = np.sum((c[:, None] - centres) ** 2, axis=2)
    share = np.eye(k)[np.argmin(distance, axis=1)]
    for _ in range(40):
        responsibility = share * weight[:, None]
        parts = [fit_component(c, responsibility[:, i]) for i in range(k)]
        means, factors, variances = (np.stack(arrays) for arrays in zip(*parts, strict=True))
        shares = responsibility.sum(axis=0) / responsibility.sum()
        prior = PosePrior(shares, means, factors, variances, np.ones(k, dtype=bool))
        cost = prior.component_costs(c)
        share = np.exp(-cost - np.logaddexp.reduce(-cost, axis=1)[:, None])
    return prior


def procedural_coordinates(batches: int = 120) -> np.ndarray:
    """Return coordinates (n, 69) [rad] of poses that the rules draw, all families alike."""
    rng, model = np.random.default_rng(1), default_body()
    families = list(FAMILIES.values())
    drawn = [draw_batch(families[i % len(families)], model, rng, 128) for i in range(batches)]
    pose = np.concatenate([poses.body_pose for poses in drawn])
    return pose_coordinates(pose).reshape(len(pose), -1)


def joined(motion: PosePrior, rules: PosePrior) -> PosePrior:
    """Return one mixture of both, each counting for half."""
    weights, means, factors, variances = (
        np.concatenate([getattr(motion, name), getattr(rules, name)])
        for name in ('weights', 'means', 'factors', 'variances')
    )
    from_motion = np.arange(len(weights)) < len(motion.weights)
    return PosePrior(0.5 * weights, means, factors, variances, from_motion)


def mean_log_density(prior: PosePrior, c: np.ndarray, weight: np.ndarray) -> float:
    """Return the weighted mean log density [nats per pose]."""
    return float(
        weight @ np.logaddexp.reduce(-prior.component_costs(c), axis=1) / weight.sum())


def main() -> None:
    """Report held-out log densities, then save the prior of the other subjects."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--mocap', type=Path, required=True)
    parser.add_argument('--out', type=Path, default=DEFAULT_FILE)
    parser.add_argument('--components', type=int, default=4)
    parser.add_argument('--every', type=int, default=2, help='use every n-th frame')
    options = parser.parse_args()
    c, subjects = load_coordinates(options.mocap)
    c, subjects = c[:: options.every], subjects[:: options.every]
    print(f'{len(c)} plausible frames of {len(set(subjects))} subjects, mirrored')
    held = np.isin(subjects, HELD_OUT)
    both = np.concatenate
    train, test = with_mirror(c[~held]), with_mirror(c[held])
    weight = both([subject_weights(subjects[~held])] * 2)
    for k in (1, 2, 4, 6, 8):
        prior = learn(train, weight, k)
        score = mean_log_density(prior, test, both([subject_weights(subjects[held])] * 2))
        print(f'{k} components: log density {mean_log_density(prior, train, weight):7.2f} '
              f'on its subjects, {score:7.2f} on subjects {", ".join(HELD_OUT)}')
    motion = learn(train, weight, options.components)
    rules = with_mirror(procedural_coordinates())
    prior = joined(motion, learn(rules, np.ones(len(rules)), options.components))
    inside = (prior.means >= LOWER.reshape(-1)) & (prior.means <= UPPER.reshape(-1))
    print(f'means within limits: {inside.all()}; shares {np.round(prior.weights, 3)}')
    np.savez_compressed(
        options.out, weights=prior.weights, means=prior.means.astype(np.float32),
        factors=prior.factors.astype(np.float32), variances=prior.variances.astype(np.float32),
        from_motion=prior.from_motion)
    print(f'{options.out}: {options.out.stat().st_size / 1000:.0f} kB')


if __name__ == '__main__':
    main()
