import itertools

import numpy as np
import pytest

from pop_core.keypoints import skeleton_tree_kernels as kernels
from pop_core.keypoints.bone_evidence import (
    BONE_COSTS,
    EMPTY_COST,
    HIDDEN_COST,
    UNKNOWN_COST,
    depths_along_bones,
)
from pop_core.keypoints.skeleton import LIMB_ENDS

TOLERANCE, WORST = 0.05, 8.0
ELBOW = LIMB_ENDS[2]
COSTS = BONE_COSTS[ELBOW]


def bone_cost(samples, near_m, far_m, skin_m=0.0):
    return cost_along(samples, near_m, far_m, skin_m, skin_m, COSTS)


def cost_along(samples, near_m, far_m, near_skin_m, far_skin_m, costs):
    """The cost of what was measured along one bone, by the kernel."""
    out = np.zeros(1)
    kernels.add_bone_costs(
        samples, near_m, np.array([far_m]), near_skin_m, far_skin_m, costs, out)
    return out[0]


def whole_cost(choice, unary, bins, rays, links, limits, samples, skin_m, costs):
    """The energy of one choice of bins, written out."""
    total = 0.0
    for j, parent in enumerate(links):
        total += unary[j, choice[j]]
        if parent < 0:
            continue
        near, far = bins[choice[parent]], bins[choice[j]]
        ends = np.append(rays[j], 1.0) * far, np.append(rays[parent], 1.0) * near
        length = np.linalg.norm(ends[0] - ends[1])
        shortest, longest, lean = limits[j]
        excess = max(0.0, length - longest, shortest - length) / TOLERANCE
        link = 0.5 * excess**2 + 0.5 * ((far - near) / lean) ** 2
        link += cost_along(samples[j], near, far, skin_m[parent], skin_m[j], costs[j])
        total += min(WORST, link)
    return total


@pytest.mark.parametrize('seed', range(6))
def test_joint_depths_are_those_of_the_lowest_energy_of_all(seed):
    rng = np.random.default_rng(seed)
    links = np.array([-1, 0, 1, 1, 0])
    unary = rng.uniform(0, 6, (5, 5))
    bins = np.linspace(1.5, 2.4, 5)
    rays = rng.uniform(-0.2, 0.2, (5, 2))
    longest = rng.uniform(0.1, 0.5, 5)
    limits = np.column_stack([0.6 * longest, longest, 0.5 * longest])
    samples = rng.uniform(1.4, 2.5, (5, 6, 3))
    terms = unary, bins, rays, links, limits, samples, np.full(5, 0.05), np.tile(COSTS, (5, 1))
    out = np.zeros(5, dtype=np.int64)
    kernels.tree_depths(
        unary, bins, rays, links, np.arange(5), limits, TOLERANCE, WORST, samples,
        np.full(5, 0.05), np.tile(COSTS, (5, 1)), out)
    best = min(energy(c, terms) for c in itertools.product(range(5), repeat=5))
    assert energy(out, terms) == pytest.approx(best, abs=1e-9)


def energy(choice, terms):
    unary, bins, rays, links, limits, samples, skin_m, costs = terms
    return whole_cost(choice, unary, bins, rays, links, limits, samples, skin_m, costs)


@pytest.mark.parametrize('seed', range(4))
def test_the_cost_along_a_bone_is_that_of_the_nearest_of_what_was_measured(seed):
    rng = np.random.default_rng(seed)
    samples = rng.uniform(1.4, 2.6, (6, 3))
    samples[rng.random((6, 3)) < 0.4] = np.nan
    near_m, far_m = 1.9, np.linspace(1.5, 2.5, 13)
    out = np.full(len(far_m), 7.0)
    kernels.add_bone_costs(samples, near_m, far_m, 0.03, 0.07, COSTS, out)
    empty, behind, unknown, slack, soft = COSTS
    for end_m, cost in zip(far_m, out, strict=True):
        each = []
        for k, row in enumerate(samples):
            share = (k + 1) / 7
            skin_m = 1 / ((1 - share) / near_m + share / end_m) - (1 - share) * 0.03 - share * 0.07
            gap = row[np.isfinite(row)] - skin_m
            over = np.clip((np.abs(gap) - slack) / soft, 0, 1) * np.where(gap > 0, empty, behind)
            each.append(over.min() if len(over) else unknown)
        assert cost - 7.0 == pytest.approx(np.mean(each), abs=1e-12)


def test_a_bone_whose_skin_was_measured_costs_nothing():
    samples = np.full((6, 3), 1.96)
    assert bone_cost(samples, 2.0, 2.0, skin_m=0.04) == 0.0


def test_a_bone_may_lie_behind_a_surface_rather_than_in_empty_space():
    behind = bone_cost(np.full((6, 3), 1.5), 2.0, 2.0)
    empty = bone_cost(np.full((6, 3), 2.5), 2.0, 2.0)
    unknown = bone_cost(np.full((6, 3), np.nan), 2.0, 2.0)
    assert (behind, empty, unknown) == pytest.approx((HIDDEN_COST, EMPTY_COST, UNKNOWN_COST))


def test_an_arm_beside_its_keypoints_counts_as_seen():
    samples = np.full((6, 3), 2.5)
    samples[:, 1] = 2.0
    assert bone_cost(samples, 2.0, 2.0) == 0.0


def test_a_bone_that_points_at_the_camera_is_straight_in_space():
    near, far, shares = 1.5, 2.5, np.arange(1, 7) / 7
    # The pixel at a share of the way in the image shows the point of that inverse depth.
    skin = 1.0 / ((1 - shares) / near + shares / far)
    samples = np.repeat(skin[:, None], 3, axis=1)
    assert bone_cost(samples, near, far) == 0.0


def test_samples_are_those_on_the_line_between_two_keypoints():
    depth = np.tile(np.arange(100, dtype=np.float32), (80, 1))
    keypoints = np.full((15, 2), np.nan)
    links = np.full(15, -1)
    shoulder = 0 if ELBOW else 1
    keypoints[shoulder], keypoints[ELBOW], links[ELBOW] = (10.0, 40.0), (80.0, 40.0), shoulder
    samples = depths_along_bones(depth, keypoints, links, 150.0)
    np.testing.assert_array_equal(samples[ELBOW, :, 0], [20, 30, 40, 50, 60, 70])
    np.testing.assert_array_equal(samples[ELBOW, :, 1], samples[ELBOW, :, 2])
    assert np.isnan(np.delete(samples, ELBOW, axis=0)).all()
