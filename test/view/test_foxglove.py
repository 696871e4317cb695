"""Results as Foxglove reads them: MCAP by the format's own reader, types by their definitions."""

from pathlib import Path

import numpy as np
import pytest

reader = pytest.importorskip('mcap.reader', reason='no mcap here (pip install mcap-ros2-support)')
from mcap_ros2.decoder import DecoderFactory  # noqa: E402
from support.recording import record, write_frames  # noqa: E402

from pop_ros.from_messages import stamp_ns  # noqa: E402
from pop_ros.node_arguments import SourceArguments  # noqa: E402
from pop_ros.recorded_bodies import read_bodies  # noqa: E402
from pop_ros.replay_session import ReplayRequest, run_replay  # noqa: E402

# Types that Foxglove's 3D and image panels draw.
TOPICS = {
    '/pop/mesh': 'visualization_msgs/msg/Marker',
    '/pop/joints': 'geometry_msgs/msg/PoseArray',
    '/pop/cloud': 'sensor_msgs/msg/PointCloud2',
    '/cam/color/image_raw': 'sensor_msgs/msg/Image',
    '/cam/aligned_depth/image_raw': 'sensor_msgs/msg/Image',
    '/cam/color/camera_info': 'sensor_msgs/msg/CameraInfo',
}


@pytest.fixture(scope='module')
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rosbag2 of one frame with the camera's messages in it."""
    folder = tmp_path_factory.mktemp('results')
    recording = record(folder, n_frames=1, rate_hz=4.0)
    bag = write_frames(folder / 'camera.bag', [recording.scenes[0].frame], '32FC1')
    summary = run_replay(ReplayRequest(
        bags=(bag,), out=folder / 'out', ros1=None, sources=SourceArguments('json', folder),
        topics=(None, None, None), slop_s=0.01, every_frame=True, inputs=True), lambda _: None)
    assert summary.people == 1
    return folder / 'out'


def test_every_topic_has_a_type_that_foxglove_draws(results: Path) -> None:
    with (results / 'out.mcap').open('rb') as file:
        mcap = reader.make_reader(file, validate_crcs=True)
        assert mcap.get_header().profile == 'ros2'
        summary = mcap.get_summary()
    assert summary is not None
    schemas = {c.topic: summary.schemas[c.schema_id] for c in summary.channels.values()}
    assert {topic: schemas[topic].name for topic in TOPICS} == TOPICS
    assert {schema.encoding for schema in schemas.values()} == {'ros2msg'}
    assert {c.message_encoding for c in summary.channels.values()} == {'cdr'}
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(schemas)
    assert summary.chunk_indexes


def test_definitions_in_the_file_decode_its_messages(results: Path) -> None:
    with (results / 'out.mcap').open('rb') as file:
        mcap = reader.make_reader(file, decoder_factories=[DecoderFactory()])
        found = {channel.topic: message
                 for _, channel, _, message in mcap.iter_decoded_messages()}
    assert set(found) >= set(TOPICS)
    assert len({message.header.frame_id for message in found.values()}) == 1
    stamp, = {stamp_ns(message.header) for message in found.values()}
    mesh = found['/pop/mesh']
    assert (mesh.type, mesh.action, mesh.color.a, mesh.scale.x) == (11, 0, 1.0, 1.0)
    expected = read_bodies(results)[stamp]
    points = np.array([[p.x, p.y, p.z] for p in mesh.points])
    assert np.array_equal(points, expected.triangles[0])
    assert len(found['/pop/joints'].poses) == 24
    cloud = found['/pop/cloud']
    assert [field.name for field in cloud.fields] == ['x', 'y', 'z', 'rgb', 'person']
    assert cloud.point_step * cloud.width == len(cloud.data)
