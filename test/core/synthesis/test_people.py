import numpy as np
import pytest

from pop_core.body.model import BodyParameters
from pop_core.body.skinning import vertices
from pop_core.geometry.rotation import from_rotvec
from pop_core.geometry.transform import invert_transform, make_transform, transform_points
from pop_core.synthesis.blocks import depth_inside
from pop_core.synthesis.clothes import draw_outfit, dressed
from pop_core.synthesis.people import TOLERANCE_M, actor_at, draw_actor, moved_parameters
from pop_core.synthesis.poses import POSE_KINDS


@pytest.fixture
def rng():
    return np.random.default_rng(12)


def test_moved_parameters_give_the_moved_mesh(model, rng):
    body = BodyParameters(rng.normal(size=3), rng.normal(size=3), rng.normal(0, 0.3, (23, 3)),
                          rng.normal(size=10), 0.8)
    T_a_b = make_transform(from_rotvec(rng.normal(size=3)), rng.normal(size=3))
    expected = transform_points(T_a_b, vertices(model, body))
    assert np.allclose(vertices(model, moved_parameters(model, body, T_a_b)), expected)
    back = moved_parameters(
        model, moved_parameters(model, body, T_a_b), invert_transform(T_a_b))
    assert np.allclose(back.transl, body.transl)


@pytest.mark.parametrize('kind', POSE_KINDS)
def test_people_rest_on_the_floor_or_on_what_carries_them(model, kind, rng):
    for _ in range(3):
        actor = draw_actor(model, kind, rng)
        low = actor.skin[:, 1].min()
        if actor.kind == 'lying' and actor.seat:
            top = max(block.base[1] + block.size_m[1] for block in actor.seat)
            assert abs(low - top) < TOLERANCE_M
        else:
            assert low == pytest.approx(0.0, abs=1e-9)


def test_nobody_lies_inside_the_seat(model, rng):
    seated = [draw_actor(model, 'seated', rng) for _ in range(6)]
    assert any(actor.seat for actor in seated)
    for actor in seated:
        for block in actor.seat:
            assert depth_inside(block, actor.skin).max() <= TOLERANCE_M


def test_who_sits_touches_the_seat(model, rng):
    actor = next(a for a in (draw_actor(model, 'seated', rng) for _ in range(10)) if a.seat)
    touching = max(depth_inside(block, actor.skin).max() for block in actor.seat)
    assert touching > 0.0


def test_an_actor_moved_in_the_room_keeps_mesh_and_parameters_together(model, rng):
    actor = actor_at(
        draw_actor(model, 'walking', rng, child=True), model, np.array([1.0, 0.0, -2.0]), 0.6)
    assert np.allclose(vertices(model, actor.parameters), actor.skin)
    assert 0.6 < actor.parameters.scale < 0.9


def test_clothes_lie_outside_the_skin_and_no_thicker_than_asked(model, rng):
    outfit = draw_outfit(model, rng, 0.04)
    assert outfit.displacement_m.min() >= 0.0
    assert 0.01 < outfit.displacement_m.max() <= 0.04
    skin = vertices(model, BodyParameters(
        np.zeros(3), np.zeros(3), np.zeros((23, 3)), np.zeros(10)))
    moved = np.linalg.norm(dressed(skin, model.f, outfit) - skin, axis=1)
    assert moved == pytest.approx(outfit.displacement_m)


def test_the_unclothed_wear_nothing(model, rng):
    actor = draw_actor(model, 'standing', rng, bare=True)
    assert np.array_equal(actor.surface, actor.skin)
