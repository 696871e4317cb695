import numpy as np
import pytest
from personlab_maps import perfect_maps, standing
from support.onnx_files import save_network

from pop_core.errors import NetworkShapeError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.onnx_detector import load_source
from pop_core.rgbd import RgbdFrame


def personlab_outputs(people):
    maps = perfect_maps(people)
    logits = np.log((maps.scores + 1e-6) / (1 - maps.scores + 1e-6)).astype(np.float32)
    return {'heat': logits[None], 'short': maps.short.reshape(1, 31, 41, 34),
            'mid': maps.mid.reshape(1, 31, 41, 64)}


def frame_of(depth_m):
    camera = Camera(641, 481, 525.0, 525.0, 320.0, 240.0)
    rgb = np.zeros((481, 641, 3), np.uint8)
    return RgbdFrame(rgb, np.full((481, 641), depth_m, np.float32), camera)


def test_a_network_of_known_outputs_gives_its_people(tmp_path):
    people = [standing(150, 240, 300), standing(450, 240, 300)]
    path = save_network(tmp_path / 'net.onnx', personlab_outputs(people))
    # 300 px are a standing body between nose and ankles, 1.5 m, at 525 * 1.5 / 300 m.
    found = load_source(path).detect(frame_of(2.6))
    assert len(found) == 2
    left = min(found, key=lambda person: person.keypoints_px[0, 0])
    expected = people[0][[11, 12]].mean(axis=0)[::-1]
    np.testing.assert_allclose(left.keypoints_px[0], expected, atol=0.1)


def test_people_of_impossible_size_are_no_people(tmp_path):
    path = save_network(tmp_path / 'net.onnx', personlab_outputs([standing(300, 240, 300)]))
    assert load_source(path).detect(frame_of(9.0)) == []


def test_people_without_depth_are_no_people(tmp_path):
    path = save_network(tmp_path / 'net.onnx', personlab_outputs([standing(300, 240, 300)]))
    assert load_source(path).detect(frame_of(np.nan)) == []


def test_outputs_of_another_shape_are_told_beside_what_was_expected(tmp_path):
    path = save_network(tmp_path / 'net.onnx', {'out': np.zeros((1, 5, 7), np.float32)})
    with pytest.raises(NetworkShapeError) as error:
        load_source(path)
    message = str(error.value)
    assert message.startswith(str(path))
    assert 'personlab' in message
    assert 'out (1, 5, 7) float32' in message
    assert '\n' not in message


def test_a_named_decoder_must_fit(tmp_path):
    path = save_network(tmp_path / 'net.onnx', {'out': np.zeros((1, 5, 7), np.float32)})
    with pytest.raises(NetworkShapeError, match='expected personlab: one input'):
        load_source(path, 'personlab')


def test_an_unknown_decoder_is_told_with_the_known_ones(tmp_path):
    path = save_network(tmp_path / 'net.onnx', personlab_outputs([standing(300, 240, 300)]))
    with pytest.raises(NetworkShapeError, match=r'expected a decoder of .*personlab'):
        load_source(path, 'tea leaves')


def test_a_float_image_does_not_fit_a_network_of_bytes(tmp_path):
    outputs = personlab_outputs([standing(300, 240, 300)])
    path = save_network(tmp_path / 'net.onnx', outputs, input_kind='float32')
    with pytest.raises(NetworkShapeError, match='float32'):
        load_source(path)


@pytest.mark.parametrize('content', [b'', b'no network at all', bytes(range(256)) * 40])
def test_a_file_that_is_no_network_is_told_in_one_line(tmp_path, content):
    (tmp_path / 'net.onnx').write_bytes(content)
    with pytest.raises(NetworkShapeError, match='expected an ONNX network') as error:
        load_source(tmp_path / 'net.onnx')
    assert '\n' not in str(error.value)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(NetworkShapeError, match='expected an ONNX file'):
        load_source(tmp_path / 'none.onnx')
