"""Networks that see a bright spot and say that everything is there: decoders must agree."""

import numpy as np
import pytest
from spot_networks import as_float, box_around, planes_spec, row, spot_in, spotted

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.decoders import DECODERS, choose_decoder
from pop_core.keypoints.network import NetworkSpec, TensorSpec

NECK = SHARED_INDEX['neck']
SIZES = [(480, 640), (640, 480), (97, 1003), (1200, 1600), (33, 17)]


def keypoints_at(uv, score=0.8):
    return np.tile([*uv, score], (17, 1))


def rtmo(tensor):
    uv = spot_in(tensor)
    return [np.array([[row(box_around(uv), 0.9)]]), keypoints_at(uv)[None, None]]


def yolo_raw(tensor):
    uv = spot_in(tensor) + 0.5  # the corner of the input is (0, 0)
    person = row(uv, [40, 40], 0.9, keypoints_at(uv))
    noise = row([10, 10, 5, 5], 0.1, keypoints_at([10, 10]))
    return [np.stack([person, noise], axis=1)[None]]


def yolo_suppressed(tensor):
    uv = spot_in(tensor) + 0.5
    person = row(box_around(uv), 0.9, 0, keypoints_at(uv))
    return [np.stack([person, 0 * person])[None]]


def movenet(tensor):
    sides = np.array([tensor.shape[2], tensor.shape[1]])
    uv = (spot_in(tensor) + 0.5) / sides
    low, high = uv - 20 / sides, uv + 20 / sides
    person = row(np.tile([uv[1], uv[0], 0.8], (17, 1)), low[::-1], high[::-1], 0.9)
    return [np.stack([person, *np.zeros((5, 56))])[None]]


FAMILIES = {
    'rtmo': (planes_spec((1, None, 5), (1, None, 17, 3)), rtmo),
    'rtmo swapped': (planes_spec((1, None, 17, 3), (1, None, 5)), lambda t: rtmo(t)[::-1]),
    'yolo raw': (planes_spec((1, 56, None)), yolo_raw),
    'yolo suppressed': (planes_spec((1, 300, 57)), yolo_suppressed),
    'yolo free': (planes_spec((1, 56, None), size=(None, None)), yolo_raw),
    'movenet': (NetworkSpec((TensorSpec('input', (1, None, None, 3), 'int32'),),
                            (TensorSpec('output_0', (1, 6, 56), 'float32'),)), movenet),
}


@pytest.mark.parametrize('family', FAMILIES)
@pytest.mark.parametrize(('h', 'w'), SIZES)
def test_what_a_network_sees_comes_back_where_it_is_in_the_image(family, h, w):
    spec, network = FAMILIES[family]
    place = np.array([0.62 * w, 0.41 * h])
    decoder = choose_decoder(spec, None, 'net.onnx')
    (person,) = decoder.detect(spotted(h, w, place), lambda tensor: as_float(network(tensor)))
    uv = np.delete(person.keypoints_px, NECK, axis=0)
    # Sampling moves the middle of a spot by less than a third of a pixel of the coarser image.
    pixel = max(1.0, max(h, w) / 640 if 'movenet' not in family else max(h, w) / 256)
    np.testing.assert_allclose(uv, np.tile(place, (14, 1)), atol=0.35 * pixel)
    np.testing.assert_allclose(person.scores, 0.8, atol=1e-6)
    np.testing.assert_allclose(
        person.box_px.reshape(2, 2).mean(axis=0), place, atol=0.35 * pixel)


@pytest.mark.parametrize(('family', 'expected'), [
    ('rtmo', (50, 100, 200)), ('yolo raw', (200 / 255, 100 / 255, 50 / 255)),
])
def test_colours_arrive_in_the_order_and_range_of_the_training(family, expected):
    seen = []
    spec, network = FAMILIES[family]

    def run(tensor):
        seen.append(tensor)
        return as_float(network(tensor))

    image = np.full((640, 640, 3), (200, 100, 50), np.uint8)
    image[300:310, 300:310] = 255
    choose_decoder(spec, None, 'net.onnx').detect(image, run)
    assert seen[0].dtype == np.float32
    np.testing.assert_allclose(seen[0][0, :, 5, 5], expected, rtol=1e-5)


def test_movenet_takes_whole_numbers_of_a_size_it_can_divide():
    spec, network = FAMILIES['movenet']
    seen = []

    def run(tensor):
        seen.append(tensor)
        return as_float(network(tensor))

    choose_decoder(spec, None, 'net.onnx').detect(spotted(480, 640, (300, 200)), run)
    assert seen[0].dtype == np.int32
    assert seen[0].shape == (1, 192, 256, 3)


@pytest.mark.parametrize('family', FAMILIES)
def test_one_person_twice_is_one_and_two_people_are_two(family):
    spec, network = FAMILIES[family]
    decoder = choose_decoder(spec, None, 'net.onnx')

    def several(tensor, shift):
        first = as_float(network(tensor))
        second = as_float(network(np.roll(tensor, shift, axis=-1 if tensor.shape[1] == 3 else 2)))
        if family == 'movenet':
            return [np.concatenate([first[0][:, :1], second[0][:, :1]], axis=1)]
        axis = 2 if 'raw' in family or 'free' in family else 1
        return [np.concatenate(pair, axis) for pair in zip(first, second, strict=True)]

    image = spotted(480, 640, (200, 240))
    assert len(decoder.detect(image, lambda tensor: several(tensor, 2))) == 1
    assert len(decoder.detect(image, lambda tensor: several(tensor, 90))) == 2


@pytest.mark.parametrize('family', FAMILIES)
@pytest.mark.parametrize('value', [np.nan, np.inf, -np.inf, 0.0, 1.0, 1e30, -1e30])
def test_outputs_of_one_value_are_nobody_or_people_of_finite_keypoints(family, value):
    spec, network = FAMILIES[family]
    decoder = choose_decoder(spec, None, 'net.onnx')
    image = spotted(120, 160, (80, 60))
    people = decoder.detect(
        image, lambda tensor: [np.full_like(o, value) for o in as_float(network(tensor))])
    for person in people:
        assert np.isfinite(person.box_px).all()
        assert np.isfinite(person.keypoints_px[person.scores > 0]).all()


def test_of_yolo_outputs_the_sides_tell_which_it_is():
    assert choose_decoder(planes_spec((1, 56, 8400)), None, 'net').raw
    assert not choose_decoder(planes_spec((1, 300, 57)), None, 'net').raw


def test_every_decoder_has_a_name_of_its_own_and_says_what_it_expects():
    assert all(name == decoder.name for name, decoder in DECODERS.items())
    expected = {decoder.expects for decoder in DECODERS.values()}
    assert len(expected) == len(DECODERS) - 1  # rtmdet and yolox_mmdeploy look alike
