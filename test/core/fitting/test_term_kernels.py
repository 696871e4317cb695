"""Kernels of the energy's terms against slow twins in numpy."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth

from pop_core.body.joint_limits import LOWER, UPPER
from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import attached_places
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.ground_contact import (
    BELOW_SIGMA_M,
    BELOW_WEIGHT,
    CONTACT_SCALE_M,
    CONTACT_SIGMA_M,
    FOOT_WEIGHT,
    LIFTED_SHARE,
    TOLERANCE_M,
    ground_pairs,
    uprightness,
)
from pop_core.fitting.observation import keypoint_rays
from pop_core.fitting.priors import LIMIT_SIGMA_RAD, conditional_prior_term, limit_prior_term
from pop_core.fitting.residuals import (
    RAY_SCALE_M,
    Pairs,
    joint_residual,
    joint_weight,
    pair_residual,
    ray_residual,
    ray_weight,
)
from pop_core.fitting.robust_loss import Power, geman_mcclure_share, geman_mcclure_weight
from pop_core.fitting.self_collision import find_overlaps
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.segmentation.ground import Ground

WEIGH = {Power.COMPARED: geman_mcclure_share, Power.STEP: geman_mcclure_weight}
HIDDEN = (SHARED_INDEX['left_ankle'], SHARED_INDEX['right_ankle'], SHARED_INDEX['left_wrist'])


@pytest.fixture(scope='module')
def state(body: BodyModel, person: BodyParameters) -> BodyState:
    rng = np.random.default_rng(11)
    return FitBody(body, full=False).state(person.replaced(
        body_pose=person.body_pose + 0.3 * rng.normal(size=(23, 3)), scale=0.95))


@pytest.mark.parametrize('power', Power)
def test_joints_weigh_what_the_kernel_says(
    state: BodyState, body: BodyModel, person: BodyParameters, power: Power
) -> None:
    lifted = lift_truth(body, person, HIDDEN)
    distance = np.linalg.norm(state.landmarks - lifted.positions_camera, axis=1)
    expected = np.where(lifted.lifted, WEIGH[power](distance, 0.15) / lifted.sigma_m**2, 0.0)
    weight = joint_weight(state, lifted, 0.15, power)
    np.testing.assert_allclose(weight, expected, rtol=1e-12)
    block = joint_residual(state, lifted, weight, jacobian=False)
    assert len(block.r) == 3 * lifted.lifted.sum()
    expected_cost = 0.5 * np.nansum(weight * distance**2)
    assert block.cost == pytest.approx(expected_cost, rel=1e-12)


@pytest.mark.parametrize('power', Power)
def test_rays_weigh_what_the_kernel_says(
    state: BodyState, body: BodyModel, person: BodyParameters, power: Power
) -> None:
    lifted = lift_truth(body, person)
    blind = replace(
        lifted, positions_camera=np.full((15, 3), np.nan), sigma_m=np.full(15, np.inf))
    rays = keypoint_rays(blind, CAMERA)
    assert len(rays.joint) == 15
    points = state.landmarks[rays.joint]
    offset = np.einsum('nkc,nc->nk', rays.across, points)
    distance = np.linalg.norm(offset, axis=1)
    expected = np.zeros(15)
    expected[rays.joint] = (
        rays.score * WEIGH[power](distance, RAY_SCALE_M) / (rays.sigma * points[:, 2]) ** 2)
    weight = ray_weight(state, rays, power)
    np.testing.assert_allclose(weight, expected, rtol=1e-12)
    block = ray_residual(state, rays, weight, jacobian=False)
    np.testing.assert_allclose(block.r, offset.reshape(-1), rtol=1e-12)
    np.testing.assert_array_equal(block.w, np.repeat(weight[rays.joint], 2))


def test_pairs_measure_along_their_direction(state: BodyState) -> None:
    rng = np.random.default_rng(12)
    vertex = rng.integers(0, len(state.vertices), 60)
    pairs = Pairs(vertex, rng.normal(size=(60, 3)), rng.normal(size=(60, 3)), np.ones(60))
    expected = np.einsum('nc,nc->n', pairs.direction, state.vertices[vertex] - pairs.target)
    np.testing.assert_allclose(
        pair_residual(state, pairs, jacobian=False).r, expected, rtol=1e-12)


def test_turns_from_the_retrieved_pose_cost_their_square(
    state: BodyState, person: BodyParameters
) -> None:
    sigma = np.linspace(0.2, 0.9, 23)
    turn = to_rotvec(
        state.skeleton.R_local[1:] @ from_rotvec(person.body_pose).transpose(0, 2, 1))
    expected = 0.5 * 0.7 * np.sum((turn / sigma[:, None]) ** 2)
    term = conditional_prior_term(state, person.body_pose, sigma, 0.7, jacobian=False)
    assert term.cost == pytest.approx(expected, rel=1e-12)


def test_what_exceeds_limits_costs_its_square(state: BodyState) -> None:
    c = state.coordinates
    excess = np.maximum(c - UPPER, 0.0) + np.minimum(c - LOWER, 0.0)
    assert excess.any()
    expected = 0.5 * np.sum(excess**2) / LIMIT_SIGMA_RAD**2
    assert limit_prior_term(state, jacobian=False).cost == pytest.approx(expected, rel=1e-12)


def test_capsules_overlap_where_their_axes_are_nearer_than_their_radii(
    body: BodyModel, person: BodyParameters
) -> None:
    tangled = person.replaced(body_pose=1.5 * np.random.default_rng(4).normal(size=(23, 3)))
    state = FitBody(body, full=False).state(tangled)
    capsules = state.body.capsules
    start, end = (tangled.transl + tangled.scale * attached_places(
        capsules.ends, state.skeleton, tangled.betas)).reshape(2, -1, 3)
    radius = tangled.scale * (capsules.radius + capsules.radius_shapedirs @ tangled.betas)
    share = np.linspace(0.0, 1.0, 201)[:, None]
    found = find_overlaps(state)
    depths = {tuple(pair): depth for pair, depth in zip(found.pair, found.depth_m, strict=True)}
    assert len(depths) > 5
    for i, j in capsules.pairs:
        a, b = (start[k] + share * (end[k] - start[k]) for k in (i, j))
        apart = np.linalg.norm(a[:, None] - b, axis=2).min()
        # The grid on both axes is coarse: it finds them a little farther apart.
        assert depths.get((i, j), 0.0) == pytest.approx(
            max(radius[i] + radius[j] - apart, 0.0), abs=2e-3)
    for (i, j), (s, t), away in zip(found.pair, found.share, found.away, strict=True):
        first, second = start[i] + s * (end[i] - start[i]), start[j] + t * (end[j] - start[j])
        np.testing.assert_allclose(
            away * np.linalg.norm(first - second), first - second, atol=1e-9)


@pytest.mark.parametrize('power', Power)
@pytest.mark.parametrize('gap_m', [-0.1, 0.1])
def test_floors_pull_what_lies_below_and_soles_that_nobody_sees(
    state: BodyState, body: BodyModel, person: BodyParameters, power: Power, gap_m: float
) -> None:
    up = np.array([0.1, -1.0, 0.2])
    up /= np.linalg.norm(up)
    ground = Ground(up, float(gap_m - (state.vertices @ up).min()))
    lifted = lift_truth(body, person, HIDDEN[:1])
    height = ground.height(state.vertices)
    below = np.flatnonzero(height < -TOLERANCE_M)
    left, right = state.body.soles
    carries = 1.0 if height[left].mean() <= height[right].mean() else LIFTED_SHARE
    upright = min(max(2.0 * uprightness(state, ground) - 0.5, 0.0), 1.0)
    of_sole = FOOT_WEIGHT * upright * carries / CONTACT_SIGMA_M**2 / len(left)
    weight = np.concatenate([
        np.full(len(below), BELOW_WEIGHT / len(height) / BELOW_SIGMA_M**2),
        of_sole * WEIGH[power](height[left], CONTACT_SCALE_M)])
    pairs = ground_pairs(state, ground, lifted, power)
    np.testing.assert_array_equal(pairs.vertex, np.concatenate([below, left]))
    np.testing.assert_allclose(pairs.weight, weight, rtol=1e-9)
    np.testing.assert_allclose(ground.height(pairs.target), 0.0, atol=1e-9)
    np.testing.assert_array_equal(pairs.direction, np.tile(up, (len(pairs.vertex), 1)))
