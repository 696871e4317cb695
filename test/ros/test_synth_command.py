import cv2
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from pop_core.keypoints.openpose_json import read_openpose_json
from pop_ros.bag_reader import BagReader
from pop_ros.synth_command import synth


def invoke(*arguments):
    app = typer.Typer()
    app.command()(synth)
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_scenes_are_written_one_folder_each(tmp_path):
    result = invoke('--count', 2, '--seed', 30, '--out', tmp_path)
    assert result.exit_code == 0, result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {'scene_000030', 'scene_000031', 'contact_sheet.png'}
    files = {path.name for path in (tmp_path / 'scene_000030').iterdir()}
    assert files == {'color.png', 'depth.png', 'camera.json', 'keypoints.json', 'truth.npz'}


def test_scenes_are_drawn_with_the_sensor_that_was_asked_for(tmp_path):
    depths = []
    for sensor in ('perfect', 'stereo'):
        out = tmp_path / sensor
        result = invoke('--count', 1, '--seed', 30, '--sensor', sensor, '--out', out)
        assert result.exit_code == 0, result.output
        depths.append(cv2.imread(str(out / 'scene_000030' / 'depth.png'), cv2.IMREAD_UNCHANGED))
    holes = [(depth == 0).mean() for depth in depths]
    assert holes[0] < holes[1]


def test_the_wide_set_holds_empty_rooms_and_crowds(tmp_path):
    result = invoke('--count', 6, '--seed', 30, '--wide', '--sensor', 'perfect', '--out', tmp_path)
    assert result.exit_code == 0, result.output
    people = [len(np.load(path)['joints']) for path in tmp_path.glob('*/truth.npz')]
    assert len(people) == 6
    assert max(people) > 3
    refused = invoke('--wide', '--sequence', 'camera', '--out', tmp_path / 'film')
    assert refused.exit_code == 2


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp('synth')
    result = invoke('--count', 3, '--sequence', 'camera', '--rate', 3, '--out', folder)
    assert result.exit_code == 0, result.output
    return folder


def test_a_recording_is_a_bag_as_a_camera_driver_writes_it(recording):
    with BagReader(recording / 'recording') as bag:
        counts = {topic.kind.rsplit('/', 1)[-1]: topic.count for topic in bag.topics}
        infos = [m.read() for m in bag.messages(['/camera/color/camera_info'])]
    assert counts == {'Image': 3, 'CameraInfo': 3, 'TFMessage': 3}
    stamps = [info.header.stamp.sec + info.header.stamp.nanosec * 1e-9 for info in infos]
    assert np.diff(stamps) == pytest.approx(1 / 3, abs=1e-6)


def test_keypoints_are_named_by_the_stamps_of_the_images(recording):
    stamps = np.load(recording / 'truth.npz')['stamp_ns']
    assert {int(path.stem) for path in (recording / 'keypoints').iterdir()} == set(stamps)
    people = read_openpose_json(recording / 'keypoints' / f'{stamps[1]}.json')
    assert len(people) == 1


def test_tf_tells_where_the_moving_camera_is(recording):
    truth = np.load(recording / 'truth.npz')
    with BagReader(recording / 'recording') as bag:
        found = [m.read().transforms[0] for m in bag.messages(['/tf'])]
    p = np.array([[f.transform.translation.x, f.transform.translation.y,
                   f.transform.translation.z] for f in found])
    assert np.allclose(p, truth['T_map_camera'][:, :3, 3])
    assert np.linalg.norm(p[1] - p[0]) > 0.05
    assert (found[0].header.frame_id, found[0].child_frame_id) == (
        'map', 'camera_color_optical_frame')


def test_the_map_has_z_up_and_people_on_its_floor(recording):
    truth = np.load(recording / 'truth.npz')
    ankles = np.einsum('fij,fnj->fni', truth['T_map_camera'][:, :3, :3],
                       truth['joints'][:, [7, 8]]) + truth['T_map_camera'][:, None, :3, 3]
    assert ankles[..., 2].min(axis=1) == pytest.approx(0.08, abs=0.06)


def test_masks_show_who_is_where(recording):
    truth = np.load(recording / 'truth.npz')
    for row in range(3):
        labels = cv2.imread(
            str(recording / 'masks' / f'{truth["stamp_ns"][row]}.png'), cv2.IMREAD_UNCHANGED)
        assert set(np.unique(labels)) == {0, 1}
        v, u = np.nonzero(labels)
        assert abs(u.mean() - 320) < 320
        assert len(v) > 5000


def test_a_recording_is_never_written_over(recording):
    result = invoke('--count', 2, '--sequence', 'still', '--out', recording)
    assert result.exit_code != 0
    assert 'found one there already' in str(result.exception)


def test_an_unknown_kind_is_told_the_known_ones(tmp_path):
    result = invoke('--sequence', 'dancing', '--out', tmp_path)
    assert result.exit_code == 2
    assert 'crossing' in result.output
