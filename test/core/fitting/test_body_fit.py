"""The fit recovers what it was shown."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.body.skinning import vertices
from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.correspondence import match_points
from pop_core.fitting.depth_consistency import free_space_violation, see_body
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.observation import observe
from pop_core.fitting.uncertainty import joint_covariance
from pop_core.geometry.rotation import from_rotvec
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.rendering.depth_renderer import render_depth
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import load_pose_prior
from pop_core.rgbd import RgbdFrame

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
SIDES = ('left', 'right')
LEGS = tuple(SHARED_INDEX[f'{side}_{name}'] for side in SIDES for name in ('knee', 'ankle'))


def candidate(body: BodyModel, pose: BodyParameters) -> PoseCandidate:
    p = attached_positions(shared_points(body), body, pose)
    return PoseCandidate(
        pose.body_pose, p, pose.scale, from_rotvec(pose.global_orient), pose.transl, 0.02, 1.0, 0)


def disturbed(person: BodyParameters, seed: int, spread_rad: float) -> BodyParameters:
    """A neighbour in the library: the mean body in a nearby pose, somewhat off."""
    rng = np.random.default_rng(seed)
    return person.replaced(
        body_pose=person.body_pose + spread_rad * rng.normal(size=(23, 3)),
        transl=person.transl + 0.05 * rng.normal(size=3), betas=np.zeros(10))


@pytest.fixture(scope='module')
def fitter() -> BodyFitter:
    from pop_core.body.default_body import default_body

    return BodyFitter(default_body(), load_pose_prior())


def fit(fitter: BodyFitter, frame: RgbdFrame, lifted: LiftedJoints,
        start: list[BodyParameters]) -> BodyFit:
    observation = observe(frame, lifted, NOBODY)
    return fitter.fit(observation, [candidate(fitter.model, pose) for pose in start])


def test_a_person_in_full_view_is_recovered(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    start = [disturbed(person, seed, 0.15) for seed in range(3)]
    result = fit(fitter, photograph(body, person), lift_truth(body, person), start)
    error = np.linalg.norm(joints(body, result.parameters) - joints(body, person), axis=1)
    # The sensor is perfect; cloth (6 mm) is assumed and not worn, and joints lie deep in flesh.
    assert error.mean() < 0.025
    seen = error[[JOINT_INDEX[n] for n in ('head', 'left_wrist', 'right_wrist', 'left_knee')]]
    assert seen.max() < 0.04


def test_the_hypothesis_that_agrees_with_the_depth_wins(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    """Legs unseen by the detector: only the depth image tells standing from sitting."""
    sitting = person.body_pose.copy()
    sitting[[0, 1], 0] = -1.5
    sitting[[3, 4], 0] = 1.5
    start = [person.replaced(body_pose=sitting, betas=np.zeros(10)), disturbed(person, 1, 0.1)]
    result = fit(fitter, photograph(body, person), lift_truth(body, person, LEGS), start)
    error = np.linalg.norm(joints(body, result.parameters) - joints(body, person), axis=1)
    ankles = error[[JOINT_INDEX['left_ankle'], JOINT_INDEX['right_ankle']]]
    assert ankles.max() < 0.08


def test_hidden_legs_have_larger_covariance_than_seen_arms(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    frame = photograph(body, person)
    depth = frame.depth_m.copy()
    depth[125:] = 1.8  # a counter before everything below the hips
    start = [disturbed(person, seed, 0.15) for seed in range(3)]
    result = fit(fitter, RgbdFrame(frame.rgb, depth, CAMERA),
                 lift_truth(body, person, LEGS), start)
    covariance = joint_covariance(body, result, np.zeros(24, dtype=np.int64), SINGLE_FRAME)
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2))
    np.testing.assert_allclose(covariance, covariance.transpose(0, 2, 1), atol=1e-12)
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    hidden = sigma[[JOINT_INDEX['left_ankle'], JOINT_INDEX['right_ankle']]]
    assert hidden.min() > 2 * sigma[JOINT_INDEX['left_elbow']]


def test_runners_up_are_reported(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    start = [disturbed(person, seed, 0.15) for seed in range(3)]
    result = fit(fitter, photograph(body, person), lift_truth(body, person), start)
    others = result.runners_up
    assert len(others) == len(start) - 1
    assert sum(other.finished for other in others) == fitter.config.final_hypotheses - 1
    excess = [other.excess_cost for other in others]
    assert excess == sorted(excess)
    assert all(other.excess_cost >= 0 for other in others if other.finished)
    assert set(result.energies) == {'E_J3D', 'E_prior', 'E_NN', 'E_depth'}


def test_space_that_the_sensor_saw_through_sends_an_arm_behind_the_pillar(
    body: BodyModel, person: BodyParameters
) -> None:
    """Retrieved arms stand beside the pillar, where the wall is seen; no keypoint names them."""
    arm = [SHARED_INDEX[name] for name in ('left_shoulder', 'left_elbow', 'left_wrist')]
    p = CAMERA.project(attached_positions(shared_points(body), body, person)[arm])
    (left, top), (right, _) = p.min(axis=0), p.max(axis=0)
    frame = photograph(body, person)
    depth_m = frame.depth_m.copy()
    depth_m[int(top) - 6:, int(left) - 2: int(right) + 14] = 1.8
    hidden = RgbdFrame(frame.rgb, depth_m, CAMERA)
    lifted = lift_truth(body, person, tuple(arm[1:]))
    violation = {True: 0.0, False: 0.0}
    for raised_rad in (-0.6, -0.3, 0.0, 0.4):
        pose = person.body_pose.copy()
        pose[JOINT_INDEX['left_shoulder'] - 1, 2] = raised_rad
        for free_space in violation:
            config = FittingConfig(
                free_space=free_space, limb_searches=0, limb_trials=0)
            fitter = BodyFitter(body, load_pose_prior(), config)
            found = fit(fitter, hidden, lifted, [person.replaced(body_pose=pose)])
            mesh = render_depth(vertices(body, found.parameters), body.f, CAMERA)
            violation[free_space] += free_space_violation(mesh, depth_m)
    assert violation[True] < 0.5 * violation[False]


def test_an_arm_that_stands_clear_is_found_though_its_keypoints_lie_on_the_other(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    """No body near the keypoints touches the arm's surface, but it hangs on the shoulder."""
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1, 2] += 1.6
    waving = person.replaced(body_pose=pose)
    names = ('elbow', 'wrist')
    left, right = ([SHARED_INDEX[f'{side}_{name}'] for name in names] for side in SIDES)
    lifted = lift_truth(body, waving)
    positions, pixels = lifted.positions_camera.copy(), lifted.keypoints_px.copy()
    positions[left], pixels[left] = positions[right] + [0.05, 0.0, 0.0], pixels[right]
    wrong = replace(lifted, positions_camera=positions, keypoints_px=pixels)
    start = [disturbed(person, seed, 0.1) for seed in range(3)]
    result = fit(fitter, photograph(body, waving), wrong, start)
    error = np.linalg.norm(joints(body, result.parameters) - joints(body, waving), axis=1)
    assert error[[JOINT_INDEX[f'left_{name}'] for name in names]].max() < 0.04


def test_the_body_that_was_photographed_costs_less_than_another(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    frame, lifted = photograph(body, person), lift_truth(body, person)
    observation = observe(frame, lifted, NOBODY)
    right = fit(fitter, frame, lifted, [disturbed(person, 0, 0.1)])
    away = person.replaced(transl=person.transl + [0.1, 0.0, 0.0])
    wrong = replace(right, coarse=fitter.coarse.state(away), parameters=away)
    ours, theirs = fitter.costs([right, wrong], [observation, observation])
    assert ours < theirs
    np.testing.assert_allclose(
        fitter.costs([wrong, right], [observation, observation]), [theirs, ours])


def test_a_body_costs_by_its_own_reading_of_the_keypoints(
    fitter: BodyFitter, body: BodyModel, person: BodyParameters
) -> None:
    frame, lifted = photograph(body, person), lift_truth(body, person)
    expected = JointBelief(lifted.positions_camera, np.full(15, 0.1))
    named = observe(frame, lifted, NOBODY, expected=expected)
    exchanged = named.with_sides_exchanged()
    body_fit = fit(fitter, frame, lifted, [disturbed(person, 0, 0.1)])
    turned = replace(body_fit, sides_exchanged=True)
    as_named, as_exchanged, undone = fitter.costs(
        [body_fit, body_fit, turned], [named, exchanged, exchanged])
    assert as_named < as_exchanged
    assert undone == pytest.approx(as_named)
    silent = replace(exchanged, expected=expected)
    assert fitter.costs([body_fit], [silent])[0] < as_exchanged


@pytest.mark.parametrize('trials', [0, 2])
def test_a_limb_that_serves_only_once_it_is_fitted_is_found(
    body: BodyModel, person: BodyParameters, trials: int
) -> None:
    """No keypoint tells of the forearm; as drawn, other ways of it cost more than a wrong one."""
    bent = person.body_pose.copy()
    bent[JOINT_INDEX['left_elbow'] - 1, 1] -= 1.2
    moved = person.replaced(body_pose=bent)
    lifted = lift_truth(body, moved)
    lifted = lifted.without(np.arange(len(lifted.scores)) == SHARED_INDEX['left_wrist'])
    fitter = BodyFitter(
        body, load_pose_prior(), FittingConfig(limb_searches=0, limb_trials=trials))
    found = fit(fitter, photograph(body, moved), lifted, [person])
    wrist = JOINT_INDEX['left_wrist']
    off_m = np.linalg.norm(
        joints(body, found.parameters)[wrist] - joints(body, moved)[wrist])
    assert (off_m < 0.04) == (trials > 0)


def test_points_recognised_as_a_far_part_do_not_pull(
    body: BodyModel, person: BodyParameters
) -> None:
    frame = photograph(body, person)
    observation = observe(frame, lift_truth(body, person), NOBODY)
    state = FitBody(body, full=False).state(person)
    visibility = see_body(state, observation)
    chest = state.vertices[state.body.main_bone == JOINT_INDEX['spine3']][:20]
    for part, pulls in (('spine2', True), ('left_hand', False)):
        parts = np.full(len(chest), JOINT_INDEX[part])
        pairs = match_points(state, visibility, chest, parts, 0.1, observation.noise)
        assert (pairs.weight > 0).any() == pulls
