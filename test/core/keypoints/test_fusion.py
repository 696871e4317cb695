from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from keypoint_bodies import show

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.fusion import FusedDetector, FusionConfig, fuse, merge
from pop_core.keypoints.keypoint_similarity import person_similarities
from pop_core.keypoints.people import detection_of

WRIST = SHARED_INDEX['left_wrist']
BODY = show()
SAME = FusionConfig().same_joint


def person(shift_px=0.0, score=0.8, noise_px=0.0, seed=0, missing=()):
    uv = BODY.detection.keypoints_px + [shift_px, 0.0]
    uv = uv + np.random.default_rng(seed).normal(0, 1, (15, 2)) * noise_px
    scores = np.full(15, score)
    scores[[SHARED_INDEX[name] for name in missing]] = 0.0
    return detection_of(uv, scores)


def person_similarity(a, b):
    return float(person_similarities([a], [b])[0, 0])


def same(a, b):
    np.testing.assert_allclose(a.keypoints_px, b.keypoints_px)
    np.testing.assert_allclose(a.scores, b.scores)
    np.testing.assert_allclose(a.box_px, b.box_px)


class Says:
    """A source that says what it is told."""

    def __init__(self, people):
        self.people = list(people)

    def detect(self, frame):  # noqa: ARG002 - the protocol's shape
        return self.people


class FindsBoxes:
    def __init__(self, *boxes):
        self.boxes = list(boxes)

    def find_boxes(self, frame):  # noqa: ARG002 - the protocol's shape
        return self.boxes


class LooksIntoBoxes:
    def __init__(self, people):
        self.people, self.asked = people, None

    def detect_in(self, frame, boxes):  # noqa: ARG002 - the protocol's shape
        self.asked = list(boxes)
        return self.people


def test_one_source_alone_is_unchanged():
    people = [person(-150, 0.9), person(150, 0.6, missing=['head'])]
    fused = fuse([people])
    assert [id(p) for p in fused] == [id(p) for p in people]


def test_a_source_merged_with_itself_is_itself():
    people = [person(-150, 0.9), person(150, 0.6, missing=['head'])]
    fused = fuse([people, people, people])
    assert len(fused) == 2
    for merged, single in zip(fused, people, strict=True):
        same(merged, single)


def test_somebody_without_a_keypoint_is_nobody():
    empty = replace(person(0, 0.9), scores=np.zeros(15))
    assert fuse([[empty], [empty]]) == []
    assert len(fuse([[empty], [person(0, 0.9)]])) == 1


def test_nobody_and_nobody_is_nobody():
    assert fuse([[], []]) == []
    assert fuse([]) == []


def test_each_source_finds_whom_the_other_misses():
    fused = fuse([[person(-150, 0.9)], [person(150, 0.5)]])
    assert [p.score for p in fused] == pytest.approx([0.9, 0.5])


def test_the_order_of_sources_does_not_matter():
    sources = [
        [person(-150, 0.9, 3.0, 1), person(150, 0.5, 3.0, 2)],
        [person(150, 0.7, 3.0, 3), person(-150, 0.6, 3.0, 4)],
        [person(0, 0.4, 3.0, 5), person(-150, 0.8, 3.0, 6)],
    ]
    expected = fuse(sources)
    assert len(expected) == 3
    for order in permutations(sources):
        for a, b in zip(fuse(order), expected, strict=True):
            same(a, b)


@pytest.mark.parametrize('seed', range(5))
def test_two_equally_noisy_sources_are_better_than_each(seed):
    truth = person(0)
    sources = [[person(0, 0.8, 6.0, 10 * seed + k)] for k in range(2)]
    (fused,) = fuse(sources)

    def error(p):
        return np.sqrt(np.mean((p.keypoints_px - truth.keypoints_px) ** 2))

    assert error(fused) < np.mean([error(source[0]) for source in sources])


def test_the_mean_lies_nearer_to_the_surer_source_by_the_square_of_scores():
    (fused,) = fuse([[person(0, 0.8)], [person(5, 0.4)]])
    moved = fused.keypoints_px - person(0).keypoints_px
    np.testing.assert_allclose(moved[:, 0], 5 * 0.4**2 / (0.8**2 + 0.4**2))


def test_where_sources_contradict_each_other_the_surer_one_is_believed():
    lost = person(0, 0.7)
    lost.keypoints_px[WRIST] += [120, -60]
    lost.scores[WRIST] = 0.3
    (fused,) = fuse([[lost], [person(0, 0.6)]])
    np.testing.assert_allclose(fused.keypoints_px[WRIST], person(0).keypoints_px[WRIST])
    assert fused.scores[WRIST] == 0.6


def test_joints_that_only_one_source_has_are_taken_over():
    legs = ['left_knee', 'right_knee', 'left_ankle', 'right_ankle']
    arms = ['left_elbow', 'right_elbow', 'left_wrist', 'right_wrist']
    (fused,) = fuse([[person(0, 0.8, missing=legs)], [person(0, 0.5, missing=arms)]])
    assert (fused.scores > 0).all()
    np.testing.assert_allclose(fused.keypoints_px, person(0).keypoints_px)


def test_a_double_of_one_source_is_not_doubled():
    twice = [person(0, 0.9), person(3, 0.5)]
    assert len(fuse([twice, [person(1, 0.7)]])) == 1
    assert len(fuse([twice])) == 1


def test_a_double_does_not_move_whom_it_doubles():
    (fused,) = fuse([[person(0, 0.9), person(6, 0.8)]])
    same(fused, person(0, 0.9))


def test_joints_that_one_of_both_lacks_say_nothing_about_similarity():
    legs = ['left_knee', 'right_knee', 'left_ankle', 'right_ankle']
    assert person_similarity(person(0), person(0, missing=legs)) == pytest.approx(1.0)


def test_joints_that_a_source_guesses_count_little():
    guessed = person(0)
    guessed.keypoints_px[WRIST] += [90, 0]
    sure = person_similarity(person(0), guessed)
    guessed.scores[WRIST] = 0.05
    assert person_similarity(person(0), guessed) > max(sure, 0.97)


def test_neighbours_are_not_taken_for_each_other():
    # Shoulder to shoulder, both seen by both.
    width = np.ptp(person().keypoints_px[:, 0])
    sources = [[person(0, 0.9, 3.0, k), person(width, 0.8, 3.0, k + 5)] for k in range(2)]
    fused = fuse(sources)
    assert len(fused) == 2
    assert np.ptp([p.keypoints_px[0, 0] for p in fused]) == pytest.approx(width, abs=8)


def test_a_source_that_takes_left_for_right_follows_the_surer_one():
    turned = person(0, 0.6).with_sides_exchanged()
    (fused,) = fuse([[person(0, 0.9)], [turned]])
    np.testing.assert_allclose(fused.keypoints_px, person(0).keypoints_px)
    assert turned.with_sides_exchanged().keypoints_px.tolist() == person(0).keypoints_px.tolist()


def test_similarity_is_symmetric_and_falls_with_distance():
    gaps = [person_similarity(person(0), person(shift)) for shift in (0, 5, 20, 80, 400)]
    assert gaps[0] == pytest.approx(1.0)
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] < 1e-3
    assert person_similarity(person(7), person(0)) == pytest.approx(
        person_similarity(person(0), person(7)))


def test_similarity_does_not_depend_on_the_size_of_the_image():
    def larger(p):
        return detection_of(3 * p.keypoints_px + 40, p.scores)

    a, b = person(0), person(15, noise_px=5.0)
    assert person_similarity(a, b) == pytest.approx(
        person_similarity(larger(a), larger(b)), rel=1e-6)


def with_depth(detection, depth_m, sigma_m):
    return replace(detection, joint_depth_m=np.full(15, depth_m),
                   joint_sigma_m=np.full(15, sigma_m), visible=np.full(15, 0.9),
                   person_mask=np.ones((4, 4), bool), part_labels=np.zeros((4, 4), np.int8))


def test_what_only_a_depth_source_knows_is_kept():
    seen = with_depth(person(0, 0.5), 2.5, 0.03)
    (fused,) = fuse([[person(2, 0.9)], [seen]])
    np.testing.assert_allclose(fused.joint_depth_m, 2.5)
    np.testing.assert_allclose(fused.joint_sigma_m, 0.03)
    np.testing.assert_allclose(fused.visible, 0.9)
    assert fused.person_mask is seen.person_mask


def test_depth_of_a_place_that_is_not_believed_is_not_believed():
    seen = with_depth(person(0, 0.5), 2.5, 0.03)
    seen.keypoints_px[WRIST] += [150, 0]
    (fused,) = fuse([[person(0, 0.9)], [seen]])
    assert np.isnan(fused.joint_depth_m[WRIST])
    assert np.isfinite(np.delete(fused.joint_depth_m, WRIST)).all()


def test_a_coarse_source_has_a_say_where_no_other_names_a_joint():
    """A network of depth alone knows limbs to some centimetres: it would only add its errors."""
    exact = person(0, 0.8)
    exact.keypoints_px[WRIST], exact.scores[WRIST] = np.nan, 0.0
    coarse = replace(with_depth(person(3, 0.9), 2.5, 0.08), sees_colour=False)
    (fused,) = fuse([[exact], [coarse]])
    others = np.delete(np.arange(15), WRIST)
    np.testing.assert_allclose(fused.keypoints_px[others], exact.keypoints_px[others])
    np.testing.assert_allclose(fused.keypoints_px[WRIST], coarse.keypoints_px[WRIST])
    assert np.isnan(fused.joint_depth_m[others]).all()
    assert fused.joint_depth_m[WRIST] == 2.5
    assert fused.person_mask is coarse.person_mask
    assert fused.part_labels is None
    exact.keypoints_px[WRIST], exact.scores[WRIST] = 0.0, 0.05  # nobody believes that one
    (fused,) = fuse([[exact], [coarse]])
    np.testing.assert_allclose(fused.keypoints_px[WRIST], coarse.keypoints_px[WRIST])
    assert fused.scores[WRIST] == coarse.scores[WRIST]
    exact.keypoints_px[WRIST], exact.scores[WRIST] = np.nan, 0.0
    unseen = replace(coarse, visible=np.full(15, 0.2))
    (fused,) = fuse([[exact], [unseen]])
    assert np.isnan(fused.keypoints_px[WRIST]).all()
    (alone,) = fuse([[], [unseen]])
    assert np.isfinite(alone.keypoints_px).all()
    assert alone.part_labels is unseen.part_labels


def test_a_joint_that_is_guessed_in_colour_is_hidden_where_depth_says_so():
    colour = person(0, 0.9)
    colour.scores[WRIST] = 0.3
    hidden = replace(
        with_depth(person(0, 0.5), 2.5, 0.08), visible=np.full(15, 0.1), sees_colour=False)
    (fused,) = fuse([[colour], [hidden]])
    assert fused.visible[WRIST] == 0.3
    np.testing.assert_array_equal(np.delete(fused.visible, WRIST), 0.9)


def test_two_depths_are_averaged_by_precision():
    a, b = with_depth(person(0, 0.5), 2.0, 0.03), with_depth(person(0, 0.5), 3.0, 0.06)
    merged = merge([a, b], SAME)
    np.testing.assert_allclose(merged.joint_depth_m, (2.0 * 4 + 3.0) / 5)
    np.testing.assert_allclose(merged.joint_sigma_m, (1 / 0.03**2 + 1 / 0.06**2) ** -0.5)


def test_networks_that_look_into_boxes_get_those_of_all_others_once():
    first, second = person(-150, 0.9), person(150, 0.5)
    box = PersonBox(second.box_px + 2.0, 0.95)
    other = PersonBox(np.array([600.0, 10, 630, 90]), 0.4)
    looks = LooksIntoBoxes([person(-150, 0.7)])
    detector = FusedDetector([Says([first, second])], [FindsBoxes(box, other)], [looks])
    assert isinstance(detector, KeypointDetector)
    people = detector.detect(BODY.frame)
    assert len(people) == 2
    assert [b.score for b in looks.asked] == [0.95, pytest.approx(0.9), 0.4]


def test_boxes_alone_give_people_whose_joints_are_found_in_them():
    looks = LooksIntoBoxes([person(0, 0.7)])
    box = PersonBox(person(0).box_px, 0.8)
    (found,) = FusedDetector([], [FindsBoxes(box)], [looks]).detect(BODY.frame)
    same(found, person(0, 0.7))


@pytest.mark.parametrize('seed', range(20))
def test_random_people_merge_without_trouble(seed):
    rng = np.random.default_rng(seed)
    sources = []
    for _ in range(3):
        people = []
        for _ in range(int(rng.integers(0, 12))):
            scores = np.where(rng.random(15) < 0.5, rng.random(15), 0.0)
            scores[0] = 0.5
            people.append(detection_of(rng.uniform(0, 640, (15, 2)), scores))
        sources.append(people)
    fused = fuse(sources)
    assert len(fused) <= sum(map(len, sources))
    for p in fused:
        assert isinstance(p, Detection)
        assert np.isfinite(p.keypoints_px[p.scores > 0]).all()
        assert np.isnan(p.keypoints_px[p.scores == 0]).all()
        assert np.isfinite(p.box_px).all()
    again = fuse([fused])
    assert len(again) <= len(fused)


def sees(truth, rng):
    """What a mediocre network sees of people: noise, gaps, wild guesses, sides exchanged."""
    seen = []
    for one in truth:
        if rng.random() < 0.15:
            continue
        scores = rng.uniform(0.5, 0.95, 15)
        uv = one.keypoints_px + rng.normal(0, 1, (15, 2)) * 4.0 / scores[:, None]
        wild = rng.random(15) < 0.1
        uv[wild] += rng.normal(0, 60, (15, 2))[wild]
        scores[wild] *= 0.5
        scores[rng.random(15) < 0.15] = 0.0
        found = detection_of(uv, scores)
        seen.append(found.with_sides_exchanged() if rng.random() < 0.1 else found)
    return seen


def test_two_mediocre_sources_make_a_better_one():
    rng = np.random.default_rng(0)
    truth = [person(shift) for shift in (-180, 0, 180)]
    gaps = {'one': [], 'both': []}
    found = {'one': 0, 'both': 0}
    missing = {'one': 0, 'both': 0}
    for _ in range(60):
        sources = [sees(truth, rng) for _ in range(2)]
        results = {'one': sources[0], 'both': fuse(sources)}
        assert len(results['both']) <= 3
        for name, people in results.items():
            found[name] += len(people)
            for one in people:
                nearest = min(truth, key=lambda t, p=one: abs(
                    np.nanmedian(t.keypoints_px[:, 0] - p.keypoints_px[:, 0])))
                gap = np.linalg.norm(one.keypoints_px - nearest.keypoints_px, axis=1)
                gaps[name] += gap[one.scores > 0].tolist()
                missing[name] += int(np.count_nonzero(one.scores == 0))
    assert found['both'] > 1.08 * found['one']
    assert missing['both'] / found['both'] < 0.6 * missing['one'] / found['one']
    assert np.median(gaps['both']) < 0.95 * np.median(gaps['one'])
    assert np.percentile(gaps['both'], 90) < 0.8 * np.percentile(gaps['one'], 90)
