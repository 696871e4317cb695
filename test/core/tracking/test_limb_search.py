"""A lost limb is found at its keypoints, and nothing else of the body moves."""

import numpy as np
import pytest
from support.one_person import lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.depth_consistency import see_body
from pop_core.fitting.observation import observe
from pop_core.retrieval.pose_prior import load_pose_prior
from pop_core.tracking.limb_claims import open_shares
from pop_core.tracking.limb_search import LimbSearch
from pop_core.tracking.limbs import limbs_in_the_open, lost_limbs


@pytest.mark.parametrize('turn', [[0.0, -1.4, -0.3], [0.6, 0.9, -0.9], [0.0, 0.0, 0.4]])
def test_an_arm_is_found_wherever_its_keypoints_are(
    body: BodyModel, person: BodyParameters, turn: list[float]
):
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1] = turn
    truth = person.replaced(body_pose=pose)
    frame = photograph(body, truth)
    lifted = lift_truth(body, truth, sigma_m=0.02)
    observation = observe(frame, lifted, np.zeros(frame.depth_m.shape, dtype=bool))
    ends = [SHARED_INDEX['left_elbow'], SHARED_INDEX['left_wrist']]
    contradicted = np.zeros(15, dtype=bool)
    contradicted[ends] = True
    (loose,) = lost_limbs(contradicted)
    coarse = FitBody(body, full=False)
    search = LimbSearch(load_pose_prior())
    found = search.find(coarse.state(person), observation, loose)
    off = np.linalg.norm(
        coarse.state(found).landmarks - coarse.state(truth).landmarks, axis=1)
    was_off = np.linalg.norm(
        coarse.state(person).landmarks - coarse.state(truth).landmarks, axis=1)
    assert was_off[ends].max() > 0.25
    assert off[ends].max() < 0.08  # keypoints err by 1 cm, and the prior pulls
    fixed = ~loose
    np.testing.assert_allclose(found.transl, person.transl)
    np.testing.assert_allclose(found.betas, person.betas)
    np.testing.assert_allclose(found.body_pose[fixed[1:]], person.body_pose[fixed[1:]], atol=1e-9)


def test_an_arm_without_keypoints_is_looked_for_where_nothing_contradicts_it(
    body: BodyModel, person: BodyParameters
):
    frame = photograph(body, person)
    arm = [SHARED_INDEX['right_elbow'], SHARED_INDEX['right_wrist']]
    lifted = lift_truth(body, person, hidden=tuple(arm))
    observation = observe(frame, lifted, np.zeros(frame.depth_m.shape, dtype=bool))
    stretched = person.body_pose.copy()
    stretched[JOINT_INDEX['right_shoulder'] - 1] = 0.0
    coarse = FitBody(body, full=False)
    wrong = coarse.state(person.replaced(body_pose=stretched))
    (loose,) = limbs_in_the_open(open_shares(wrong, see_body(wrong, observation), observation))
    found = coarse.state(LimbSearch(load_pose_prior()).find(wrong, observation, loose))
    before, after = (
        open_shares(state, see_body(state, observation), observation).max()
        for state in (wrong, found))
    assert after < 0.8 * before
