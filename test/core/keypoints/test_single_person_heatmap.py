import numpy as np
import pytest

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.keypoint_sets import MPII_16
from pop_core.keypoints.network import NetworkSpec, TensorSpec
from pop_core.keypoints.single_person_heatmap import SinglePersonHeatmapDecoder, heatmap_peaks


def spec_of(*map_shapes, size=368):
    return NetworkSpec(
        (TensorSpec('image', (1, size, size, 3), 'float32'),),
        tuple(TensorSpec(f'out{i}', shape, 'float32') for i, shape in enumerate(map_shapes)))


def spots(places, rows, columns, height=0.8, sigma=2.0):
    v, u = np.mgrid[:rows, :columns]
    return np.stack([
        height * np.exp(-((u - x) ** 2 + (v - y) ** 2) / (2 * sigma**2)) for x, y in places
    ], axis=-1).astype(np.float32)


def test_peaks_are_found_finer_than_a_cell():
    places = np.random.default_rng(0).uniform(10, 80, (16, 2))
    found, heights = heatmap_peaks(spots(places, 92, 92, sigma=3.0))
    # One cell on either side of the largest is averaged: a third of the way to the true peak.
    assert np.abs(found - places).max() < 0.45
    assert (heights > 0.75).all()


def test_the_finest_map_of_sixteen_joints_is_read():
    spec = spec_of((1, 46, 46, 28), (1, 46, 46, 16), (1, 368, 368, 16))
    assert SinglePersonHeatmapDecoder.fits(spec)
    assert SinglePersonHeatmapDecoder(spec).output == 2


@pytest.mark.parametrize('spec', [
    spec_of((1, 46, 46, 17)),
    spec_of((46, 16)),
    NetworkSpec((TensorSpec('image', (1, 368, 368, 3), 'uint8'),),
                (TensorSpec('out', (1, 46, 46, 16), 'float32'),)),
    NetworkSpec((TensorSpec('image', (1, 3, 368, 368), 'float32'),),
                (TensorSpec('out', (1, 46, 46, 16), 'float32'),)),
])
def test_other_networks_do_not_fit(spec):
    assert not SinglePersonHeatmapDecoder.fits(spec)


def test_joints_come_back_in_pixels_of_the_image_without_a_head():
    places = np.random.default_rng(1).uniform(100, 260, (16, 2))
    heat = spots(places, 368, 368, sigma=6.0)
    decoder = SinglePersonHeatmapDecoder(spec_of((1, 368, 368, 16)))
    (person,) = decoder.detect(np.zeros((736, 736, 3), np.uint8), lambda _: [heat[None]])
    for channel, name in enumerate(MPII_16.names):
        if name in SHARED_INDEX and name != 'neck':
            expected = (places[channel] + 0.5) * 2 - 0.5
            np.testing.assert_allclose(
                person.keypoints_px[SHARED_INDEX[name]], expected, atol=1.0)
    assert person.scores[SHARED_INDEX['head']] == 0.0


def test_a_small_person_is_looked_at_again_from_near():
    looks = []

    def run(tensor):
        looks.append(tensor.shape)
        places = np.random.default_rng(2).uniform(150, 210, (16, 2))
        return [spots(places, 368, 368, sigma=4.0)[None]]

    decoder = SinglePersonHeatmapDecoder(spec_of((1, 368, 368, 16)))
    (person,) = decoder.detect(np.zeros((480, 640, 3), np.uint8), run)
    assert looks == [(1, 368, 368, 3)] * 2
    spread = np.ptp(person.keypoints_px[person.scores > 0], axis=0)
    # 60 of 368 cells of a crop of less than half the image.
    assert (spread < 40).all()


def test_flat_maps_hold_nobody():
    decoder = SinglePersonHeatmapDecoder(spec_of((1, 46, 46, 16)))
    flat = np.full((1, 46, 46, 16), 0.05, np.float32)
    assert decoder.detect(np.zeros((100, 100, 3), np.uint8), lambda _: [flat]) == []


def test_the_image_is_normalised_as_the_network_was_trained():
    seen = []

    def run(tensor):
        seen.append(tensor)
        return [np.zeros((1, 46, 46, 16), np.float32)]

    decoder = SinglePersonHeatmapDecoder(spec_of((1, 46, 46, 16), size=64))
    decoder.detect(np.full((64, 64, 3), (255, 0, 128), np.uint8), run)
    expected = [(1 - 0.485) / 0.229, -0.456 / 0.224, (128 / 255 - 0.406) / 0.225]
    np.testing.assert_allclose(seen[0][0, 5, 5], expected, rtol=1e-5)
    assert seen[0].dtype == np.float32
