"""Who is who: distance, pixels and size decide together, and nobody is taken twice."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth

from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.tracking.association import (
    Expected,
    associate,
    behind_others,
    log_size,
    offset_m,
)

GATE_M = 0.35
NOWHERE = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)


def shifted(person: BodyParameters, x_m: float) -> BodyParameters:
    return person.replaced(transl=person.transl + [x_m, 0.0, 0.0])


def expected(
    body: BodyModel, person: BodyParameters, x_m: float, doubt_m: float = 0.01,
    mask: np.ndarray = NOWHERE,
) -> Expected:
    points = attached_positions(shared_points(body), body, shifted(person, x_m))
    return Expected(points, doubt_m, mask)


def seen(body: BodyModel, person: BodyParameters, x_m: float) -> tuple[Detection, LiftedJoints]:
    lifted = lift_truth(body, shifted(person, x_m))
    return Detection(lifted.keypoints_px, lifted.scores, np.zeros(4)), lifted


def own_pixels(found: tuple[Detection, LiftedJoints]) -> np.ndarray:
    """Return the mask of somebody who is seen at the keypoints of a detection."""
    u, v = np.rint(found[0].keypoints_px).astype(int).T
    out = NOWHERE.copy()
    out[v, u] = True
    return out


def matches(people: list[Expected], found: list[tuple[Detection, LiftedJoints]]) -> dict[int, int]:
    return associate(people, [d for d, _ in found], [j for _, j in found], GATE_M)


def test_everybody_gets_the_nearest_of_all_assignments(
    body: BodyModel, person: BodyParameters
) -> None:
    people = [expected(body, person, 0.0), expected(body, person, 0.3)]
    # The second detection is nearer to both people; together they still share out right.
    found = [seen(body, person, -0.2), seen(body, person, 0.1)]
    assert matches(people, found) == {0: 0, 1: 1}


def test_nobody_is_matched_beyond_the_gate(body: BodyModel, person: BodyParameters) -> None:
    assert matches([expected(body, person, 0.0)], [seen(body, person, 0.6)]) == {}


def test_doubt_of_a_prediction_widens_the_gate(body: BodyModel, person: BodyParameters) -> None:
    hidden = [expected(body, person, 0.0, doubt_m=0.3)]
    assert matches(hidden, [seen(body, person, 0.6)]) == {0: 0}


def test_of_two_people_in_one_place_pixels_decide(
    body: BodyModel, person: BodyParameters
) -> None:
    found = seen(body, person, 0.0)
    own = own_pixels(found)
    people = [expected(body, person, 0.03), expected(body, person, 0.05, mask=own)]
    assert matches(people, [found]) == {1: 0}


def test_of_two_people_in_one_place_size_decides(
    body: BodyModel, person: BodyParameters
) -> None:
    found = seen(body, person, 0.0)
    here = expected(body, person, 0.05)
    middle = here.points.mean(axis=0)
    child = Expected(middle + 0.6 * (here.points - middle), 0.01, NOWHERE)
    assert matches([child, here], [found]) == {1: 0}


def test_size_is_that_of_the_bones(body: BodyModel, person: BodyParameters) -> None:
    lifted = lift_truth(body, person, sigma_m=0.0)
    points = expected(body, person, 0.0).points
    assert log_size(lifted, points / 1.2) == pytest.approx(np.log(1.2), abs=1e-6)


def test_without_detections_nobody_is_matched(body: BodyModel, person: BodyParameters) -> None:
    assert matches([expected(body, person, 0.0)], []) == {}
    assert matches([], [seen(body, person, 0.0)]) == {}


def test_who_is_lifted_onto_somebody_nearer_keeps_the_number(
    body: BodyModel, person: BodyParameters
) -> None:
    found, lifted = seen(body, person, 0.0)
    nearer = replace(lifted, positions_camera=0.7 * lifted.positions_camera)
    front = own_pixels((found, lifted))
    hidden = expected(body, person, 0.0)
    in_front = Expected(0.7 * expected(body, person, 0.0).points, 0.01, front)
    assert matches([hidden], [(found, nearer)]) == {}
    assert associate(
        behind_others([hidden, in_front]), [found, found],
        [nearer, replace(nearer, positions_camera=0.69 * lifted.positions_camera)],
        GATE_M).keys() == {0, 1}


def test_nobody_takes_the_detection_of_another_to_leave_none_over(
    body: BodyModel, person: BodyParameters
) -> None:
    people = [expected(body, person, x, doubt_m=0.3) for x in (0.0, 0.9)]
    # The second detection lies between them; the first is exactly the first person's.
    found = [seen(body, person, 0.0), seen(body, person, -0.8)]
    assert matches(people, found) == {0: 0}


def test_who_is_seen_the_other_way_round_is_the_same_person(
    body: BodyModel, person: BodyParameters
) -> None:
    found, lifted = seen(body, person, 0.0)
    assert offset_m(expected(body, person, 0.0), lifted.with_sides_exchanged()) < 0.05
    assert matches(
        [expected(body, person, 0.0)], [(found, lifted.with_sides_exchanged())]) == {0: 0}


@pytest.mark.parametrize(('x_m', 'as_stranger', 'on_own_pixels'), [
    (0.32, {0: 0}, {0: 0}), (0.45, {}, {0: 0}), (0.55, {}, {})])
def test_who_is_seen_on_the_pixels_of_a_person_is_matched_from_farther_off(
    body: BodyModel, person: BodyParameters, x_m: float, as_stranger: dict[int, int],
    on_own_pixels: dict[int, int],
) -> None:
    found = seen(body, person, x_m)
    assert matches([expected(body, person, 0.0)], [found]) == as_stranger
    own = own_pixels(found)
    assert matches([expected(body, person, 0.0, mask=own)], [found]) == on_own_pixels
