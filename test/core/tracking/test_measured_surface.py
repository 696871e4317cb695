"""What forbids a place adds no knowledge of where a body is; what was measured does."""

import numpy as np
import pytest
from support.one_person import lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX, N_SHARED
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.depth_consistency import HidingPlaces, see_body
from pop_core.fitting.energy import TermWeights
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.observation import Observation, observe
from pop_core.retrieval.pose_prior import load_pose_prior
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.limb_claims import LimbClaims
from pop_core.tracking.measured_surface import SurfaceTerms, surface_terms
from pop_core.tracking.tracked_energy import Prediction, TrackedEnergy


@pytest.fixture(scope='module')
def state(body: BodyModel, person: BodyParameters) -> BodyState:
    return FitBody(body, full=False).state(person)


def terms_of(
    body: BodyModel, state: BodyState, *people: BodyParameters
) -> tuple[SurfaceTerms, Observation]:
    frame = photograph(body, *people)
    lifted = lift_truth(body, state.parameters)
    observation = observe(frame, lifted, np.zeros(frame.depth_m.shape, dtype=bool))
    visibility = see_body(state, observation)
    segment = visibility.rendered.covered & (observation.depth_m < 3.5)
    places = HidingPlaces(observation, segment, state.vertices[:, 2])
    claims = LimbClaims(state, observation, np.full(N_SHARED, 0.1))
    return surface_terms(
        state, observation, visibility, segment, places=places, claims=claims, scale_m=0.05,
        config=FittingConfig()), observation


def knowledge(state: BodyState, terms: SurfaceTerms, observation: Observation) -> np.ndarray:
    belief = first_state(state.parameters, np.eye(state.body.size))
    energy = TrackedEnergy(
        state, observation, load_pose_prior(), TermWeights(joints=0.0, neighbours=0.0), terms,
        Prediction(belief, state))
    return energy.curvature(state)[0].data


def test_free_space_moves_a_body_but_tells_nothing_of_its_place(
    body: BodyModel, state: BodyState, person: BodyParameters
):
    somebody_to_hide_behind = person.replaced(transl=person.transl + [1.0, 0.0, -0.4])
    terms, observation = terms_of(body, state, somebody_to_hide_behind)
    assert terms.n_measured == 0
    assert terms.pairs.weight.any()
    assert not knowledge(state, terms, observation).any()


def test_a_measured_surface_tells_where_a_body_is(
    body: BodyModel, state: BodyState, person: BodyParameters
):
    terms, observation = terms_of(body, state, person)
    assert terms.n_measured > 100
    along_the_ray = 2
    assert knowledge(state, terms, observation)[along_the_ray, along_the_ray] > 1e4


def test_terms_without_a_limb_lack_its_pairs_alone(
    body: BodyModel, state: BodyState, person: BodyParameters
):
    terms, _ = terms_of(body, state, person)
    arm = np.zeros(24, dtype=bool)
    arm[[JOINT_INDEX['left_elbow'], JOINT_INDEX['left_wrist']]] = True
    of_arm = arm[state.body.main_bone[terms.pairs.vertex]]
    rest = terms.without(arm, state)
    assert of_arm[: terms.n_measured].any()
    np.testing.assert_array_equal(rest.pairs.weight, terms.pairs.weight[~of_arm])
    assert rest.n_measured == (~of_arm[: terms.n_measured]).sum()
