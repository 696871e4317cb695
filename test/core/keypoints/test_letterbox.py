import cv2
import numpy as np
import pytest

from pop_core.keypoints.letterbox import letterbox

SIZES = [(480, 640, 481, 641), (480, 640, 256, 192), (90, 160, 368, 368), (720, 405, 256, 320)]


@pytest.mark.parametrize(('h', 'w', 'height', 'width'), SIZES)
def test_a_spot_of_the_image_lies_where_the_mapping_says(h, w, height, width):
    spot = np.array([w * 0.3, h * 0.7])
    v, u = np.mgrid[:h, :w]
    spread = 0.03 * h
    bright = 255 * np.exp(-((u - spot[0]) ** 2 + (v - spot[1]) ** 2) / (2 * spread**2))
    rgb = np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)
    image, placed = letterbox(rgb, height, width)
    weight = image[..., 0].astype(float)
    v, u = np.mgrid[:height, :width]
    centre = np.array([(weight * u).sum(), (weight * v).sum()]) / weight.sum()
    # Resampling moves a smooth spot by far less than a tenth of a pixel.
    tolerance_px = 0.1 / min(placed.factor_u, placed.factor_v)
    np.testing.assert_allclose(placed.to_image(centre[None])[0], spot, atol=tolerance_px)


def test_the_border_of_the_image_meets_the_border_of_its_place():
    image, placed = letterbox(np.full((100, 200, 3), 255, np.uint8), 64, 64)
    assert image.shape == (64, 64, 3)
    rows = np.flatnonzero(image[:, 32, 0])
    edges = placed.to_image(np.array([[-0.5, rows[0] - 0.5], [63.5, rows[-1] + 0.5]]))
    np.testing.assert_allclose(edges, [[-0.5, -0.5], [199.5, 99.5]], atol=1e-9)


def test_an_image_may_lie_in_the_corner():
    rgb = np.full((100, 200, 3), 255, np.uint8)
    image, placed = letterbox(rgb, 64, 64, 114, centred=False)
    assert (image[:32] == 255).all()
    assert (image[32:] == 114).all()
    np.testing.assert_allclose(placed.to_image(np.array([[-0.5, -0.5]])), [[-0.5, -0.5]])


def test_an_image_that_nearly_fits_is_not_resampled():
    rgb = np.random.default_rng(1).integers(0, 255, (480, 640, 3)).astype(np.uint8)
    image, _ = letterbox(rgb, 481, 641)
    top = np.flatnonzero(image.any(axis=(1, 2)))[0]
    left = np.flatnonzero(image.any(axis=(0, 2)))[0]
    assert np.array_equal(image[top: top + 480, left: left + 640], rgb)


def test_shrinking_averages_rather_than_skips():
    stripes = np.zeros((64, 64, 3), np.uint8)
    stripes[:, ::2] = 255
    image, _ = letterbox(stripes, 16, 16)
    assert image.min() > 100
    assert cv2.mean(image)[0] == pytest.approx(127.5, abs=2.0)
