"""Networks that see a bright spot and put a box around it."""

import numpy as np
import pytest
from spot_networks import as_float, box_around, planes_spec, row, spot_in, spotted

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.decoders import choose_decoder


def yolox(tensor):
    """The cell of the middle grid (stride 16) that the spot is in says where exactly."""
    height, width = tensor.shape[2:]
    uv = spot_in(tensor) + 0.5
    counts = [(height // s) * (width // s) for s in (8, 16, 32)]
    out = np.zeros((1, sum(counts), 85))
    column, line = (uv // 16).astype(int)
    cell = counts[0] + line * (width // 16) + column
    out[0, cell, :2] = uv / 16 - [column, line]
    out[0, cell, 2:4] = np.log(40 / 16)
    out[0, cell, 4:6] = 0.95
    return [out]


def yolo(tensor):
    person = np.zeros(84)
    person[:6] = [*(spot_in(tensor) + 0.5), 40, 40, 0.9, 0.0]
    cat = np.array([100, 100, 40, 40, 0.0, *np.full(79, 0.9)])
    return [np.stack([person, cat], axis=1)[None]]


def yolo_suppressed(tensor):
    box = box_around(spot_in(tensor) + 0.5)
    return [np.array([[row(box, 0.9, 0), row(box, 0.8, 16)]])]


def mmdet(tensor):
    box = box_around(spot_in(tensor))
    return [np.array([[row(box, 0.9), row(box + 100, 0.9)]]), np.array([[0, 16]])]


CELLS = 80 * 80 + 40 * 40 + 20 * 20
FAMILIES = {
    'yolox': (planes_spec((1, CELLS, 85)), yolox, None),
    'yolo': (planes_spec((1, 84, 8400)), yolo, None),
    'yolo suppressed': (planes_spec((1, 300, 6)), yolo_suppressed, None),
    'rtmdet': (planes_spec((1, None, 5), (1, None)), mmdet, 'rtmdet'),
    'yolox_mmdeploy': (planes_spec((1, None), (1, None, 5)), lambda t: mmdet(t)[::-1],
                       'yolox_mmdeploy'),
}


@pytest.mark.parametrize('family', FAMILIES)
@pytest.mark.parametrize(('h', 'w'), [(480, 640), (97, 1003), (1200, 900)])
def test_a_person_gets_a_box_and_other_things_none(family, h, w):
    spec, network, name = FAMILIES[family]
    place = np.array([0.3 * w, 0.6 * h])
    decoder = choose_decoder(spec, name, 'net.onnx')
    (box,) = decoder.find_boxes(spotted(h, w, place), lambda t: as_float(network(t)))
    pixel = max(1.0, max(h, w) / 640)
    np.testing.assert_allclose(box.box_px.reshape(2, 2).mean(axis=0), place, atol=0.35 * pixel)
    side = 40 * max(h, w) / 640
    np.testing.assert_allclose(box.box_px[2:] - box.box_px[:2], side, rtol=0.02)
    assert box.score == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize(('family', 'expected'), [
    ('rtmdet', ((50 - 103.53) / 57.375, (100 - 116.28) / 57.12, (200 - 123.675) / 58.395)),
    ('yolox_mmdeploy', (50, 100, 200)), ('yolox', (50, 100, 200)),
    ('yolo', (200 / 255, 100 / 255, 50 / 255)),
])
def test_colours_arrive_in_the_order_and_range_of_the_training(family, expected):
    spec, network, name = FAMILIES[family]
    seen = []

    def run(tensor):
        seen.append(tensor)
        return as_float(network(tensor))

    image = np.full((640, 640, 3), (200, 100, 50), np.uint8)
    image[300:310, 300:310] = 255
    choose_decoder(spec, name, 'net.onnx').find_boxes(image, run)
    np.testing.assert_allclose(seen[0][0, :, 5, 5], expected, rtol=1e-5)


@pytest.mark.parametrize('family', FAMILIES)
@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 0.0, 1.0, 1e30])
def test_outputs_of_one_value_are_finite_boxes_or_none(family, value):
    spec, network, name = FAMILIES[family]
    boxes = choose_decoder(spec, name, 'net.onnx').find_boxes(
        spotted(120, 160, (80, 60)), lambda t: [np.full_like(o, value) for o in
                                                as_float(network(t))])
    assert all(np.isfinite(box.box_px).all() for box in boxes)


def test_networks_that_look_alike_are_asked_about():
    with pytest.raises(NetworkShapeError, match='rtmdet or yolox_mmdeploy') as error:
        choose_decoder(FAMILIES['rtmdet'][0], None, 'net.onnx')
    assert '\n' not in str(error.value)
