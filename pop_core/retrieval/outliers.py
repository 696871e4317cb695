"""Lifted joints that no pose of the library can explain beside the others.

Bone lengths and depth layers catch single gross errors; a swapped ankle or a wrist lifted onto
the wrong chair passes both. The library knows which skeletons people can make: a joint whose
removal makes the rest fit far better is an outlier. The paper removes "unreliable points" by
"basic statistics"; here the statistic is Eq. (1) itself, leaving one joint out.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32

from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.retrieval.pose_library import PoseLibrary
from pop_core.retrieval.procrustes import rank_similarities
from pop_core.retrieval.retrieve import RetrievalConfig

THIN = 8  # every so many poses are enough to tell a wrong joint
AT_ODDS = 2.5  # joint standard deviations that lifted joints may lie off what is expected
GAIN = 16.0  # chi-squared that a joint must cost: 4 sigma
FEWEST = 5  # joints that always stay: fewer agree with anything
MOST_DROPPED = 4
DOUBT = 0.5  # of the keypoint's score remains: its depth may be wrong, or its pixel


def reject_outliers(
    library: PoseLibrary, lifted: LiftedJoints, config: RetrievalConfig
) -> LiftedJoints:
    """Return lifted joints without those that only an impossible skeleton would have.

    Args:
        library: Poses that people can take.
        lifted: Lifted joints of one person.
        config: Scale limits and tolerance of Eq. (1).
    """
    columns = _thinned(library)
    for _ in range(MOST_DROPPED):
        seen = np.flatnonzero(lifted.lifted)
        if len(seen) <= FEWEST:
            break
        together = _misfit(columns, lifted, lifted.lifted, config)
        if together < GAIN:
            break
        alone = np.array([
            _misfit(columns, lifted, _without(lifted.lifted, int(j)), config) for j in seen])
        worst = int(np.argmin(alone))
        if together - alone[worst] < GAIN:
            break
        lifted = _dropped(lifted, int(seen[worst]))
    return lifted


def reject_strangers(lifted: LiftedJoints, expected: JointBelief | None) -> LiftedJoints:
    """Return lifted joints without those that are far from where they are expected.

    Where joints are expected was told with the keypoints and all depth around them in view.

    Args:
        lifted: Lifted joints of one person.
        expected: Where they are expected, or None.
    """
    if expected is None:
        return lifted
    apart_m = np.linalg.norm(lifted.positions_camera - expected.positions_camera, axis=1)
    far = lifted.lifted & (apart_m > AT_ODDS * np.hypot(lifted.sigma_m, expected.sigma_m))
    for joint in np.flatnonzero(far):
        lifted = _dropped(lifted, int(joint))
    return lifted


@lru_cache(maxsize=2)
def _thinned(library: PoseLibrary) -> Float32[np.ndarray, 's 3 m']:
    """Return the joints of every so many poses [m]."""
    return np.ascontiguousarray(library.columns[:, :, ::THIN])


def _misfit(
    columns: Float32[np.ndarray, 's 3 m'],
    lifted: LiftedJoints,
    used: Bool[np.ndarray, 's'],
    config: RetrievalConfig,
) -> float:
    """Return the least sum of squared normalised distances of any pose to the used joints."""
    weight: Float[np.ndarray, 's'] = np.zeros(len(used))
    weight[used] = 1.0 / (lifted.sigma_m[used] ** 2 + config.pose_sigma_m**2)
    costs = rank_similarities(
        columns, lifted.positions_camera, weight,
        (config.smallest_scale, config.largest_scale), threads=config.threads)
    return float(costs.min() * weight.sum())


def _without(used: Bool[np.ndarray, 's'], joint: int) -> Bool[np.ndarray, 's']:
    rest = used.copy()
    rest[joint] = False
    return rest


def _dropped(lifted: LiftedJoints, joint: int) -> LiftedJoints:
    positions, sigma = lifted.positions_camera.copy(), lifted.sigma_m.copy()
    state, scores = lifted.state.copy(), lifted.scores.copy()
    positions[joint], sigma[joint] = np.nan, np.inf
    state[joint], scores[joint] = int(LiftState.OUTLIER), DOUBT * scores[joint]
    return replace(
        lifted, positions_camera=positions, sigma_m=sigma, state=state, scores=scores)
