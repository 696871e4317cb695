"""Arms and legs looked for where the measurements are, beyond the poses that were retrieved.

When the trunk is found, a limb has few ways to be, and each can be priced without a mesh: by the
keypoints it meets, by the unexplained surface along its bones, by the free space it would stand
in. The cheapest of many limbs of the pose prior, none like another, then compete as whole bodies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.fitting.depth_consistency import CLOTHES_M, DEPTH_LIMIT_M
from pop_core.fitting.energy import TermWeights
from pop_core.fitting.hypotheses import DEPTH_SCORE, Hypothesis
from pop_core.fitting.limb_kernels import bone_misfits
from pop_core.fitting.limb_points import KINDS, LimbKind, LimbPoints, limb_points
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import RAY_SCALE_M
from pop_core.fitting.robust_loss import geman_mcclure_share
from pop_core.fitting.trials import Judge, cheapest, with_pose
from pop_core.geometry.rotation import from_rotvec
from pop_core.rendering.depth_renderer import render_depth
from pop_core.retrieval.pose_prior import PosePrior

SAMPLES, SEED = 1500, 0
COMPETING = 4  # limbs that are judged as whole bodies
APART_M = 0.10  # mean distance along the bones between limbs that are worth judging both
HOPELESS = 3.0  # cost beyond the present limb's at which another need not be judged
MARGIN = 2.0  # cost that another limb must save
EXPLAINED_M = 0.06  # surface this near to the rest of the body needs no limb


class LimbProposals:
    """Limbs of a pose prior that any hypothesis may take."""

    def __init__(self, prior: PosePrior) -> None:
        """Draw the limbs once."""
        poses = prior.sample(np.random.default_rng(SEED), SAMPLES)
        self._limbs = {kind: _Limbs.of(list(poses), kind) for kind in KINDS}

    def improve(
        self, hypothesis: Hypothesis, donors: Sequence[Hypothesis], observation: Observation,
        segment: Bool[np.ndarray, 'h w'], judge: Judge,
    ) -> Hypothesis:
        """Return a hypothesis with limbs that explain what is seen better, or itself.

        Args:
            hypothesis: Its cost is known.
            donors: Other hypotheses, whose limbs compete too.
            observation: What the sensor says.
            segment: Pixels of the person.
            judge: Sets the cost of hypotheses.
        """
        for kind in KINDS:
            trials = self.trials(hypothesis, kind, donors, observation, segment)
            hypothesis = cheapest(hypothesis, trials, judge, MARGIN)
        return hypothesis

    def trials(
        self, hypothesis: Hypothesis, kind: LimbKind, donors: Sequence[Hypothesis],
        observation: Observation, segment: Bool[np.ndarray, 'h w'],
    ) -> list[Hypothesis]:
        """Return a hypothesis with each of the most promising other limbs of a kind.

        Args:
            hypothesis: What to vary.
            kind: Which arm or leg.
            donors: Other hypotheses, whose limbs compete with those of the pose prior.
            observation: What the sensor says.
            segment: Pixels of the person.
        """
        theirs, present = (
            _Limbs.of([each.state.parameters.body_pose for each in bodies], kind)
            for bodies in (donors, [hypothesis]))
        # The last one is the present limb, which the others have to beat.
        limbs = _Limbs.joined([theirs, self._limbs[kind], present])
        return [_with_limb(hypothesis, kind, limb)
                for limb in _competing(hypothesis, kind, limbs, observation, segment)]


@dataclass(frozen=True, slots=True, eq=False)
class _Limbs:
    """Ways of one kind of limb to be bent.

    Args:
        rotvecs: Rotation of each joint that turns it [rad].
        turns: The same as matrices.
    """

    rotvecs: Float[np.ndarray, 'n 3 3']
    turns: Float[np.ndarray, 'n 3 3 3']

    @classmethod
    def of(cls, poses: Sequence[Float[np.ndarray, '23 3']], kind: LimbKind) -> _Limbs:
        """Return the limbs of poses [rad]."""
        rotvecs = np.reshape([pose[kind.rows] for pose in poses], (-1, 3, 3))
        return cls(rotvecs, from_rotvec(rotvecs))

    @classmethod
    def joined(cls, parts: Sequence[_Limbs]) -> _Limbs:
        """Return all limbs of several sets."""
        return cls(
            np.concatenate([part.rotvecs for part in parts]),
            np.concatenate([part.turns for part in parts]))


def _competing(
    hypothesis: Hypothesis, kind: LimbKind, limbs: _Limbs, observation: Observation,
    segment: Bool[np.ndarray, 'h w'],
) -> Float[np.ndarray, 'k 3 3']:
    """Return the rotations of the cheapest limbs, none like another [rad], cheapest first."""
    ways = limb_points(hypothesis.state, kind, limbs.turns)
    unexplained = segment & ~_explained_by_the_rest(hypothesis, kind, observation)
    cost = _keypoint_cost(ways, kind, observation) + _depth_cost(
        ways, observation, unexplained, max(int(segment.sum()), 1))
    chosen: list[int] = []
    for i in np.argsort(cost[:-1]):
        if len(chosen) == COMPETING or cost[i] > cost[-1] + HOPELESS:
            break
        apart_m = np.linalg.norm(ways.points[chosen] - ways.points[i], axis=-1).mean(axis=-1)
        if (apart_m > APART_M).all():
            chosen.append(int(i))
    return limbs.rotvecs[chosen]


def _explained_by_the_rest(
    hypothesis: Hypothesis, kind: LimbKind, observation: Observation
) -> Bool[np.ndarray, 'h w']:
    """Return the pixels whose surface the body without a limb explains."""
    state = hypothesis.state
    faces = state.body.faces_without(kind.joints)
    rest = render_depth(state.vertices, faces, observation.camera).depth_m
    with np.errstate(invalid='ignore'):
        return np.abs(rest - observation.depth_m) < EXPLAINED_M


def _keypoint_cost(
    ways: LimbPoints, kind: LimbKind, observation: Observation
) -> Float[np.ndarray, 'n']:
    """Return what the limb's keypoints cost, as in E_J3D."""
    lifted, rays = observation.lifted, observation.keypoint_rays
    cost = np.zeros(len(ways.ends))
    for k, joint in enumerate(kind.keypoints):
        end = ways.ends[:, k]
        if lifted.lifted[joint]:
            distance = np.linalg.norm(end - lifted.positions_camera[joint], axis=1)
            cost += _robust(distance, lifted.sigma_m[joint], TermWeights().robust_m)
        for row in np.flatnonzero(rays.joint == joint):
            distance = np.linalg.norm(end @ rays.across[row].T, axis=1)
            sigma_m = rays.sigma * np.maximum(end[:, 2], 0.3)
            cost += rays.score[row] * _robust(distance, sigma_m, RAY_SCALE_M)
    return cost


def _robust(
    distance: Float[np.ndarray, 'n'], sigma_m: float | Float[np.ndarray, 'n'], scale_m: float
) -> Float[np.ndarray, 'n']:
    return 0.5 * (distance / sigma_m) ** 2 * geman_mcclure_share(distance, scale_m)


def _depth_cost(
    ways: LimbPoints, observation: Observation, unexplained: Bool[np.ndarray, 'h w'],
    segment_px: int,
) -> Float[np.ndarray, 'n']:
    """Return what E_depth would say of the pixels along the bones, roughly.

    A point before the measured surface costs its gap, one on surface that nothing else explains
    saves what is unexplained, one that is hidden costs nothing; below the floor nothing hides.
    """
    ground, camera = observation.ground, observation.camera
    margin_m = CLOTHES_M + 0.01 + 2 * observation.noise.sigma_m(ways.points[..., 2])
    # Height above the floor, and everywhere above where none is seen.
    floor = np.array([0.0, 0.0, 0.0, np.inf])
    if ground is not None:
        floor = np.append(ground.normal, ground.offset_m)
    cost = bone_misfits(
        ways.points, ways.width_m, ways.length_m, margin_m, observation.depth_m, unexplained,
        camera.fx, camera.fy, camera.cx, camera.cy, floor, CLOTHES_M, DEPTH_LIMIT_M)
    return np.asarray(DEPTH_SCORE * DEPTH_LIMIT_M / segment_px * cost)


def _with_limb(
    hypothesis: Hypothesis, kind: LimbKind, limb: Float[np.ndarray, '3 3']
) -> Hypothesis:
    pose = hypothesis.state.parameters.body_pose.copy()
    expected = hypothesis.belief.pose.copy()
    pose[kind.rows], expected[kind.rows] = limb, limb
    return with_pose(hypothesis, pose, expected)
