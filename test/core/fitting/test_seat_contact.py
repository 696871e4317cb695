"""Who sits on a measured seat rests on it; nothing else is taken for one."""

import numpy as np
import pytest
from support.one_person import CAMERA, WALL_M, lift_truth, photograph

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.seat_contact import SEATED_BONES, find_seat, seat_pairs
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.ground import Ground

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
UP = np.array([0.0, -1.0, 0.0])
FLOOR = Ground(UP, 1.0)  # the camera looks level, a metre above the floor
DOWN = 0.3  # the camera's pelvis lies this far below its axis [m]


@pytest.fixture
def sitter(person: BodyParameters) -> BodyParameters:
    """Thighs level, shins down, facing the camera."""
    pose = person.body_pose.copy()
    pose[[0, 1], 0] = -np.pi / 2
    pose[[3, 4], 0] = np.pi / 2
    return person.replaced(body_pose=pose, transl=np.array([0.0, DOWN, 2.5]))


@pytest.fixture
def prepared(body: BodyModel) -> FitBody:
    return FitBody(body, full=False)


def lowest_m(state: BodyState) -> float:
    """Height above the floor of what the person sits on."""
    seated = np.isin(state.body.main_bone, SEATED_BONES)
    return float(FLOOR.height(state.vertices[seated]).min())


def on_a_bench(body: BodyModel, person: BodyParameters, top_m: float) -> Observation:
    """A wide bench under the person, its top so far above the floor [m]."""
    frame = photograph(body, person)
    rays = CAMERA.ray_grid()
    with np.errstate(divide='ignore'):
        z = (1.0 - top_m) / rays[:, :, 1]
    bench = (rays[:, :, 1] > 0) & (z > 2.0) & (z < 3.0)
    depth = np.where(bench, np.minimum(z, frame.depth_m), frame.depth_m).astype(np.float32)
    return observe(RgbdFrame(frame.rgb, depth, CAMERA), lift_truth(body, person), NOBODY, FLOOR)


def seen_seat(
    body: BodyModel, state: BodyState, person: BodyParameters, top_m: float
) -> Ground | None:
    observation = on_a_bench(body, person, top_m)
    alone = observation.window.cut(photograph(body, person).depth_m)
    return find_seat(state, observation, alone < WALL_M)


def test_the_bench_under_a_sitter_is_their_seat(
    body: BodyModel, prepared: FitBody, sitter: BodyParameters
) -> None:
    state = prepared.state(sitter)
    seat = seen_seat(body, state, sitter, lowest_m(state))
    assert seat is not None
    assert FLOOR.offset_m - seat.offset_m == pytest.approx(lowest_m(state), abs=0.01)


def test_a_table_before_a_sitter_is_no_seat(
    body: BodyModel, prepared: FitBody, sitter: BodyParameters
) -> None:
    state = prepared.state(sitter)
    pelvis_m = float(FLOOR.height(state.joints[:1])[0])
    assert seen_seat(body, state, sitter, pelvis_m + 0.1) is None


def test_people_who_stand_have_no_seat(
    body: BodyModel, prepared: FitBody, sitter: BodyParameters, person: BodyParameters
) -> None:
    bench_m = lowest_m(prepared.state(sitter))
    standing = sitter.replaced(body_pose=person.body_pose)
    assert seen_seat(body, prepared.state(standing), standing, bench_m) is None


def test_a_wall_alone_is_no_seat(
    body: BodyModel, prepared: FitBody, sitter: BodyParameters
) -> None:
    frame = photograph(body, sitter)
    observation = observe(frame, lift_truth(body, sitter), NOBODY, FLOOR)
    segment = observation.depth_m < WALL_M
    assert find_seat(prepared.state(sitter), observation, segment) is None


def test_who_sinks_into_the_seat_is_lifted_onto_it(
    prepared: FitBody, sitter: BodyParameters
) -> None:
    state = prepared.state(sitter)
    seat = Ground(UP, FLOOR.offset_m - lowest_m(state) - 0.06)
    pairs = seat_pairs(state, seat)
    seated = np.isin(state.body.main_bone, SEATED_BONES)
    sunk = np.flatnonzero(seated & (seat.height(state.vertices) < -0.02))
    assert len(sunk) > 10
    assert set(sunk) <= set(pairs.vertex)
    assert seated[pairs.vertex].all()  # feet stand lower than any seat
    np.testing.assert_allclose(seat.height(pairs.target), 0.0, atol=1e-12)


def test_who_hovers_is_drawn_down_softly(prepared: FitBody, sitter: BodyParameters) -> None:
    state = prepared.state(sitter)
    hovering, sunk = (
        seat_pairs(state, Ground(UP, FLOOR.offset_m - lowest_m(state) + gap_m))
        for gap_m in (0.05, -0.05))
    assert (hovering.weight > 0).all()
    assert hovering.weight.sum() < 0.1 * sunk.weight.sum()


def test_all_of_somebody_who_lies_rests_on_the_bed(
    prepared: FitBody, sitter: BodyParameters, person: BodyParameters
) -> None:
    lying = prepared.state(sitter.replaced(
        body_pose=person.body_pose, global_orient=np.array([np.pi / 2, 0.0, 0.0])))
    height = FLOOR.height(lying.vertices)
    bed = Ground(UP, FLOOR.offset_m - float(np.median(height)))
    pairs = seat_pairs(lying, bed)
    assert {*np.flatnonzero(bed.height(lying.vertices) < -0.02)} <= set(pairs.vertex)
    assert not np.isin(lying.body.main_bone[pairs.vertex], SEATED_BONES).all()
