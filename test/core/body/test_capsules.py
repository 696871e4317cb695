"""Capsules follow the flesh they stand for."""

import numpy as np
import pytest

from pop_core.body.capsule_kernels import closest_shares
from pop_core.body.capsules import BodyCapsules, body_capsules
from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX, PARENTS
from pop_core.body.model import BodyModel

THIGH, UPPER_ARM, HEAD = (JOINT_INDEX[name] for name in ('left_hip', 'left_shoulder', 'head'))


@pytest.fixture(scope='module')
def body() -> BodyModel:
    return default_body()


@pytest.fixture(scope='module')
def capsules(body: BodyModel) -> BodyCapsules:
    return body_capsules(body)


def radius_of(capsules: BodyCapsules, joint: int) -> float:
    return float(capsules.radius[capsules.ends.joint[: len(capsules.radius)] == joint][0])


def test_limbs_are_as_thick_as_limbs(capsules: BodyCapsules) -> None:
    # Firm flesh is 0.8 of the skin's radius: thighs of 15 cm, upper arms of 9 cm, heads of 19 cm.
    assert 0.05 < radius_of(capsules, THIGH) < 0.07
    assert 0.03 < radius_of(capsules, UPPER_ARM) < 0.045
    assert 0.06 < radius_of(capsules, HEAD) < 0.09


def test_capsules_lie_inside_the_skin(body: BodyModel, capsules: BodyCapsules) -> None:
    ends = capsules.ends.template
    assert (ends > body.v_template.min(axis=0)).all()
    assert (ends < body.v_template.max(axis=0)).all()


def test_both_sides_are_alike(capsules: BodyCapsules) -> None:
    n = len(capsules.radius)
    joint = capsules.ends.joint[:n]
    for left, right in zip(range(6), range(6, 12), strict=True):
        assert joint[right] == joint[left] + 1
        assert capsules.radius[left] == pytest.approx(capsules.radius[right], abs=1e-4)
        mirrored = capsules.ends.template[[left, left + n]] * [-1, 1, 1]
        np.testing.assert_allclose(capsules.ends.template[[right, right + n]], mirrored, atol=1e-3)


def test_shape_changes_capsules_as_it_changes_the_flesh(body: BodyModel) -> None:
    """The linear capsules of a heavy body are those measured on that body."""
    betas = np.zeros(body.n_betas)
    betas[1] = 1.5
    shaped = BodyModel(
        'shaped', body.v_template + body.shapedirs @ betas, body.shapedirs, None,
        body.J_regressor, body.weights, body.parents, body.f, body.fit_vertices, body.fit_faces)
    mean, measured = body_capsules(body), body_capsules(shaped)
    # Percentiles change from vertex to vertex: not quite linear.
    np.testing.assert_allclose(
        mean.radius + mean.radius_shapedirs @ betas, measured.radius, atol=2e-3)
    np.testing.assert_allclose(
        mean.ends.template + mean.ends.shapedirs @ betas, measured.ends.template, atol=6e-3)


def test_neighbours_and_what_touches_at_rest_are_no_pairs(capsules: BodyCapsules) -> None:
    joint = capsules.ends.joint
    for first, second in capsules.pairs:
        assert PARENTS[joint[first]] != joint[second]
        assert PARENTS[joint[second]] != joint[first]
    ends = capsules.ends.template.reshape(2, -1, 3)
    _, distance = closest_shares(ends, capsules.pairs)
    assert (distance > capsules.radius[capsules.pairs].sum(axis=1)).all()


def test_a_bone_without_flesh_is_a_point(body: BodyModel) -> None:
    weights = body.weights.copy()
    weights[:, THIGH] += weights[:, HEAD]
    weights[:, HEAD] = 0
    headless = BodyModel(
        'headless', body.v_template, body.shapedirs, None, body.J_regressor, weights,
        body.parents, body.f, body.fit_vertices, body.fit_faces)
    assert radius_of(body_capsules(headless), HEAD) == 0


def test_nearest_points_agree_with_a_dense_search() -> None:
    rng = np.random.default_rng(0)
    ends = rng.normal(size=(2, 12, 3))
    ends[1, 0] = ends[0, 0]  # a ball
    ends[1, 1], ends[1, 2] = ends[0, 1] + [1, 0, 0], ends[0, 2] + [2, 0, 0]  # parallel
    pairs = np.column_stack(np.triu_indices(12, 1))
    shares, distance = closest_shares(ends, pairs)
    assert (shares >= 0).all()
    assert (shares <= 1).all()
    at = ends[0, pairs] + shares[..., None] * (ends[1, pairs] - ends[0, pairs])
    np.testing.assert_allclose(np.linalg.norm(at[:, 0] - at[:, 1], axis=1), distance, atol=1e-9)
    t = np.linspace(0, 1, 200)[:, None]
    for (i, j), found in zip(pairs, distance, strict=True):
        a, b = (ends[0, k] + t * (ends[1, k] - ends[0, k]) for k in (i, j))
        sampled = np.linalg.norm(a[:, None] - b[None], axis=2).min()
        assert sampled - 0.02 < found < sampled + 1e-9  # samples lie up to 2 cm apart
