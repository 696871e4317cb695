"""Laws of stated covariances: what speaks against a joint widens its ellipsoid, nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import lift_truth

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.estimate import JointState
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.disagreement import disagreement, unnamed_joints
from pop_core.fitting.uncertainty import (
    Calibration,
    JointEvidence,
    covariances,
    curvature_covariance,
    joined_evidence,
)
from pop_core.tracking.calibration import TRACKED

COUNT = 12


def evidence(seed: int = 0, count: int = COUNT) -> JointEvidence:
    rng = np.random.default_rng(seed)
    root, spread = (0.02 * rng.normal(size=(2, count, 3, 3)))
    return JointEvidence(
        curvature=root @ root.transpose(0, 2, 1), rivals=0.05 * rng.normal(size=(count, 2, 3)),
        rival_excess=np.full((count, 2), 3.0), retrieved=spread @ spread.transpose(0, 2, 1),
        unnamed=np.arange(count) % 2 == 0, state=np.arange(count) % len(JointState),
        part=np.arange(count) % 3, misfit_m=np.full(count, 0.04), strain=np.full(count, 2.5))


def is_wider(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether each covariance of a is at least that of b in every direction, and not equal."""
    least = np.linalg.eigvalsh(a - b).min()
    return bool(least > -1e-12 and np.trace(a - b, axis1=1, axis2=2).min() > 1e-9)


@pytest.fixture(params=[SINGLE_FRAME, TRACKED], ids=['single frame', 'tracked'])
def calibration(request: pytest.FixtureRequest) -> Calibration:
    return request.param


@pytest.fixture(scope='module')
def state(body: BodyModel, person: BodyParameters) -> BodyState:
    return FitBody(body, full=False).state(person)


def test_covariances_are_symmetric_and_never_below_the_floor(calibration: Calibration) -> None:
    stated = covariances(evidence(), calibration)
    np.testing.assert_allclose(stated, stated.transpose(0, 2, 1), atol=1e-15)
    assert np.linalg.eigvalsh(stated).min() >= calibration.floor_m**2 - 1e-12


@pytest.mark.parametrize(('name', 'worse'), [
    ('misfit_m', 0.08), ('strain', 4.0), ('rival_excess', 0.0), ('curvature', 2.0),
    ('rivals', 2.0),
])
def test_what_speaks_against_a_body_widens_every_ellipsoid(
    calibration: Calibration, name: str, worse: float
) -> None:
    usual = evidence()
    array = getattr(usual, name)
    changed = array * worse if worse == 2.0 else np.full_like(array, worse)
    assert is_wider(
        covariances(replace(usual, **{name: changed}), calibration),
        covariances(usual, calibration))


def test_started_hypotheses_that_disagree_widen_most_a_limb_that_no_keypoint_names() -> None:
    usual = evidence()
    wider = replace(usual, retrieved=4.0 * usual.retrieved)
    assert is_wider(covariances(wider, SINGLE_FRAME), covariances(usual, SINGLE_FRAME))
    alone = replace(
        usual, curvature=0.0 * usual.curvature, rivals=0.0 * usual.rivals,
        state=0 * usual.state, part=0 * usual.part)
    named, unnamed = (
        covariances(replace(alone, unnamed=np.full(COUNT, flag)), SINGLE_FRAME)
        for flag in (False, True))
    assert is_wider(unnamed, named)


def test_covariances_turn_with_the_camera(calibration: Calibration) -> None:
    usual = evidence()
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turned = replace(
        usual, curvature=turn @ usual.curvature @ turn.T, rivals=usual.rivals @ turn.T,
        retrieved=turn @ usual.retrieved @ turn.T)
    np.testing.assert_allclose(
        covariances(turned, calibration), turn @ covariances(usual, calibration) @ turn.T,
        atol=1e-12)


def test_a_body_is_stated_alike_alone_and_among_others(calibration: Calibration) -> None:
    parts = [evidence(seed) for seed in range(3)]
    together = covariances(joined_evidence(parts), calibration)
    np.testing.assert_allclose(
        together, np.concatenate([covariances(part, calibration) for part in parts]))


def test_the_curvature_is_drawn_toward_the_usual_size(calibration: Calibration) -> None:
    bare = replace(calibration, rival_share=0.0, retrieved_share=(0.0, 0.0), floor_m=0.0)
    usual = evidence()
    sigma, wider = (
        np.sqrt(np.trace(covariances(each, bare), axis1=1, axis2=2))
        for each in (usual, replace(usual, curvature=100.0 * usual.curvature)))
    # Ten times the standard deviation is stated as less, by the same factor for every joint.
    np.testing.assert_allclose(wider / sigma, 10.0 ** (1.0 - calibration.compression))


def test_nothing_widens_without_end(calibration: Calibration) -> None:
    hopeless = replace(evidence(), misfit_m=np.full(COUNT, 10.0))
    assert np.sqrt(np.linalg.eigvalsh(covariances(hopeless, calibration)).max()) < 2.0


def test_curvature_of_the_translation_alone_moves_all_joints_alike(
    body: BodyModel, person: BodyParameters
) -> None:
    hessian = 1e12 * np.eye(3 + 72 + body.n_betas + 1)
    hessian[[0, 1, 2], [0, 1, 2]] = 1 / 0.01**2, 1 / 0.02**2, 1 / 0.03**2
    found = curvature_covariance(body, person, hessian)
    np.testing.assert_allclose(
        found, np.tile(np.diag([0.01, 0.02, 0.03]) ** 2, (24, 1, 1)), atol=1e-8)


def test_hypotheses_that_end_in_one_place_disagree_about_nothing(state: BodyState) -> None:
    left = disagreement(state, [state], [5.0], [state, state], np.zeros(24, dtype=bool))
    assert not left.rivals.any()
    assert not left.retrieved.any()


def test_disagreement_is_where_the_others_are(state: BodyState) -> None:
    step = np.array([0.1, 0.0, -0.2])
    other = state.body.state(state.parameters.replaced(transl=state.parameters.transl + step))
    left = disagreement(state, [other], [5.0], [state, other], np.zeros(24, dtype=bool))
    np.testing.assert_allclose(left.rivals[0], np.tile(step, (24, 1)), atol=1e-9)
    np.testing.assert_allclose(
        left.retrieved, np.tile(np.outer(step, step) / 2, (24, 1, 1)), atol=1e-9)


def test_a_limb_is_named_by_its_own_keypoint_and_only_where_it_is(
    body: BodyModel, person: BodyParameters, state: BodyState
) -> None:
    lifted = lift_truth(body, person, (SHARED_INDEX['left_knee'],))
    moved = lifted.positions_camera.copy()
    moved[SHARED_INDEX['right_wrist']] += 0.3
    found = unnamed_joints(state, replace(lifted, positions_camera=moved))
    unnamed = {'left_knee', 'right_wrist', 'right_hand'}
    assert {name for name, j in JOINT_INDEX.items() if found[j]} == unnamed
