"""Limbs that no candidate has right are found where they are measured."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.energy import PriorBelief
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.hypotheses import Hypothesis, HypothesisSteps
from pop_core.fitting.limb_points import HAND, KINDS, limb_points
from pop_core.fitting.limb_proposals import LimbProposals
from pop_core.fitting.observation import Observation, observe
from pop_core.geometry.rotation import from_rotvec
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.retrieval.pose_prior import load_pose_prior
from pop_core.segmentation.body_segmentation import SegmentationConfig

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)


@pytest.fixture(scope='module')
def proposals() -> LimbProposals:
    return LimbProposals(load_pose_prior())


def hypothesis(body: BodyModel, person: BodyParameters, pose: np.ndarray) -> Hypothesis:
    return Hypothesis(
        FitBody(body, full=False).state(person.replaced(body_pose=pose)),
        PriorBelief(load_pose_prior(), pose, np.ones(23)))


def without_left(lifted: LiftedJoints, *names: str) -> LiftedJoints:
    """The same joints where a detector says nothing of a limb."""
    gone = [SHARED_INDEX[f'left_{name}'] for name in names]
    position, sigma_m = lifted.positions_camera.copy(), lifted.sigma_m.copy()
    state, px, scores = lifted.state.copy(), lifted.keypoints_px.copy(), lifted.scores.copy()
    position[gone], sigma_m[gone], px[gone], scores[gone] = np.nan, np.inf, np.nan, 0.0
    state[gone] = LiftState.MISSING
    return LiftedJoints(position, sigma_m, state, px, scores)


def improved(
    body: BodyModel, person: BodyParameters, start: np.ndarray, observation: Observation,
    proposals: LimbProposals,
) -> tuple[Hypothesis, Hypothesis]:
    steps = HypothesisSteps(body, FittingConfig(), SegmentationConfig())
    before, truth = (hypothesis(body, person, pose) for pose in (start, person.body_pose))
    segment = steps.common_segment([truth], observation)

    def judge(judged: list[Hypothesis]) -> None:
        steps.score(judged, observation, segment)

    judge([before])
    return before, proposals.improve(before, [], observation, segment, judge)


@pytest.mark.parametrize(('joint', 'turn', 'ends'), [
    ('left_shoulder', (0.0, 0.0, 0.8), ('elbow', 'wrist')),
    ('left_hip', (-0.8, 0.0, 0.0), ('knee', 'ankle'))])
@pytest.mark.parametrize('named', [True, False])
def test_a_limb_is_found_with_its_keypoints_and_without(
    body: BodyModel, person: BodyParameters, proposals: LimbProposals, named: bool, joint: str,
    turn: tuple[float, float, float], ends: tuple[str, str],
) -> None:
    pose = person.body_pose.copy()
    pose[JOINT_INDEX[joint] - 1] += turn
    moved = person.replaced(body_pose=pose)
    lifted = lift_truth(body, moved)
    observation = observe(
        photograph(body, moved), lifted if named else without_left(lifted, *ends), NOBODY)
    before, after = improved(body, moved, person.body_pose, observation, proposals)
    end = JOINT_INDEX[f'left_{ends[1]}']
    truth = hypothesis(body, moved, pose).state.joints[end]
    off_before, off_after = (
        np.linalg.norm(h.state.joints[end] - truth) for h in (before, after))
    assert after.cost < before.cost
    assert off_after < 0.4 * off_before
    others = [row for row in range(23) if row not in (*KINDS[0].rows, *KINDS[2].rows)]
    np.testing.assert_array_equal(
        after.state.parameters.body_pose[others], person.body_pose[others])


def test_a_body_that_explains_everything_keeps_its_limbs(
    body: BodyModel, person: BodyParameters, proposals: LimbProposals
) -> None:
    observation = observe(photograph(body, person), lift_truth(body, person), NOBODY)
    before, after = improved(body, person, person.body_pose, observation, proposals)
    assert after is before


@pytest.mark.parametrize('kind', KINDS)
def test_points_lie_on_the_bones_of_the_posed_body(
    body: BodyModel, person: BodyParameters, kind: object
) -> None:
    start = hypothesis(body, person, person.body_pose)
    poses = np.stack([person.body_pose, np.zeros((23, 3))])
    ways = limb_points(start.state, kind, from_rotvec(poses[:, kind.rows]))
    for pose, points, ends in zip(poses, ways.points, ways.ends, strict=True):
        rows = person.body_pose.copy()
        rows[kind.rows] = pose[kind.rows]
        joints = hypothesis(body, person, rows).state.joints[list(kind.joints)]
        np.testing.assert_allclose(ends, joints[1:3])
        bones = np.diff(joints, axis=0) * [[1.0], [1.0], [HAND]]
        expected = np.concatenate([
            joints[k] + np.outer(shares, bones[k]) for k, shares in enumerate(kind.shares)])
        np.testing.assert_allclose(points, expected)
    assert ways.points.shape[1] == len(ways.width_m) == len(ways.length_m)


def test_pixels_recognised_as_the_person_count_to_the_segment(
    body: BodyModel, person: BodyParameters
) -> None:
    observation = observe(photograph(body, person), lift_truth(body, person), NOBODY)
    assert not observation.recognised.any()
    labels = np.where(observation.own, JOINT_INDEX['spine1'], -1)
    steps = HypothesisSteps(body, FittingConfig(), SegmentationConfig())
    away = hypothesis(body, person.replaced(transl=person.transl + [3.0, 0, 0]), person.body_pose)
    segment = steps.common_segment([away], replace(observation, labels=labels))
    assert (segment >= observation.own).all()
    assert not steps.common_segment([away], observation).any()
