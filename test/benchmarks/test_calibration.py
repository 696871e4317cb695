"""Calibration learns the widths that errors were drawn with."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.accuracy import make_console
from benchmarks.calibration import collect, figures, parse
from benchmarks.calibration_fit import Sample, joined, learn, squared_radii
from benchmarks.calibration_samples import (
    Witness,
    load_sample,
    save_sample,
    scene_sample,
    sequence_sample,
)
from benchmarks.metrics import CHI2_3_68, CHI2_3_95, share_within
from pop_core.estimate import JointState
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.uncertainty import Calibration, JointEvidence, covariances
from pop_core.synthesis.sequence import SequenceConfig
from pop_core.synthesis.sequence_names import SequenceKind
from pop_core.tracking.calibration import TRACKED


def drawn(truth: Calibration, seed: int, count: int = 1500, rivals: int = 1) -> Sample:
    """Joints whose errors are as large as one calibration says."""
    rng = np.random.default_rng(seed)
    root, spread = 0.02 * rng.normal(size=(2, count, 3, 3))
    state = rng.integers(0, len(JointState), count)
    evidence = JointEvidence(
        root @ root.transpose(0, 2, 1), 0.05 * rng.normal(size=(count, rivals, 3)),
        rng.exponential(10.0, (count, rivals)), spread @ spread.transpose(0, 2, 1),
        rng.random(count) < 0.3, state, rng.integers(0, 3, count),
        rng.uniform(0.02, 0.06, count), rng.uniform(2.0, 3.0, count))
    half = np.linalg.cholesky(covariances(evidence, truth))
    return Sample(evidence, (half @ rng.normal(size=(count, 3, 1)))[..., 0], state)


def test_ellipsoids_of_the_true_calibration_hold_their_share() -> None:
    sample = drawn(SINGLE_FRAME, 0, 6000)
    squared, _ = squared_radii(sample, SINGLE_FRAME)
    # Three standard deviations of 6,000 draws.
    assert share_within(squared, CHI2_3_68) == pytest.approx(0.68, abs=0.018)
    assert share_within(squared, CHI2_3_95) == pytest.approx(0.95, abs=0.009)


def test_errors_that_are_larger_for_one_state_are_learned() -> None:
    inflation = SINGLE_FRAME.inflation.copy()
    inflation[:, JointState.SELF_OCCLUDED] *= 2.5
    truth = replace(SINGLE_FRAME, inflation=inflation)
    learned = learn(drawn(truth, 1), SINGLE_FRAME)
    check = drawn(truth, 2)
    own = check.truth == JointState.SELF_OCCLUDED
    before, after = (squared_radii(check, c)[0][own] for c in (SINGLE_FRAME, learned))
    assert share_within(before, CHI2_3_95) < 0.7
    assert share_within(after, CHI2_3_95) == pytest.approx(0.94, abs=0.04)


def test_bodies_without_runners_up_join_those_with() -> None:
    few, many = drawn(SINGLE_FRAME, 3, 24, rivals=0), drawn(SINGLE_FRAME, 4, 24, rivals=2)
    both, log_det = squared_radii(joined([few, many]), SINGLE_FRAME)
    np.testing.assert_allclose(both[:24], squared_radii(few, SINGLE_FRAME)[0])
    np.testing.assert_allclose(log_det[24:], squared_radii(many, SINGLE_FRAME)[1])


def test_a_sample_survives_its_file(tmp_path: Path) -> None:
    sample = drawn(SINGLE_FRAME, 5, 24)
    save_sample(tmp_path / 'new' / 'scene.npz', sample)
    again = load_sample(tmp_path / 'new' / 'scene.npz')
    np.testing.assert_array_equal(again.error_m, sample.error_m)
    np.testing.assert_array_equal(
        covariances(again.evidence, SINGLE_FRAME), covariances(sample.evidence, SINGLE_FRAME))


def test_wider_ellipsoids_hold_more_and_say_so() -> None:
    sample = drawn(SINGLE_FRAME, 6)
    wide = figures(sample, replace(SINGLE_FRAME, inflation=2.0 * SINGLE_FRAME.inflation))
    usual = figures(sample, SINGLE_FRAME)
    size, held = 'mean sigma, geometric', 'visible in 68 / 95 %'
    assert float(wide[size].split()[0]) > 1.5 * float(usual[size].split()[0])
    assert int(wide[held].split()[0]) > int(usual[held].split()[0])


def test_as_many_scenes_as_asked_for_are_learned_from() -> None:
    options = parse(['tracks', '--learn', '1'])
    assert (options.learn, options.check) == (1, 2)


def test_nobody_to_learn_from_is_said_in_a_line() -> None:
    with pytest.raises(SystemExit, match='found nobody'):
        collect({}, make_console(), 'to learn from')


@pytest.fixture(scope='module')
def witness() -> Witness:
    return Witness()


def test_people_of_a_few_scenes_lie_in_their_ellipsoids(witness: Witness) -> None:
    found = [scene_sample(witness, seed) for seed in range(700_000, 700_003)]
    sample = joined([each for each in found if each is not None])
    assert len(sample.truth) >= 3 * 24
    squared, _ = squared_radii(sample, SINGLE_FRAME)
    # A handful of people err together: far from all, and far from a half as few.
    assert 0.5 < share_within(squared, CHI2_3_68) < 0.95
    assert share_within(squared, CHI2_3_95) > 0.8


def test_people_who_are_followed_lie_in_their_ellipsoids(witness: Witness) -> None:
    film = SequenceConfig(SequenceKind.TABLE, 17, colour=False)
    sample = sequence_sample(witness, 700_000, film)
    assert sample is not None
    # Every fourth frame, without the first, in which nobody is followed yet.
    assert len(sample.truth) == 4 * 24
    assert share_within(squared_radii(sample, TRACKED)[0], CHI2_3_95) > 0.7
