"""Pairs of measured points and vertices: at the true body, nothing pulls it in or out."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, WALL_M, lift_truth

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.depth_noise import BASE_M, DepthNoise
from pop_core.fitting.body_state import CLOTH_M, HAIR_M, BodyState, FitBody
from pop_core.fitting.correspondence import (
    NEAR_PARTS,
    match_points,
    match_vertices,
    nearest_as_sensors_err,
    tangential_pairs,
    thin_points,
)
from pop_core.fitting.depth_consistency import see_body
from pop_core.fitting.levenberg_marquardt import assemble
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.residuals import Pairs, join_pairs, no_pairs, pair_residual
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rgbd import RgbdFrame

TRUNK = [JOINT_INDEX[name] for name in ('pelvis', 'spine1', 'spine2', 'spine3')]
SCALE_M = 0.03


@pytest.fixture(scope='module')
def state(body: BodyModel, person: BodyParameters) -> BodyState:
    return FitBody(body, full=True).state(person)


def seen_with_noise(state: BodyState, sigma_m: float) -> Observation:
    """The person as clothed as the fit expects, before a wall, with noise along the rays."""
    body = state.body
    depth_m = np.minimum(render_depth(state.clothed, body.faces, CAMERA).depth_m, WALL_M)
    noise = sigma_m * np.random.default_rng(1).normal(size=depth_m.shape)
    frame = RgbdFrame(
        np.zeros((*depth_m.shape, 3), dtype=np.uint8), depth_m + noise.astype(np.float32), CAMERA)
    per_m = max(sigma_m - BASE_M, 0.0) / state.parameters.transl[2] ** 2
    lifted = lift_truth(body.model, state.parameters)
    return observe(
        frame, lifted, np.zeros(depth_m.shape, dtype=bool), noise=DepthNoise(per_m))


def trunk_pairs(state: BodyState, sigma_m: float) -> Pairs:
    """Pairs of the trunk's points at the true body."""
    observation = seen_with_noise(state, sigma_m)
    visibility = see_body(state, observation)
    of_trunk = np.isin(state.body.main_bone[state.body.faces[:, 0]], TRUNK)
    segment = visibility.rendered.covered & of_trunk[visibility.rendered.face]
    points, parts = thin_points(observation, segment, 5000)
    return match_points(state, visibility, points, parts, SCALE_M, observation.noise)


def mean_pull_m(pairs: Pairs, state: BodyState, chosen: np.ndarray) -> float:
    """How far the chosen pairs pull their vertices outward, on the mean [m]."""
    off = pairs.target[chosen] - state.vertices[pairs.vertex[chosen]]
    pull = np.einsum('nc,nc->n', off, pairs.direction[chosen])
    return float(np.average(pull, weights=pairs.weight[chosen]))


@pytest.mark.parametrize('sigma_m', [0.0, 0.015, 0.03])
def test_noise_along_the_rays_makes_nobody_thinner(state: BodyState, sigma_m: float) -> None:
    pairs = trunk_pairs(state, sigma_m)
    ray = pairs.target / np.linalg.norm(pairs.target, axis=1, keepdims=True)
    facing = -np.einsum('nc,nc->n', pairs.direction, ray)
    # Plain distance pulls the sides in by 1.6 mm here, a kernel about the skin all by 1.4 to 2.9.
    for chosen in (facing > 0.7, (facing > 0.3) & (facing <= 0.7)):
        assert abs(mean_pull_m(pairs, state, chosen)) < 0.0012


def test_a_point_belongs_to_the_surface_its_ray_meets() -> None:
    surface = np.array([[0.0, 0.0, 2.0], [0.3, 0.0, 2.2]])
    behind = 1.12 * surface[:1]  # noise has put the point nearer to the other vertex
    points = np.concatenate([behind, surface[1:]])
    assert nearest_as_sensors_err(surface, points, SCALE_M, DepthNoise(0.03)).tolist() == [0, 1]


def test_without_noise_nearest_is_nearest() -> None:
    rng = np.random.default_rng(2)
    surface = rng.uniform([-0.1, -0.1, 2.0], [0.1, 0.1, 2.1], (300, 3))
    points = surface[::3] + 0.002 * rng.normal(size=(100, 3))
    nearest = nearest_as_sensors_err(surface, points, SCALE_M, DepthNoise(0.0))
    assert (nearest == np.arange(300)[::3]).mean() > 0.98  # a few lie between two


def test_vertices_behind_the_camera_take_no_points() -> None:
    surface = np.array([[0.0, 0.0, -0.5], [0.1, 0.0, 0.0], [0.1, 0.0, 1.0]])
    points = np.array([[0.0, 0.0, 1.0], [0.2, 0.1, 0.8]])
    assert nearest_as_sensors_err(surface, points, SCALE_M, DepthNoise()).tolist() == [2, 2]


def test_hands_and_faces_are_bare_and_crowns_have_hair(state: BodyState) -> None:
    depth_m = np.linalg.norm(state.clothed - state.vertices, axis=1)
    assert depth_m[state.body.main_bone == JOINT_INDEX['left_hand']].max() == 0.0
    assert depth_m[state.body.model.nose_vertex] == 0.0
    assert depth_m[state.vertices[:, 1].argmin()] == pytest.approx(HAIR_M)  # y points down
    chest = state.body.main_bone == JOINT_INDEX['spine3']
    np.testing.assert_allclose(depth_m[chest], CLOTH_M, atol=1e-12)


def test_vertices_are_not_drawn_to_points_of_another_part(state: BodyState) -> None:
    """Where the detector calls an arm's pixels a leg, the arm's vertices take no point there."""
    observation = seen_with_noise(state, 0.0)
    visibility = see_body(state, observation)
    labels = np.full(observation.depth_m.shape, JOINT_INDEX['left_knee'])
    named = match_vertices(state, visibility, replace(observation, labels=labels), SCALE_M)
    legs = NEAR_PARTS[JOINT_INDEX['left_knee'], state.body.main_bone[named.vertex]]
    assert 0 < legs.sum() < len(legs)
    unnamed = match_vertices(state, visibility, observation, SCALE_M)
    assert (unnamed.weight[~legs] > 0).any()
    np.testing.assert_array_equal(named.weight, unnamed.weight * legs)


def test_point_to_point_pulls_along_every_axis_with_a_third_of_the_points(
    state: BodyState
) -> None:
    rng = np.random.default_rng(6)
    vertex = rng.integers(0, 50, 300)
    weight = np.where(vertex == vertex[0], 0.0, rng.uniform(0.0, 100.0, 300))
    pairs = Pairs(vertex, state.normals[vertex], rng.normal(size=(300, 3)), weight)
    every = join_pairs([
        Pairs(vertex[::3], np.tile(axis, (100, 1)), pairs.target[::3], 3.0 * 0.2 * weight[::3])
        for axis in np.eye(3)])
    merged, spread = tangential_pairs(pairs, 0.2)
    assert len(merged.vertex) == 3 * (len(np.unique(vertex[::3])) - 1)  # of some, without weight
    many, few = (assemble([pair_residual(state, p, jacobian=True)], state.body.size)
                 for p in (every, merged))
    np.testing.assert_allclose(few.gradient, many.gradient, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(few.hessian, many.hessian, rtol=1e-9, atol=1e-6)
    assert few.cost + spread == pytest.approx(many.cost, rel=1e-9)
    assert tangential_pairs(no_pairs(), 0.2)[1] == 0.0
