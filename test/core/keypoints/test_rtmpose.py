import numpy as np
import pytest
from spot_networks import spot_in, spotted

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.box_crop import crop_box
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.decoders import choose_decoder
from pop_core.keypoints.network import NetworkSpec, TensorSpec

NECK = SHARED_INDEX['neck']


def spec_of(count=17, size=(256, 192), ratio=2, *, rows_first=False):
    outputs = [TensorSpec('simcc_x', (None, count, ratio * size[1]), 'float32'),
               TensorSpec('simcc_y', (None, count, ratio * size[0]), 'float32')]
    if rows_first:
        outputs.reverse()
    return NetworkSpec((TensorSpec('input', (None, 3, *size), 'float32'),), tuple(outputs))


def simcc(tensor, count=17, ratio=2, score=0.7):
    """A network that sees every keypoint at the spot."""
    u, v = np.rint(spot_in(tensor) * ratio).astype(int)
    columns = np.zeros((1, count, ratio * tensor.shape[3]), np.float32)
    rows = np.zeros((1, count, ratio * tensor.shape[2]), np.float32)
    columns[..., u], rows[..., v] = score, score + 0.2
    return [columns, rows]


def spotted_tensor(shape):
    """An input with its spot in the middle."""
    tensor = np.zeros(shape, np.float32)
    tensor[..., shape[2] // 2, shape[3] // 2] = 1.0
    return tensor


@pytest.mark.parametrize('count', [17, 26, 133])
@pytest.mark.parametrize('rows_first', [False, True])
def test_what_is_seen_in_a_box_comes_back_where_it_is_in_the_image(count, rows_first):
    decoder = choose_decoder(spec_of(count, rows_first=rows_first), None, 'net.onnx')
    place = np.array([305.0, 222.0])
    box = PersonBox(np.array([250.0, 150.0, 350.0, 400.0]), 0.9)

    def run(tensor):
        outputs = simcc(tensor, count)
        return outputs[::-1] if rows_first else outputs

    (person,) = decoder.detect_in(spotted(480, 640, place), [box], run)
    uv = np.delete(person.keypoints_px, NECK, axis=0)
    # 1.6 pixels of the image per pixel of the input, bins of half a pixel.
    np.testing.assert_allclose(uv, np.tile(place, (14, 1)), atol=0.8)
    np.testing.assert_allclose(person.scores, 0.7, atol=1e-6)  # the less certain axis


def test_the_network_sees_red_green_blue_as_imagenet_was_normalised():
    """Jiang et al. 2023: (RGB - mean) / deviation; black around the image is that of bytes."""
    seen = []

    def run(tensor):
        seen.append(tensor)
        return simcc(spotted_tensor(tensor.shape))

    image = np.zeros((400, 300, 3), np.uint8)
    image[:] = (255, 128, 0)
    choose_decoder(spec_of(), None, 'net.onnx').detect_in(
        image, [PersonBox(np.array([50.0, 50.0, 250.0, 350.0]), 0.9)], run)
    (tensor,) = seen
    assert tensor.shape == (1, 3, 256, 192)
    mean, deviation = (123.675, 116.28, 103.53), (58.395, 57.12, 57.375)
    wanted = [(c - m) / d for c, m, d in zip((255, 128, 0), mean, deviation, strict=True)]
    np.testing.assert_allclose(tensor[0, :, 128, 96], wanted, atol=0.02)


def test_every_box_is_one_person():
    decoder = choose_decoder(spec_of(), None, 'net.onnx')
    boxes = [PersonBox(np.array([u, 100.0, u + 80, 300.0]), 0.9) for u in (50.0, 200.0, 400.0)]
    image = np.maximum.reduce([spotted(480, 640, (u, 200)) for u in (90, 240, 440)])
    found = decoder.detect_in(image, boxes, simcc)
    assert [round(float(p.keypoints_px[0, 0])) for p in found] == pytest.approx([90, 240, 440], 1)


def test_boxes_outside_of_the_image_and_of_no_size_are_nobody():
    decoder = choose_decoder(spec_of(), None, 'net.onnx')
    bad = [(-50.0, 10, -10, 90), (700, 10, 800, 90), (10, 10, 10, 90), (90, 90, 10, 10),
           (np.nan, 0, 10, 10), (-np.inf, 0, np.inf, 10)]
    boxes = [PersonBox(np.array(box, float), 0.9) for box in bad]
    assert decoder.detect_in(np.zeros((480, 640, 3), np.uint8), boxes, simcc) == []


@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 0.0, -1.0])
def test_outputs_without_a_peak_are_nobody(value):
    decoder = choose_decoder(spec_of(), None, 'net.onnx')
    box = PersonBox(np.array([50.0, 50.0, 100.0, 150.0]), 0.9)
    outputs = [np.full((1, 17, bins), value, np.float32) for bins in (384, 512)]
    found = decoder.detect_in(np.zeros((480, 640, 3), np.uint8), [box], lambda _: outputs)
    assert found == []


@pytest.mark.parametrize('spec', [
    spec_of(18), spec_of(5),
    NetworkSpec((TensorSpec('input', (1, 3, 256, 192), 'float32'),),
                (TensorSpec('x', (1, 17, 384), 'float32'), TensorSpec('y', (1, 17, 384),
                                                                     'float32'))),
])
def test_other_networks_do_not_fit(spec):
    assert not type(choose_decoder(spec_of(), None, 'n')).fits(spec)


@pytest.mark.parametrize('box', [
    (100, 100, 200, 300), (-40, -30, 60, 90), (600, 400, 700, 500), (0, 0, 640, 480),
    (10, 200, 630, 210), (300.4, 10.7, 300.9 + 1, 470),
])
def test_a_crop_shows_the_box_where_it_says(box):
    v, u = np.mgrid[:480, :640]
    rgb = np.stack([u * 255 / 639, v * 255 / 479, 0 * u + 255], axis=-1).astype(np.uint8)
    image, crop = crop_box(rgb, np.array(box, float), 256, 192)
    assert image.shape == (256, 192, 3)
    v, u = np.mgrid[:256, :192]
    uv = crop.to_image(np.column_stack([u.ravel(), v.ravel()]).astype(float))
    inside = np.all((uv > 2) & (uv < [637, 477]), axis=1) & (image[..., 2].ravel() == 255)
    shown = image.reshape(-1, 3)[inside, :2] / 255 * [639, 479]
    # A grey value is up to 2.5 pixels wide, and cut to whole numbers twice.
    np.testing.assert_allclose(shown, uv[inside], atol=5.0)
    low, high = np.clip(box[:2], 0, [639, 479]), np.clip(box[2:], 0, [639, 479])
    assert (uv.min(axis=0) <= low).all()
    assert (uv.max(axis=0) >= high).all()


def test_a_crop_keeps_the_aspect():
    flat = np.array([10.0, 200.0, 630.0, 210.0])
    _, crop = crop_box(np.zeros((480, 640, 3), np.uint8), flat, 256, 192)
    assert crop.placed.factor_u == pytest.approx(crop.placed.factor_v, rel=0.01)
