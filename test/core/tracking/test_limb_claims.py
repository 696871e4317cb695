"""Points that the trunk explains say nothing of an arm; points of its own do."""

import numpy as np
import pytest
from jaxtyping import Float
from support.one_person import lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX, N_SHARED, SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.depth_consistency import see_body
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.residuals import Pairs
from pop_core.tracking.limb_claims import LIMB_OF_BONE, LimbClaims, limbs_of, open_shares
from pop_core.tracking.limbs import limbs_in_the_open

LEFT_ARM, RIGHT_ARM, LEFT_LEG = 0, 1, 2
N_POINTS = 60


@pytest.fixture(scope='module')
def state(body: BodyModel, person: BodyParameters) -> BodyState:
    return FitBody(body, full=False).state(person)


@pytest.fixture(scope='module')
def observation(body: BodyModel, person: BodyParameters) -> Observation:
    frame = photograph(body, person)
    return observe(frame, lift_truth(body, person), np.zeros(frame.depth_m.shape, dtype=bool))


def measured_near(observation: Observation, p_camera: np.ndarray) -> Float[np.ndarray, 'n 3']:
    """Return the points measured nearest to the pixel of a point."""
    points = observation.points(np.isfinite(observation.depth_m))
    uv, centre = observation.camera.project(points), observation.camera.project(p_camera[None])
    return points[np.argsort(np.linalg.norm(uv - centre, axis=1))[:N_POINTS]]


def pairs_of(state: BodyState, limb: int, points: Float[np.ndarray, 'n 3']) -> Pairs:
    vertices = np.flatnonzero(LIMB_OF_BONE[state.body.main_bone] == limb)
    n = len(points)
    return Pairs(
        np.resize(vertices, n), np.tile([0.0, 0.0, -1.0], (n, 1)), points, np.ones(n))


def claims_of(
    state: BodyState, observation: Observation, **doubt_m: float
) -> LimbClaims:
    doubts = np.full(N_SHARED, 0.1)
    for name, value in doubt_m.items():
        doubts[SHARED_INDEX[name]] = value
    return LimbClaims(state, observation, doubts)


def test_an_arm_claims_no_point_of_the_trunk(state: BodyState, observation: Observation):
    belly = measured_near(observation, state.joints[JOINT_INDEX['spine2']])
    weighed, of_limb = claims_of(state, observation).weighed(pairs_of(state, LEFT_ARM, belly))
    assert not weighed.weight.any()
    assert not of_limb.any()


def test_an_arm_before_the_trunk_keeps_its_points(state: BodyState, observation: Observation):
    belly = measured_near(observation, state.joints[JOINT_INDEX['spine2']])
    before = 0.9 * belly  # a quarter of a metre nearer
    weighed, of_limb = claims_of(state, observation).weighed(pairs_of(state, LEFT_ARM, before))
    np.testing.assert_allclose(weighed.weight, 1.0, atol=1e-3)
    assert of_limb[LEFT_ARM] == pytest.approx(N_POINTS, rel=1e-3)


def test_a_few_points_are_no_arm(state: BodyState, observation: Observation):
    belly = measured_near(observation, state.joints[JOINT_INDEX['spine2']])
    few = pairs_of(state, LEFT_ARM, 0.9 * belly[:8])
    assert not claims_of(state, observation).weighed(few)[0].weight.any()
    # Legs are never taken for hidden: they hide each other at every step.
    few = pairs_of(state, LEFT_LEG, 0.9 * belly[:8])
    np.testing.assert_allclose(
        claims_of(state, observation).weighed(few)[0].weight, 1.0, atol=1e-3)


def test_of_two_arms_the_surer_one_owns_the_points(state: BodyState, observation: Observation):
    forearm = state.joints[[JOINT_INDEX['right_elbow'], JOINT_INDEX['right_wrist']]].mean(axis=0)
    points = measured_near(observation, forearm)[:30]
    stranger = pairs_of(state, LEFT_ARM, points)
    owned = claims_of(state, observation, right_wrist=0.01)
    assert not owned.weighed(stranger)[0].weight.any()
    free = claims_of(state, observation, left_wrist=0.01)
    np.testing.assert_allclose(free.weighed(stranger)[0].weight, 1.0, atol=0.05)


def test_the_trunk_claims_whatever_it_likes(state: BodyState, observation: Observation):
    belly = measured_near(observation, state.joints[JOINT_INDEX['spine2']])
    trunk = pairs_of(state, -1, belly)
    np.testing.assert_array_equal(
        claims_of(state, observation).weighed(trunk)[0].weight, trunk.weight)


def test_no_pairs_are_no_claims(state: BodyState, observation: Observation):
    weighed, of_limb = claims_of(state, observation).weighed(
        pairs_of(state, LEFT_ARM, np.zeros((0, 3))))
    assert len(weighed.weight) == 0
    assert not of_limb.any()


def test_joints_belong_to_limbs_and_those_of_the_trunk_to_none():
    bones = np.zeros(24, dtype=bool)
    bones[[JOINT_INDEX['left_collar'], JOINT_INDEX['spine1']]] = True
    assert limbs_of(bones).tolist() == []
    bones[[JOINT_INDEX['right_wrist'], JOINT_INDEX['left_knee']]] = True
    assert limbs_of(bones).tolist() == [RIGHT_ARM, LEFT_LEG]


def test_a_limb_where_the_camera_sees_the_wall_stands_in_the_open(
    body: BodyModel, person: BodyParameters, state: BodyState, observation: Observation
):
    assert limbs_in_the_open(open_shares(state, see_body(state, observation), observation)) == []
    stretched = person.body_pose.copy()
    stretched[JOINT_INDEX['right_shoulder'] - 1] = 0.0  # away from the trunk, as in the T-pose
    elsewhere = FitBody(body, full=False).state(person.replaced(body_pose=stretched))
    share = open_shares(elsewhere, see_body(elsewhere, observation), observation)
    assert share[RIGHT_ARM] > 0.5
    (arm,) = limbs_in_the_open(share)
    np.testing.assert_array_equal(limbs_of(arm), [RIGHT_ARM])
