"""The parts of `pop demo`; test/ros plays bags to the node in another process."""

import base64
import json
import re

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from pop_core.body.default_body import default_body
from pop_ros.report import Picture, Report
from pop_ros.warm_up import CAMERA

pytest.importorskip('rclpy', reason='the demo plays a bag to a ROS node')

from pop_ros import recorded_bodies, to_messages
from pop_ros.cli import build_app
from pop_ros.demo import DemoError, DemoFrame, DemoKeypoints, prepare_folder, source_of
from pop_ros.demo_report import commands, error_rows
from pop_ros.node_arguments import parse_arguments


def test_a_mesh_is_read_back_from_its_triangles():
    model = default_body()
    corners = to_messages.triangle_points(model.v_template, model.f)
    np.testing.assert_array_equal(
        recorded_bodies.mesh_vertices(corners, model.f), model.v_template)


def test_published_points_fall_on_the_pixels_they_came_from(scene):
    frame, _ = scene
    mask = np.zeros(frame.depth_m.shape, dtype=bool)
    mask[40:60, 70:90] = True
    v, u = np.nonzero(mask)
    uv = np.column_stack([u, v]).astype(float)
    xyz = CAMERA.unproject(uv, frame.depth_m[mask].astype(float))
    points = np.zeros(len(xyz), recorded_bodies.CLOUD_TYPE)
    for k, name in enumerate('xyz'):
        points[name] = xyz[:, k]
    np.testing.assert_array_equal(recorded_bodies.cloud_mask(points, CAMERA), mask)


def test_a_folder_of_someone_else_is_refused_and_left_as_it_is(tmp_path):
    (tmp_path / 'pictures').mkdir()
    (tmp_path / 'pictures' / 'holiday.png').touch()
    with pytest.raises(DemoError, match='expected a new or empty folder'):
        prepare_folder(tmp_path)
    assert (tmp_path / 'pictures' / 'holiday.png').exists()


def test_an_earlier_demo_is_written_over(tmp_path):
    paths = prepare_folder(tmp_path / 'demo')
    paths.pictures.mkdir()
    (paths.pictures / 'old.png').touch()
    again = prepare_folder(tmp_path / 'demo')
    assert not again.pictures.exists()


@pytest.mark.parametrize(('keypoints', 'named'), [
    (DemoKeypoints.DEPTH, 'depth'), (DemoKeypoints.TRUTH, 'json')])
def test_the_node_is_told_where_keypoints_come_from(keypoints, named, tmp_path):
    paths = prepare_folder(tmp_path / 'demo')
    source = source_of(paths, keypoints)
    assert parse_arguments(source.as_flags()).sources == source
    assert source.keypoints == named
    replay = next(line for line in commands(paths, keypoints) if line.startswith('pop replay'))
    assert f'--keypoints {named}' in replay
    assert ('--keypoints-dir keypoints' in replay) == (keypoints is DemoKeypoints.TRUTH)


def test_other_keypoints_of_the_demo_are_refused(tmp_path):
    done = CliRunner().invoke(
        build_app('demo'), ['demo', '--keypoints', 'openpose', '--out', str(tmp_path / 'demo')])
    assert done.exit_code == 2
    assert not (tmp_path / 'demo').exists()


def test_errors_are_split_by_what_the_camera_sees():
    hidden = np.arange(24) < 6
    frame = DemoFrame(np.zeros((2, 2, 3), np.uint8), np.where(hidden, 0.2, 0.01), hidden)
    assert error_rows([frame, frame]) == [
        ('visible', '36', '10 mm', '10 mm', '10 mm'),
        ('hidden', '12', '200 mm', '200 mm', '200 mm')]


@pytest.fixture
def page(tmp_path):
    report = Report('a <title>', 'lead & sentence')
    report.heading('head')
    report.table(('name', 'value'), [('<b>', '1')])
    report.commands(['pop demo > log'])
    picture = np.full((8, 12, 3), (200, 30, 30), np.uint8)
    report.film([Picture.encoded(rgb, caption, 640) for rgb, caption in (
        (picture, 'one </script>'), (picture // 2, 'two'))])
    report.write(tmp_path / 'report.html')
    return (tmp_path / 'report.html').read_text(encoding='utf-8')


def test_a_report_needs_no_other_file(page):
    sources = re.findall(r'(?:src|href)\s*=\s*["\']([^"\']+)', page)
    assert all(source.startswith('data:') for source in sources)
    assert '://' not in page


def test_a_report_shows_text_as_text(page):
    assert '<title>a &lt;title&gt;</title>' in page
    assert '&lt;b&gt;' in page
    assert 'pop demo &gt; log' in page


def test_a_film_holds_its_pictures_and_captions(page):
    data = re.search(r'<script type="application/json">(.*?)</script>', page, re.DOTALL).group(1)
    frames = json.loads(data)
    assert [frame['caption'] for frame in frames] == ['one </script>', 'two']
    jpeg = np.frombuffer(base64.b64decode(frames[0]['jpeg']), np.uint8)
    rgb = cv2.cvtColor(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    # JPEG of one flat colour: rounding of its chroma only
    np.testing.assert_allclose(rgb.mean(axis=(0, 1)), (200, 30, 30), atol=3)
