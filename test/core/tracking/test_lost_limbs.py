"""Keypoints that contradict a body name the limbs that are lost."""

import numpy as np
from support.one_person import lift_truth

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import FitBody
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.limbs import contradicted_joints, loosened, lost_limbs


def contradicted(*names: str) -> np.ndarray:
    out = np.zeros(15, dtype=bool)
    out[[SHARED_INDEX[name] for name in names]] = True
    return out


def test_a_body_agrees_with_its_own_keypoints(body: BodyModel, person: BodyParameters):
    state = FitBody(body, full=False).state(person)
    assert not contradicted_joints(state, lift_truth(body, person)).any()


def test_only_a_sure_keypoint_far_away_contradicts(body: BodyModel, person: BodyParameters):
    state, lifted = FitBody(body, full=False).state(person), lift_truth(body, person)
    far = lifted.positions_camera.copy()
    far[[SHARED_INDEX['left_wrist'], SHARED_INDEX['right_wrist']]] += [0.4, 0.0, 0.0]
    scores = lifted.scores.copy()
    scores[SHARED_INDEX['right_wrist']] = 0.3
    moved = LiftedJoints(far, lifted.sigma_m, lifted.state, lifted.keypoints_px, scores)
    np.testing.assert_array_equal(contradicted_joints(state, moved), contradicted('left_wrist'))


def test_lost_limbs_of_a_kind_are_named_together_and_the_trunk_never():
    assert lost_limbs(contradicted('neck', 'left_hip', 'right_shoulder')) == []
    legs, arm = lost_limbs(
        contradicted('left_elbow', 'left_wrist', 'left_knee', 'right_ankle'))
    assert np.flatnonzero(arm).tolist() == sorted(
        JOINT_INDEX[f'left_{part}'] for part in ('collar', 'shoulder', 'elbow', 'wrist'))
    assert np.flatnonzero(legs).tolist() == sorted(
        JOINT_INDEX[f'{side}_{part}']
        for side in ('left', 'right') for part in ('hip', 'knee', 'ankle'))


def test_a_loose_limb_may_turn_and_nothing_else(body: BodyModel, person: BodyParameters):
    belief = first_state(person, 1e4 * np.eye(FitBody(body, full=False).size))
    (arm,) = lost_limbs(contradicted('left_wrist'))
    grown = np.diag(loosened(belief, arm).covariance - belief.covariance) > 0
    turns = grown[3: 75].reshape(24, 3)
    np.testing.assert_array_equal(turns.all(axis=1), arm)
    assert grown.sum() == 3 * arm.sum()
