from itertools import permutations

import numpy as np
import pytest

from benchmarks.tracking_metrics import (
    GATE_M,
    acceleration_errors,
    correspond,
    mot_scores,
    static_std_m,
)
from benchmarks.tracking_records import TruthTable, load_tables, save_tables, track_table

RATE_HZ = 30.0


def truth_of(rows, n_frames, unseen=()):
    """Return the truth of (frame, id, x) rows; `unseen` rows need not be found."""
    joints = np.zeros((len(rows), 24, 3))
    joints[:, :, 0] = np.array([x for _, _, x in rows])[:, None]
    required = np.array([k not in unseen for k in range(len(rows))])
    return TruthTable(
        np.array([k for k, _, _ in rows]), np.array([i for _, i, _ in rows]), joints,
        np.zeros((len(rows), 24), int), np.zeros((len(rows), 24)), required, n_frames, RATE_HZ)


def tracks_of(rows):
    return track_table(
        [(k, i, np.full((24, 3), [x, 0.0, 0.0]), np.tile(np.eye(3), (24, 1, 1)))
         for k, i, x in rows], [1.0], [1.0])


def scores_of(truth, tracks):
    return mot_scores(truth, tracks, correspond(truth, tracks))


WALK = [(k, 0, 0.1 * k) for k in range(6)]


def test_perfect_tracks_score_one():
    scores = scores_of(truth_of(WALK, 6), tracks_of([(k, 7, x) for k, _, x in WALK]))
    assert (scores.mota, scores.idf1, scores.switches) == (1.0, 1.0, 0)


def test_a_number_that_changes_is_one_switch_and_halves_idf1():
    tracks = tracks_of([(k, 1 if k < 3 else 2, x) for k, _, x in WALK])
    scores = scores_of(truth_of(WALK, 6), tracks)
    assert scores.switches == 1
    assert scores.mota == pytest.approx(1 - 1 / 6)
    assert scores.idf1 == pytest.approx(0.5)
    assert scores.switches_per_1000 == pytest.approx(1000 / 6)


def test_a_switch_across_a_gap_counts_too():
    tracks = tracks_of([(0, 1, 0.0), (1, 1, 0.1), (5, 2, 0.5)])
    scores = scores_of(truth_of(WALK, 6), tracks)
    assert (scores.switches, scores.misses, scores.extra) == (1, 3, 0)
    assert scores.mota == pytest.approx(1 - 4 / 6)


def test_misses_and_bodies_of_nobody_are_counted():
    tracks = tracks_of([(0, 1, 0.0), (1, 1, 0.1), (2, 1, 0.2), (2, 9, 3.0)])
    scores = scores_of(truth_of(WALK, 6), tracks)
    assert (scores.misses, scores.extra) == (3, 1)
    assert scores.idf1 == pytest.approx(2 * 3 / (6 + 4))


def test_two_who_swap_numbers_in_passing_are_two_switches():
    rows = [(k, i, (k - 2.5) * (1 if i == 0 else -1)) for k in range(6) for i in range(2)]
    swapped = [(k, i if k < 3 else 1 - i, x) for k, i, x in rows]
    scores = scores_of(truth_of(rows, 6), tracks_of(swapped))
    assert (scores.switches, scores.misses, scores.extra) == (2, 0, 0)
    assert scores.idf1 == pytest.approx(0.5)


def test_a_body_keeps_its_person_while_another_comes_nearer():
    truth = truth_of([(0, 0, 0.0), (0, 1, 1.0), (1, 0, 0.0), (1, 1, 0.3)], 2)
    tracks = tracks_of([(0, 5, 0.0), (0, 6, 1.0), (1, 5, 0.2), (1, 6, 0.1)])
    assert tracks.id[correspond(truth, tracks)].tolist() == [5, 6, 5, 6]
    assert scores_of(truth, tracks).switches == 0


def test_people_hardly_seen_cost_nothing_found_or_not():
    truth = truth_of(WALK, 6, unseen=(3, 4, 5))
    rows = [(k, 1, x) for k, _, x in WALK]
    for tracks in (tracks_of(rows), tracks_of(rows[:3])):
        scores = scores_of(truth, tracks)
        assert (scores.mota, scores.idf1, scores.required) == (1.0, 1.0, 3)


def test_nobody_is_matched_beyond_the_gate():
    truth = truth_of([(0, 0, 0.0)], 1)
    assert correspond(truth, tracks_of([(0, 0, GATE_M + 0.01)])).tolist() == [-1]
    assert correspond(truth, tracks_of([(0, 0, GATE_M - 0.01)])).tolist() == [0]
    assert correspond(truth, tracks_of([])).tolist() == [-1]


@pytest.mark.parametrize('seed', range(6))
def test_idf1_agrees_with_trying_every_pairing(seed):
    rng = np.random.default_rng(seed)
    rows = [(k, i, 2.0 * i) for k in range(8) for i in range(3) if rng.random() < 0.9]
    found = [(k, int(rng.integers(4)), x + rng.normal(0, 0.2)) for k, _, x in rows]
    found = list({(k, number): (k, number, x) for k, number, x in found}.values())
    truth, tracks = truth_of(rows, 8), tracks_of(found)

    def explained(numbers):
        return sum(
            (tracks.frame[j] == truth.frame[i]) & (tracks.id[j] == numbers[truth.id[i]])
            & (abs(tracks.joints[j, 0, 0] - truth.joints[i, 0, 0]) <= GATE_M)
            for i in range(len(rows)) for j in range(len(found)))

    best = max(explained(numbers) for numbers in permutations(range(4), 3))
    assert scores_of(truth, tracks).idf1 == pytest.approx(
        2 * best / (len(rows) + len(found)))


def test_sequences_are_summed_before_dividing():
    one = scores_of(truth_of(WALK, 6), tracks_of([(k, 7, x) for k, _, x in WALK]))
    none = scores_of(truth_of(WALK[:2], 2), tracks_of([]))
    assert (one + none).mota == pytest.approx(6 / 8)
    assert (one + none).frames == 8


def test_static_std_is_that_of_the_noise_after_settling():
    rng = np.random.default_rng(0)
    truth = truth_of([(k, 0, 0.0) for k in range(600)], 600)
    joints = rng.normal(0, 0.002, (600, 24, 3)) + 0.1  # an offset is no jitter
    joints[:10] += 5.0
    tracks = track_table(
        [(k, 0, joints[k], np.tile(np.eye(3), (24, 1, 1))) for k in range(600)], [1.0], [1.0])
    std = static_std_m(truth, tracks, np.arange(600))
    assert std == pytest.approx(0.002 * np.sqrt(3), rel=0.1)


def test_acceleration_errors_see_a_jerk_but_no_drift():
    truth = truth_of([(k, 0, 0.0) for k in range(9)], 9)
    drift = tracks_of([(k, 0, 0.01 * k) for k in range(9)])
    assert acceleration_errors(truth, drift, np.arange(9)) == pytest.approx(0.0, abs=1e-9)
    jerk = tracks_of([(k, 0, 0.01 if k == 4 else 0.0) for k in range(9)])
    errors = acceleration_errors(truth, jerk, np.arange(9)).reshape(-1, 24)[:, 0]
    assert errors.tolist() == pytest.approx([0, 0, 9.0, 18.0, 9.0, 0, 0])  # 1 cm (30 / s)^2


def test_acceleration_is_only_taken_over_frames_in_a_row():
    truth = truth_of([(k, 0, 0.0) for k in (0, 1, 3, 4)], 5)
    tracks = tracks_of([(k, 0, 0.1 * k) for k in (0, 1, 3, 4)])
    assert len(acceleration_errors(truth, tracks, np.arange(4))) == 0


def test_tables_come_back_from_their_file(tmp_path):
    truth, tracks = truth_of(WALK, 6), tracks_of([(k, 7, x) for k, _, x in WALK])
    save_tables(tmp_path / 'a.npz', truth, {'pop': tracks})
    read, methods = load_tables(tmp_path / 'a.npz', ['pop'])
    assert (read.n_frames, read.rate_hz) == (6, RATE_HZ)
    assert np.array_equal(read.joints, truth.joints)
    assert np.array_equal(methods['pop'].covariance, tracks.covariance)
