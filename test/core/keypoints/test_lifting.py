from dataclasses import replace

import numpy as np
import pytest
from keypoint_bodies import SEATED, bent, show, with_depth

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftState
from pop_core.keypoints.lifting import LiftingConfig, lift_keypoints
from pop_core.keypoints.people import detection_of

LEGS = [SHARED_INDEX[f'{side}_{part}'] for side in ('left', 'right') for part in ('knee', 'ankle')]
WRISTS = [SHARED_INDEX['left_wrist'], SHARED_INDEX['right_wrist']]


def errors_m(lifted, body):
    return np.linalg.norm(lifted.positions_camera - body.truth, axis=1)


def hidden_by_own_body(body):
    """Whether the skin at each joint's pixel lies more than a trunk's depth before the joint."""
    u, v = np.rint(body.detection.keypoints_px).astype(int).T
    return body.truth[:, 2] - body.frame.depth_m[v, u] > 0.24


def behind(body, top_row, z):
    """Put a flat board at depth z before everything below a row of the image."""
    depth = body.frame.depth_m.copy()
    depth[top_row:] = np.minimum(depth[top_row:], z)
    return with_depth(body, depth)


@pytest.mark.parametrize('yaw', [0.0, 0.5, -0.7, np.pi, np.pi - 0.6])
@pytest.mark.parametrize('pose', ['standing', 'seated'])
def test_joints_of_a_body_are_lifted_within_three_centimetres(yaw, pose):
    body = show(bent(**SEATED) if pose == 'seated' else None, yaw=yaw)
    lifted = lift_keypoints(body.frame, body.detection)
    seen = lifted.lifted & ~hidden_by_own_body(body)
    error = errors_m(lifted, body)[seen]
    assert seen.sum() >= 10
    assert np.median(error) < 0.03
    # A knee right beside a hip's pixel may still be taken for it.
    assert np.quantile(error, 0.9) < 0.12


def test_errors_stay_small_with_the_noise_of_a_detector():
    error = []
    for seed in range(12):
        body = show(yaw=0.2 * seed - 1.0, noise_px=4.0, seed=seed)
        error.append(errors_m(lift_keypoints(body.frame, body.detection), body))
    error = np.concatenate(error)
    # 4 px are 2 cm at this distance, along each axis.
    assert np.nanmedian(error) < 0.04
    assert np.isfinite(error).mean() > 0.9


def test_errors_agree_with_the_spread_that_is_told():
    ratio = []
    for seed in range(20):
        body = show(yaw=0.3 * seed, noise_px=4.0, seed=seed)
        lifted = lift_keypoints(body.frame, body.detection)
        ratio.append((errors_m(lifted, body) / lifted.sigma_m)[lifted.lifted])
    # The length of a 3D normal error is 1.54 sigma at the median.
    assert 0.7 < np.median(np.concatenate(ratio)) < 2.0


@pytest.mark.parametrize('gap_m', [0.35, 0.6, 1.2])
def test_legs_behind_a_board_are_occluded_and_never_lifted_onto_it(gap_m):
    body = show()
    knee_row = int(body.detection.keypoints_px[LEGS, 1].min())
    body = behind(body, knee_row - 20, 2.6 - gap_m)
    lifted = lift_keypoints(body.frame, body.detection)
    assert (lifted.state[LEGS] == LiftState.OCCLUDED).all()
    assert np.isnan(lifted.positions_camera[LEGS]).all()
    assert np.array_equal(lifted.keypoints_px[LEGS], body.detection.keypoints_px[LEGS])
    rest = np.setdiff1d(np.arange(15), LEGS)
    assert (lifted.state[rest] == LiftState.VISIBLE).all()
    assert np.median(errors_m(lifted, body)[rest]) < 0.03


def test_legs_with_missing_knees_are_not_lifted_onto_the_board_either():
    body = behind(show(), 330, 1.9)
    keypoints = body.detection.keypoints_px
    scores = np.full(15, 0.9)
    scores[[SHARED_INDEX['left_knee'], SHARED_INDEX['right_knee']]] = 0.0
    lifted = lift_keypoints(body.frame, detection_of(keypoints, scores))
    ankles = [SHARED_INDEX['left_ankle'], SHARED_INDEX['right_ankle']]
    assert (lifted.state[ankles] == LiftState.OCCLUDED).all()


def test_a_keypoint_that_leaks_onto_the_wall_is_an_outlier():
    body = show()
    uv = body.detection.keypoints_px.copy()
    wrist = SHARED_INDEX['left_wrist']
    uv[wrist] += [35.0, 0.0]  # beside the arm
    assert not body.covered[tuple(np.rint(uv[wrist, ::-1]).astype(int))]
    lifted = lift_keypoints(body.frame, detection_of(uv, np.full(15, 0.9)))
    assert lifted.state[wrist] == LiftState.OUTLIER
    assert np.isnan(lifted.positions_camera[wrist]).all()


def test_a_keypoint_thrown_across_the_body_is_an_outlier():
    body = show()
    uv = body.detection.keypoints_px.copy()
    wrist = SHARED_INDEX['left_wrist']
    uv[wrist] = uv[SHARED_INDEX['right_ankle']]
    lifted = lift_keypoints(body.frame, detection_of(uv, np.full(15, 0.9)))
    assert lifted.state[wrist] == LiftState.OUTLIER
    others = np.setdiff1d(np.arange(15), [wrist])
    assert (lifted.state[others] == LiftState.VISIBLE).all()


def test_of_two_surfaces_the_one_near_what_is_expected_is_taken():
    body = show()
    wrist, elbow = SHARED_INDEX['left_wrist'], SHARED_INDEX['left_elbow']
    u, v = np.rint(body.detection.keypoints_px[wrist]).astype(int)
    depth = body.frame.depth_m.copy()
    farther_m = depth[v, u] + 0.16  # where a forearm that leans back would end
    depth[v - 14: v + 15, u: u + 15] = farther_m
    body = with_depth(body, depth)
    for off_m in (0.0, 0.16):
        places = body.truth.copy()
        places[wrist, 2] += off_m
        expected = JointBelief(places, np.full(15, 0.05))
        lifted = lift_keypoints(body.frame, body.detection, expected=expected)
        assert lifted.lifted[[wrist, elbow]].all()
        assert lifted.positions_camera[wrist, 2] == pytest.approx(places[wrist, 2], abs=0.05)


def test_one_joint_that_is_expected_where_no_bone_reaches_stays():
    body = show()
    places = body.truth.copy()
    places[SHARED_INDEX['left_wrist'], 2] += 0.8
    expected = JointBelief(places, np.full(15, 0.03))
    alone = lift_keypoints(body.frame, body.detection)
    told = lift_keypoints(body.frame, body.detection, expected=expected)
    assert np.array_equal(told.lifted, alone.lifted)
    assert np.allclose(told.positions_camera, alone.positions_camera, equal_nan=True)


def test_arms_held_before_the_chest_stay_visible():
    arms = {'left_shoulder': [0.0, -1.0, -0.9], 'right_shoulder': [0.0, 1.0, 0.9],
            'left_elbow': [0.0, -1.2, 0.0], 'right_elbow': [0.0, 1.2, 0.0]}
    body = show(bent(**arms))
    chest = body.truth[SHARED_INDEX['neck'], 2]
    assert (body.truth[WRISTS, 2] < chest - 0.2).all()
    lifted = lift_keypoints(body.frame, body.detection)
    assert (lifted.state[WRISTS] == LiftState.VISIBLE).all()
    assert errors_m(lifted, body)[WRISTS].max() < 0.06


def test_a_hand_reaching_for_the_camera_stays_visible():
    body = show(bent(left_shoulder=[-0.3, -1.4, 0.0]))
    lifted = lift_keypoints(body.frame, body.detection)
    wrist = WRISTS[0]
    assert body.truth[wrist, 2] < body.truth[SHARED_INDEX['neck'], 2] - 0.35
    assert lifted.state[wrist] == LiftState.VISIBLE
    assert errors_m(lifted, body)[wrist] < 0.06


@pytest.mark.parametrize('kept', [
    ['neck', 'left_shoulder', 'right_shoulder', 'left_elbow'],
    ['pelvis', 'left_hip', 'right_hip', 'left_knee', 'right_knee'],
    ['head', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist'],
])
def test_four_or_five_keypoints_are_enough(kept):
    body = show(noise_px=2.0)
    rows = [SHARED_INDEX[name] for name in kept]
    scores = np.zeros(15)
    scores[rows] = 0.9
    lifted = lift_keypoints(body.frame, detection_of(body.detection.keypoints_px, scores))
    assert (lifted.state[rows] == LiftState.VISIBLE).all()
    assert errors_m(lifted, body)[rows].max() < 0.12
    missing = np.setdiff1d(np.arange(15), rows)
    assert (lifted.state[missing] == LiftState.MISSING).all()


def test_a_child_is_lifted_as_well_as_an_adult():
    body = show(scale=0.65, z=2.2)
    lifted = lift_keypoints(body.frame, body.detection)
    assert lifted.lifted.sum() >= 13
    assert np.median(errors_m(lifted, body)[lifted.lifted]) < 0.03


def test_nearby_walls_do_not_draw_the_body_back():
    body = show(wall_m=2.95, noise_px=3.0)
    lifted = lift_keypoints(body.frame, body.detection)
    assert np.nanmedian(errors_m(lifted, body)) < 0.04


def test_moving_body_and_camera_along_the_axis_moves_the_joints_alike():
    near, far = show(z=2.0, wall_m=5.0), show(z=3.0, wall_m=5.0)
    lifted = [lift_keypoints(body.frame, body.detection) for body in (near, far)]
    shift = lifted[1].positions_camera - lifted[0].positions_camera
    both = lifted[0].lifted & lifted[1].lifted
    np.testing.assert_allclose(
        shift[both], (far.truth - near.truth)[both], atol=0.04)  # patches of whole pixels


def test_a_frame_without_depth_lifts_nothing_and_keeps_the_pixels():
    body = show()
    blind = with_depth(body, np.full_like(body.frame.depth_m, np.nan))
    lifted = lift_keypoints(blind.frame, body.detection)
    assert not lifted.lifted.any()
    assert (lifted.state == LiftState.MISSING).all()
    assert np.array_equal(lifted.keypoints_px, body.detection.keypoints_px)
    assert np.isinf(lifted.sigma_m).all()


def test_keypoints_outside_the_image_are_missing():
    body = show()
    uv = body.detection.keypoints_px.copy()
    uv[WRISTS[0]] = [-40.0, 200.0]
    lifted = lift_keypoints(body.frame, detection_of(uv, np.full(15, 0.9)))
    assert lifted.state[WRISTS[0]] == LiftState.MISSING


def test_scores_below_the_threshold_are_undetected():
    body = show()
    scores = np.full(15, 0.9)
    scores[WRISTS] = 0.3
    detection = detection_of(body.detection.keypoints_px, scores)
    lifted = lift_keypoints(body.frame, detection, LiftingConfig(min_score=0.5))
    assert (lifted.state[WRISTS] == LiftState.MISSING).all()
    assert np.isnan(lifted.keypoints_px[WRISTS]).all()


def test_joints_that_the_source_calls_hidden_are_occluded():
    body = show()
    visible = np.ones(15)
    visible[LEGS] = 0.1
    lifted = lift_keypoints(body.frame, replace(body.detection, visible=visible))
    assert (lifted.state[LEGS] == LiftState.OCCLUDED).all()
    assert not lifted.lifted[LEGS].any()


def test_depth_that_the_source_gives_is_taken_as_it_is():
    body = show()
    detection = replace(
        body.detection, joint_depth_m=body.truth[:, 2].copy(), joint_sigma_m=np.full(15, 0.02))
    lifted = lift_keypoints(body.frame, detection)
    np.testing.assert_allclose(lifted.positions_camera, body.truth, atol=1e-9)
    assert np.array_equal(lifted.sigma_m, np.full(15, 0.02))


def test_hidden_joints_of_known_depth_have_a_position():
    body = behind(show(), 330, 1.9)
    visible = np.ones(15)
    visible[LEGS] = 0.1
    detection = replace(
        body.detection, visible=visible, joint_depth_m=body.truth[:, 2].copy(),
        joint_sigma_m=np.full(15, 0.1))
    lifted = lift_keypoints(body.frame, detection)
    assert (lifted.state[LEGS] == LiftState.OCCLUDED).all()
    np.testing.assert_allclose(lifted.positions_camera[LEGS], body.truth[LEGS], atol=1e-9)


def test_a_mask_keeps_joints_off_the_person_in_front():
    body = show()
    depth = body.frame.depth_m.copy()
    column = int(body.detection.keypoints_px[SHARED_INDEX['left_elbow'], 0]) - 12
    other = np.zeros(depth.shape, bool)
    other[:, column:] = True
    depth[other] = np.minimum(depth[other], 2.25)
    covered = with_depth(body, depth)
    mask = body.covered & ~other
    lifted = lift_keypoints(covered.frame, replace(body.detection, person_mask=mask))
    hidden = [SHARED_INDEX['left_elbow'], SHARED_INDEX['left_wrist']]
    assert (lifted.state[hidden] != LiftState.VISIBLE).all()


def test_the_inputs_are_left_as_they_were():
    body = show(noise_px=3.0)
    before = body.frame.depth_m.copy(), body.detection.keypoints_px.copy()
    lift_keypoints(body.frame, body.detection)
    assert np.array_equal(before[0], body.frame.depth_m)
    assert np.array_equal(before[1], body.detection.keypoints_px)


