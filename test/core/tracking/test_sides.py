"""Left and right of keypoints: exchanged ones are taken for what they are, all others left."""

from dataclasses import replace

import numpy as np
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import SHARED_INDEX, SHARED_NAMES
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.fitting.observation import observe
from pop_core.tracking.sides import misnamed_joints, without_joints

HEAD = SHARED_INDEX['head']
ARMS = np.array([name.endswith(('shoulder', 'elbow', 'wrist')) for name in SHARED_NAMES])


def points(body: BodyModel, person: BodyParameters) -> np.ndarray:
    return attached_positions(shared_points(body), body, person)


def test_exchanged_arms_are_found_and_named_right_again(
    body: BodyModel, person: BodyParameters
) -> None:
    lifted = lift_truth(body, person)
    wrong = lifted.with_sides_exchanged(ARMS)
    misnamed = misnamed_joints(points(body, person), wrong)
    np.testing.assert_array_equal(misnamed, ARMS)
    np.testing.assert_array_equal(
        wrong.with_sides_exchanged(misnamed).positions_camera, lifted.positions_camera)


def test_keypoints_of_the_body_itself_keep_their_sides(
    body: BodyModel, person: BodyParameters
) -> None:
    lifted = lift_truth(body, person)
    assert not misnamed_joints(points(body, person), lifted).any()
    # Nor does a body somewhere else make left right.
    elsewhere = person.replaced(transl=person.transl + [0.2, 0.0, 0.0])
    assert not misnamed_joints(points(body, elsewhere), lifted).any()


def test_one_wrong_wrist_exchanges_nothing(body: BodyModel, person: BodyParameters) -> None:
    lifted = lift_truth(body, person)
    places = lifted.positions_camera.copy()
    places[SHARED_NAMES.index('left_wrist')] = places[SHARED_NAMES.index('right_wrist')]
    lifted.positions_camera[:] = places
    assert not misnamed_joints(points(body, person), lifted).any()


def test_joints_that_are_left_out_say_nothing_and_others_what_they_said(
    body: BodyModel, person: BodyParameters
) -> None:
    lifted = lift_truth(body, person, hidden=(HEAD,))
    pixels = lifted.keypoints_px.copy()
    pixels[HEAD] = CAMERA.project(points(body, person))[HEAD]
    guessed = replace(lifted, keypoints_px=pixels, scores=np.full(15, 0.5))
    nobody = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
    seen = observe(photograph(body, person), guessed, nobody)
    np.testing.assert_array_equal(seen.keypoint_rays.joint, [HEAD])
    rest = without_joints(seen, ARMS)
    np.testing.assert_array_equal(rest.lifted.lifted, seen.lifted.lifted & ~ARMS)
    np.testing.assert_array_equal(rest.keypoint_rays.joint, [HEAD])
    assert len(without_joints(seen, ~ARMS).keypoint_rays.score) == 0
