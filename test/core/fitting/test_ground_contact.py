from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.ground_contact import ground_pairs, measured_feet
from pop_core.fitting.observation import observe
from pop_core.segmentation.ground import Ground

ANKLES = (SHARED_INDEX['left_ankle'], SHARED_INDEX['right_ankle'])
UP = np.array([0.0, -1.0, 0.0])
NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)


@pytest.fixture
def standing(body: BodyModel, person: BodyParameters) -> BodyState:
    return FitBody(body, full=False).state(person)


def floor_under(state: BodyState, gap_m: float) -> Ground:
    """A floor that lies `gap_m` below the lowest vertex (above it, when negative)."""
    lowest = (state.vertices @ UP).min()
    return Ground(UP, float(gap_m - lowest))


def test_someone_on_the_floor_is_left_alone(
    standing: BodyState, body: BodyModel, person: BodyParameters
) -> None:
    pairs = ground_pairs(standing, floor_under(standing, 0.0), lift_truth(body, person))
    assert len(pairs.vertex) == 0


def test_someone_below_the_floor_is_lifted(
    standing: BodyState, body: BodyModel, person: BodyParameters
) -> None:
    ground = floor_under(standing, -0.1)
    pairs = ground_pairs(standing, ground, lift_truth(body, person))
    below = ground.height(standing.vertices) < -0.02
    np.testing.assert_array_equal(np.sort(pairs.vertex), np.flatnonzero(below))
    np.testing.assert_allclose(ground.height(pairs.target), 0.0, atol=1e-12)


def test_unseen_feet_are_drawn_down_and_seen_ones_are_not(
    standing: BodyState, body: BodyModel, person: BodyParameters
) -> None:
    ground = floor_under(standing, 0.15)
    hidden = ground_pairs(standing, ground, lift_truth(body, person, ANKLES))
    assert set(hidden.vertex) == set(np.concatenate(standing.body.soles))
    assert len(ground_pairs(standing, ground, lift_truth(body, person)).vertex) == 0


def test_a_foot_under_surface_that_stands_clear_stays_in_the_air(
    standing: BodyState, body: BodyModel, person: BodyParameters
) -> None:
    """Its keypoint was missed, yet the camera sees where it is."""
    lifted = lift_truth(body, person, ANKLES)
    observation = observe(photograph(body, person), lifted, NOBODY)
    assert not measured_feet(standing, observation).any()
    u, _ = observation.depth_at(standing.landmarks[list(ANKLES)])[1].T
    middle = int(u.sum()) // 2
    left = (np.arange(observation.own.shape[1]) > middle) == (u[0] > middle)
    clear = replace(observation, standing_clear=np.tile(left, (len(observation.own), 1)))
    measured = measured_feet(standing, clear)
    np.testing.assert_array_equal(measured, [True, False])
    pairs = ground_pairs(standing, floor_under(standing, 0.15), lifted, measured=measured)
    assert set(pairs.vertex) == set(standing.body.soles[1])


def test_a_foot_before_or_behind_what_was_measured_is_not_seen(
    standing: BodyState, body: BodyModel, person: BodyParameters
) -> None:
    observation = observe(photograph(body, person), lift_truth(body, person), NOBODY)
    clear = replace(observation, standing_clear=np.ones_like(observation.own))
    assert measured_feet(standing, clear).all()
    for away_m in (-0.3, 0.3):
        moved = person.replaced(transl=person.transl * (1.0 + away_m / person.transl[2]))
        assert not measured_feet(standing.body.state(moved), clear).any()


def test_nobody_who_lies_down_is_stood_up(body: BodyModel, person: BodyParameters) -> None:
    lying = person.replaced(global_orient=np.array([np.pi / 2, 0.0, 0.0]))
    state = FitBody(body, full=False).state(lying)
    pairs = ground_pairs(state, floor_under(state, 0.15), lift_truth(body, lying, ANKLES))
    assert pairs.weight.sum() == 0
