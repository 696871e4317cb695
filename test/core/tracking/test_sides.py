"""Left and right of keypoints: exchanged ones are taken for what they are, all others left."""

import numpy as np
import pytest
from support.one_person import lift_truth
from support.stage import Scripted, Stage, only

from pop_core.body.joints import SHARED_MIRROR, SHARED_NAMES
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.keypoints.detection import Detection
from pop_core.tracking.sides import misnamed_joints, renamed

ARMS = np.array([name.endswith(('shoulder', 'elbow', 'wrist')) for name in SHARED_NAMES])


def points(body: BodyModel, person: BodyParameters) -> np.ndarray:
    return attached_positions(shared_points(body), body, person)


def test_exchanged_arms_are_found_and_named_right_again(
    body: BodyModel, person: BodyParameters
) -> None:
    lifted = lift_truth(body, person)
    wrong = renamed(lifted, ARMS)
    misnamed = misnamed_joints(points(body, person), wrong)
    np.testing.assert_array_equal(misnamed, ARMS)
    np.testing.assert_array_equal(
        renamed(wrong, misnamed).positions_camera, lifted.positions_camera)


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


def test_a_detector_that_takes_left_for_right_for_a_moment_turns_nobody_round(
    body: BodyModel, person: BodyParameters, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = Stage(body)
    stage.show(person, times=10)
    detection = Scripted.detection

    def exchanged(self: Scripted, *args: object) -> Detection:
        found = detection(self, *args)
        return Detection(
            found.keypoints_px[SHARED_MIRROR], found.scores[SHARED_MIRROR], found.box_px)

    with monkeypatch.context() as confused:
        confused.setattr(Scripted, 'detection', exchanged)
        found = only(stage.show(person, times=8))
    off = np.linalg.norm(found.joints - joints(body, person), axis=1)
    assert off.max() < 0.1
