import numpy as np
import pytest
from support.one_person import lift_truth

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.ground_contact import ground_pairs
from pop_core.segmentation.ground import Ground

ANKLES = (SHARED_INDEX['left_ankle'], SHARED_INDEX['right_ankle'])
UP = np.array([0.0, -1.0, 0.0])


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


def test_nobody_who_lies_down_is_stood_up(body: BodyModel, person: BodyParameters) -> None:
    lying = person.replaced(global_orient=np.array([np.pi / 2, 0.0, 0.0]))
    state = FitBody(body, full=False).state(lying)
    pairs = ground_pairs(state, floor_under(state, 0.15), lift_truth(body, lying, ANKLES))
    assert pairs.weight.sum() == 0
