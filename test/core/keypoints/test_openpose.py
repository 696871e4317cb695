import numpy as np
import pytest
from openpose_maps import perfect_maps

from pop_core.body.joints import SHARED_INDEX, SHARED_NAMES
from pop_core.keypoints.decoders import choose_decoder
from pop_core.keypoints.network import NetworkSpec, TensorSpec
from pop_core.keypoints.openpose import BODY_25_FIELDS, COCO_18_FIELDS
from pop_core.keypoints.paf_grouping import Candidates, find_peaks, group_people, limb_scores

H, W = 46, 62
# A standing person in units of the height, middle of the body at the origin.
STANDING = {
    'nose': (0, -0.45), 'neck': (0, -0.33), 'right_shoulder': (-0.09, -0.33),
    'right_elbow': (-0.12, -0.18), 'right_wrist': (-0.13, -0.04), 'left_shoulder': (0.09, -0.33),
    'left_elbow': (0.12, -0.18), 'left_wrist': (0.13, -0.04), 'pelvis': (0, 0),
    'right_hip': (-0.06, 0), 'right_knee': (-0.065, 0.22), 'right_ankle': (-0.07, 0.44),
    'left_hip': (0.06, 0), 'left_knee': (0.065, 0.22), 'left_ankle': (0.07, 0.44),
}
LAYOUTS = [BODY_25_FIELDS, COCO_18_FIELDS]


def standing(u, v, height):
    return {name: np.array([u, v]) + height * np.array(xy) for name, xy in STANDING.items()}


def network_of(people, layout, *, together):
    heat, fields = perfect_maps(people, layout, (H, W))
    if together:
        return [np.concatenate([heat, fields])[None]]
    return [0 * heat[None], 0 * fields[None], heat[None], fields[None]]


def spec_of(layout, *, together, size=(8 * H, 8 * W)):
    counts = [layout.heat + layout.fields] if together else [layout.heat, layout.fields] * 2
    outputs = tuple(TensorSpec(f'o{i}', (1, c, None, None), 'float32')
                    for i, c in enumerate(counts))
    return NetworkSpec((TensorSpec('image', (1, 3, *size), 'float32'),), outputs)


# Pairs of keypoints and channels of their fields as OpenPose publishes them (its pose parameters),
# limbs of the face and the feet left out.
PUBLISHED = {
    'BODY_25': (
        [1, 8, 1, 2, 1, 5, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9, 9, 10, 10, 11, 8, 12, 12, 13, 13, 14, 1,
         0],
        [0, 1, 14, 15, 22, 23, 16, 17, 18, 19, 24, 25, 26, 27, 6, 7, 2, 3, 4, 5, 8, 9, 10, 11, 12,
         13, 30, 31]),
    'COCO-18': (
        [1, 2, 1, 5, 2, 3, 3, 4, 5, 6, 6, 7, 1, 8, 8, 9, 9, 10, 1, 11, 11, 12, 12, 13, 1, 0],
        [12, 13, 20, 21, 14, 15, 16, 17, 22, 23, 24, 25, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 28,
         29]),
}


@pytest.mark.parametrize('layout', LAYOUTS, ids=lambda layout: layout.keypoints.name)
def test_fields_are_those_that_openpose_publishes(layout):
    pairs, channels = PUBLISHED[layout.keypoints.name]
    limbs = [value for limb in layout.limbs for value in (limb.first, limb.second)]
    fields = [value for limb in layout.limbs for value in (limb.field, limb.field + 1)]
    assert limbs == pairs
    assert fields == channels


@pytest.mark.parametrize('together', [True, False])
@pytest.mark.parametrize('layout', LAYOUTS, ids=lambda layout: layout.keypoints.name)
def test_people_come_back_from_perfect_maps(layout, together):
    people = [standing(15, 23, 34), standing(40.3, 21.6, 30)]
    decoder = choose_decoder(spec_of(layout, together=together), None, 'net.onnx')
    outputs = network_of(people, layout, together=together)
    image = np.zeros((8 * H, 8 * W, 3), np.uint8)  # network pixels are the image's
    found = decoder.detect(image, lambda _: outputs)
    assert len(found) == 2
    left, right = sorted(found, key=lambda person: person.keypoints_px[0, 0])
    for detection, person in ((left, people[0]), (right, people[1])):
        for name in set(SHARED_NAMES) - {'head', 'neck', 'pelvis'}:
            expected = (person[name] + 0.5) * 8 - 0.5
            # A quarter of a cell: the other side's maximum bends the tails of a peak.
            np.testing.assert_allclose(
                detection.keypoints_px[SHARED_INDEX[name]], expected, atol=2.0)
        nose = (person['nose'] + 0.5) * 8 - 0.5
        np.testing.assert_allclose(detection.keypoints_px[SHARED_INDEX['head']], nose, atol=2.0)


@pytest.mark.parametrize('layout', LAYOUTS, ids=lambda layout: layout.keypoints.name)
def test_crossing_people_keep_their_own_limbs(layout):
    # The second stands half a shoulder's width beside the first, and higher.
    people = [standing(28, 24, 36), standing(33, 21, 36)]
    heat, fields = perfect_maps(people, layout, (H, W))
    found = group_people(heat[:-1], fields, layout.limbs)
    assert len(found) == 2
    for person in people:
        errors = [
            max(np.hypot(*(f[row, :2] - person[name])) for row, name in
                enumerate(layout.keypoints.names) if name in person and f[row, 2] > 0)
            for f in found]
        assert min(errors) < 1.5
        assert max(errors) > 3.0


def test_somebody_without_a_head_is_found_from_the_hips_down():
    person = {name: uv for name, uv in standing(30, 10, 36).items()
              if name.split('_')[-1] in ('pelvis', 'hip', 'knee', 'ankle')}
    heat, fields = perfect_maps([person], BODY_25_FIELDS, (H, W))
    (found,) = group_people(heat[:-1], fields, BODY_25_FIELDS.limbs)
    assert np.count_nonzero(found[:, 2]) == len(person)


def test_peaks_lie_between_cells():
    places = np.random.default_rng(0).uniform(6, 40, (30, 2))
    v, u = np.mgrid[:H, :W]
    for place in places:
        squared = (u - place[0]) ** 2 + (v - place[1]) ** 2
        peaks = find_peaks(np.exp(-squared / 2.0).astype(np.float32))
        assert len(peaks.scores) == 1
        np.testing.assert_allclose(peaks.uv[0], place, atol=1e-3)  # exact for Gaussians


def test_a_limb_turned_around_does_not_count():
    heat, fields = perfect_maps([standing(30, 23, 36)], BODY_25_FIELDS, (H, W))
    a = find_peaks(heat[1])
    b = find_peaks(heat[8])
    assert limb_scores(a, b, fields[0], fields[1])[0, 0] > 0.9
    assert limb_scores(b, a, fields[0], fields[1])[0, 0] == 0.0


def test_a_limb_of_no_length_does_not_count():
    here = Candidates(np.array([[5.0, 5.0]]), np.array([1.0]))
    field = np.ones((H, W), np.float32)
    assert limb_scores(here, here, field, field)[0, 0] == 0.0


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 0.0, 0.5, 1.0, 1e30])
def test_maps_of_one_value_are_read_at_once(value):
    decoder = choose_decoder(spec_of(BODY_25_FIELDS, together=True), None, 'net.onnx')
    people = decoder.detect(np.zeros((100, 100, 3), np.uint8),
                            lambda _: [np.full((1, 78, H, W), value, np.float32)])
    assert all(np.isfinite(p.keypoints_px[p.scores > 0]).all() for p in people)


def test_noise_is_nobody_of_weight_and_takes_no_time():
    rng = np.random.default_rng(0)
    decoder = choose_decoder(spec_of(BODY_25_FIELDS, together=True), None, 'net.onnx')
    noise = rng.normal(0, 0.3, (1, 78, H, W)).astype(np.float32)
    people = decoder.detect(np.zeros((100, 100, 3), np.uint8), lambda _: [noise])
    assert all(np.count_nonzero(p.scores) < 12 for p in people)


@pytest.mark.parametrize(('h', 'w', 'expected'), [
    (480, 640, (368, 496)), (640, 480, (368, 272)), (1, 4000, (368, 1472)), (4000, 1, (368, 96)),
])
def test_free_inputs_take_the_aspect_of_the_image(h, w, expected):
    seen = []

    def run(tensor):
        seen.append(tensor.shape[2:])
        return [np.zeros((1, 78, tensor.shape[2] // 8, tensor.shape[3] // 8), np.float32)]

    spec = spec_of(BODY_25_FIELDS, together=True, size=(None, None))
    assert choose_decoder(spec, None, 'n').detect(np.zeros((h, w, 3), np.uint8), run) == []
    assert seen == [expected]


def test_colours_arrive_as_openpose_was_trained():
    seen = []

    def run(tensor):
        seen.append(tensor)
        return [np.zeros((1, 78, H, W), np.float32)]

    decoder = choose_decoder(spec_of(BODY_25_FIELDS, together=True), None, 'n')
    decoder.detect(np.full((8 * H, 8 * W, 3), (255, 128, 0), np.uint8), run)
    np.testing.assert_allclose(seen[0][0, :, 9, 9], [-0.5, 0.0, 127 / 256], atol=1e-6)
