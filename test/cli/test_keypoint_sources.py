"""What `--keypoints` understands."""

from pathlib import Path

import numpy as np
import pytest
from cli.conftest import write_frame
from support.onnx_files import save_network

from pop_core.config import PipelineConfig
from pop_core.errors import NetworkShapeError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.depth_net import load_depth_net
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.fusion import FusedDetector
from pop_core.keypoints.onnx_detector import OnnxKeypointDetector
from pop_core.rgbd import RgbdFrame
from pop_core.settings import apply_settings
from pop_ros.fit_keypoints import FrameKeypoints
from pop_ros.frame_folder import FrameFolder, load_frame
from pop_ros.keypoint_sources import SourceError, make_detector, reasons, split_sources
from pop_ros.node_arguments import parse_arguments
from pop_ros.sources import make_pipeline


def zeros(*shape):
    return np.zeros(shape, np.float32)


@pytest.fixture
def networks(tmp_path):
    """Networks that see nobody, of every kind."""
    outputs = {
        'people': {'dets': zeros(1, 4, 5), 'keypoints': zeros(1, 4, 17, 3)},
        'top_down': {'simcc_x': zeros(1, 17, 128), 'simcc_y': zeros(1, 17, 128)},
        'boxes': {'out': zeros(1, 84, 100)},
        'either': {'heat': zeros(1, 16, 16, 16)},
        'alike': {'dets': zeros(1, 4, 5), 'labels': np.zeros((1, 4), np.int64)},
    }
    shapes = {'either': (1, 64, 64, 3)}
    return {name: str(save_network(
        tmp_path / f'{name}.onnx', arrays, shapes.get(name, (1, 3, 64, 64)), 'float32'))
        for name, arrays in outputs.items()}


def test_one_network_is_itself(networks):
    detector = make_detector(networks['people'])
    assert isinstance(detector, OnnxKeypointDetector)
    assert len(reasons(detector)) == 1
    assert 'read as rtmo' in reasons(detector)[0]


def test_files_and_folders_may_be_named_by_text_and_by_path(networks, tmp_path):
    assert isinstance(make_detector(Path(networks['people'])), OnnxKeypointDetector)
    assert make_detector('json', str(tmp_path)).folder == tmp_path


@pytest.mark.parametrize('detector', ['depth', FrameKeypoints, None])
def test_a_pipeline_of_no_detector_is_refused_before_anything_is_loaded(detector):
    with pytest.raises(SourceError, match=r'expected a detector with detect\(frame\)'):
        make_pipeline(detector)


def test_sources_of_all_kinds_find_their_part(networks):
    detector = make_detector(','.join(networks[k] for k in ('top_down', 'people', 'boxes')))
    assert isinstance(detector, FusedDetector)
    assert [len(part) for part in (detector.people, detector.boxes, detector.top_down)] == [1] * 3
    read = ' '.join(reasons(detector))
    for name in ('rtmo', 'yolo_boxes', 'rtmpose'):
        assert f'read as {name}' in read


def test_boxes_and_a_network_that_looks_into_them_find_people(networks):
    detector = make_detector(f'{networks["boxes"]}, {networks["top_down"]}')
    assert isinstance(detector, KeypointDetector)
    assert detector.people == ()


@pytest.mark.parametrize(('kinds', 'people', 'top_down'), [
    (['either', 'people'], 'rtmo', 'single_person_heatmap'),
    (['top_down', 'either'], 'single_person_heatmap', 'rtmpose'),
])
def test_who_finds_people_anywhere_gets_boxes_if_there_are_any(networks, kinds, people, top_down):
    detector = make_detector(','.join(networks[kind] for kind in kinds))
    assert [source.decoder.name for source in detector.people] == [people]
    assert [source.decoder.name for source in detector.top_down] == [top_down]
    alone = make_detector(networks['either'])
    assert not isinstance(alone, FusedDetector)


@pytest.mark.parametrize(('kinds', 'message'), [
    (['boxes'], 'looks into boxes'), (['boxes', 'people'], 'looks into boxes'),
])
def test_boxes_that_nobody_looks_into_are_told(networks, kinds, message):
    with pytest.raises(SourceError, match=message):
        make_detector(','.join(networks[kind] for kind in kinds))


@pytest.mark.parametrize('spec', ['', ',', 'a.onnx,', 'json,json', 'none.onnx', 'names', '@'])
def test_what_is_no_source_is_told_in_one_line(spec, tmp_path):
    with pytest.raises(SourceError) as error:
        make_detector(spec, tmp_path)
    assert str(error.value).startswith('keypoints: expected')
    assert '\n' not in str(error.value)


def test_a_decoder_is_named_before_the_network(networks):
    with pytest.raises(NetworkShapeError, match='rtmdet or yolox_mmdeploy'):
        make_detector(f'{networks["alike"]},{networks["top_down"]}')
    detector = make_detector(f'rtmdet@{networks["alike"]},{networks["top_down"]}')
    assert 'read as rtmdet' in ' '.join(reasons(detector))


def test_a_decoder_apart_is_for_the_only_network(networks, tmp_path):
    assert make_detector(networks['people'], decoder='rtmo').decoder.name == 'rtmo'
    with pytest.raises(NetworkShapeError, match='expected yolo_pose'):
        make_detector(networks['people'], decoder='yolo_pose')
    with pytest.raises(SourceError, match='DECODER@NETWORK'):
        make_detector(f'{networks["people"]},{networks["boxes"]}', decoder='rtmo')
    (tmp_path / 'json').mkdir()
    assert make_detector(f'json,{networks["people"]}', tmp_path / 'json', 'rtmo')


def test_a_file_whose_name_has_a_comma_is_one_source(networks, tmp_path):
    path = tmp_path / 'a,b.onnx'
    path.write_bytes((tmp_path / 'people.onnx').read_bytes())
    assert split_sources(str(path)) == [str(path)]
    assert isinstance(make_detector(str(path)), OnnxKeypointDetector)


def test_the_node_takes_sources_given_twice_or_with_commas():
    for arguments in (['--keypoints', 'a.onnx', '--keypoints', 'json'],
                      ['--keypoints', 'a.onnx,json']):
        assert parse_arguments(arguments).sources.keypoints == 'a.onnx,json'
    again = parse_arguments(parse_arguments(['--keypoints', 'a,b']).sources.as_flags())
    assert again.sources.keypoints == 'a,b'


def test_a_frames_own_file_is_merged_with_a_network(networks, scene, tmp_path):
    frame, person = scene
    folder = FrameFolder(write_frame(tmp_path / 'one', frame, [person]), Path('one'))
    source = FrameKeypoints(f'json,{networks["people"]}', None)
    source.choose(folder)
    (found,) = source.detect(frame)
    assert isinstance(found, Detection)
    np.testing.assert_allclose(found.scores, person.scores, atol=1e-3)


def test_a_frame_without_a_file_is_told(scene, networks, tmp_path):
    frame, _ = scene
    folder = FrameFolder(write_frame(tmp_path / 'one', frame, None), Path('one'))
    for spec in ('json', f'json,{networks["people"]}'):
        source = FrameKeypoints(spec, None)
        source.choose(folder)
        with pytest.raises(SourceError, match=r'expected keypoints\.json'):
            source.detect(frame)


def test_a_frame_without_a_file_is_left_to_the_embedded_network(scene, tmp_path):
    frame, _ = scene
    folder = FrameFolder(write_frame(tmp_path / 'one', frame, None), Path('one'))
    source = FrameKeypoints(None, None)
    source.choose(folder)
    found, expected = source.detect(frame), load_depth_net().detect(frame)
    assert len(found) == len(expected) > 0
    np.testing.assert_array_equal(found[0].keypoints_px, expected[0].keypoints_px)


def test_settings_reach_the_embedded_network_that_nobody_named(tmp_path):
    seen = RgbdFrame(
        np.zeros((60, 80, 3), np.uint8), np.full((60, 80), 2.0, np.float32),
        Camera(80, 60, 65.0, 65.0, 39.5, 29.5))
    folder = write_frame(tmp_path / 'frame', seen, None)
    config = apply_settings(PipelineConfig(), {'depth_net.min_person_score': 0.9})
    keypoints = FrameKeypoints(None, None, config)
    keypoints.choose(FrameFolder(folder, Path('frame')))
    assert keypoints.detect(load_frame(folder)) == []
    assert keypoints._file._depth.config == config.depth_net
