import numpy as np
import pytest

from pop_core.keypoints.boxes import PersonBox, distinct_boxes, overlaps, suppressed


def boxes(n=20, seed=0):
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 400, (n, 2))
    return np.concatenate([low, low + rng.uniform(10, 200, (n, 2))], axis=1)


def test_a_box_overlaps_itself_wholly_and_others_as_they_overlap_it():
    overlap = overlaps(boxes(), boxes())
    np.testing.assert_allclose(np.diag(overlap), 1.0)
    np.testing.assert_allclose(overlap, overlap.T)
    assert overlap.min() >= 0.0


def test_overlap_does_not_depend_on_place_or_size():
    a, b = boxes(seed=1), boxes(seed=2)
    np.testing.assert_allclose(overlaps(a, b), overlaps(3 * a + 50, 3 * b + 50), atol=1e-12)


def test_half_a_box_overlaps_by_a_half():
    assert overlaps(np.array([[0.0, 0, 10, 10]]), np.array([[0.0, 0, 10, 5]]))[0, 0] == 0.5


def test_a_box_turned_around_has_no_area():
    assert overlaps(np.array([[10.0, 10, 0, 0]]), np.array([[0.0, 0, 10, 10]]))[0, 0] == 0.0


def test_kept_boxes_are_apart_and_all_others_lie_on_a_better_one():
    b, scores = boxes(200), np.random.default_rng(3).random(200)
    kept = suppressed(b, scores, 0.3)
    overlap = overlaps(b, b)
    assert all(overlap[i, k] <= 0.3 for i in kept for k in kept if i != k)
    for i in set(range(200)) - set(kept):
        assert any(overlap[i, k] > 0.3 and scores[k] >= scores[i] for k in kept)
    assert scores[kept].tolist() == sorted(scores[kept], reverse=True)


def test_boxes_of_two_sources_count_once():
    first = [PersonBox(np.array([0.0, 0, 100, 200]), 0.6)]
    second = [PersonBox(np.array([4.0, 3, 102, 196]), 0.9),
              PersonBox(np.array([300.0, 0, 400, 200]), 0.3)]
    found = distinct_boxes([*first, *second])
    assert [box.score for box in found] == [0.9, 0.3]
    assert distinct_boxes([]) == []


@pytest.mark.parametrize('n', [0, 1])
def test_few_boxes_are_all_kept(n):
    assert suppressed(boxes(n), np.ones(n), 0.5) == list(range(n))
