"""Landmarks lie where a person's face and feet have them."""

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.landmarks import LANDMARK_JOINTS, LANDMARK_NAMES, landmark_vertices
from pop_core.body.model import BodyModel


def places() -> dict[str, np.ndarray]:
    model = default_body()
    return dict(zip(LANDMARK_NAMES, model.v_template[landmark_vertices(model)], strict=True))


def test_left_and_right_are_mirror_images() -> None:
    at = places()
    for name in LANDMARK_NAMES:
        if name.startswith('left_'):
            # Vertices of the default body are symmetric to a millimetre.
            mirrored = at[f'right_{name[5:]}'] * [-1, 1, 1]
            np.testing.assert_allclose(at[name], mirrored, atol=2e-3, err_msg=name)
            assert at[name][0] > 0.02


def test_eyes_stand_above_and_behind_the_nose_and_ears_behind_the_eyes() -> None:
    at = places()
    assert 0.045 < at['left_eye'][0] - at['right_eye'][0] < 0.075
    assert 0.02 < at['left_eye'][1] - at['nose'][1] < 0.04
    assert at['nose'][2] > at['left_eye'][2] > at['left_ear'][2] + 0.05
    assert 0.13 < at['left_ear'][0] - at['right_ear'][0] < 0.19


def test_a_foot_reaches_from_heel_to_toe_below_the_ankle() -> None:
    at, model = places(), default_body()
    ankle = model.joint_template[JOINT_INDEX['left_ankle']]
    length_m = at['left_big_toe'][2] - at['left_heel'][2]
    assert 0.2 < length_m < 0.3
    assert at['left_heel'][2] < ankle[2] < at['left_big_toe'][2]
    assert max(at['left_heel'][1], at['left_big_toe'][1]) < ankle[1]


def test_each_landmark_lies_within_a_hand_of_the_joint_that_vouches_for_it() -> None:
    model = default_body()
    away_m = np.linalg.norm(
        np.array(list(places().values())) - model.joint_template[LANDMARK_JOINTS], axis=1)
    assert away_m.max() < 0.15


def test_a_body_without_face_and_feet_still_has_its_points(random_model: BodyModel) -> None:
    found = landmark_vertices(random_model)
    assert found.shape == (len(LANDMARK_NAMES),)
    assert np.all((found >= 0) & (found < len(random_model.v_template)))
