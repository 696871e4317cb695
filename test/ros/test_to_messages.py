"""Messages say what the estimates say, with the image's stamp and frame."""

from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import Marker, MarkerArray

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joint_rotations, joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.estimate import BodyEstimate, FrameResult, JointState
from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame, undistort_mask
from pop_ros.body_messages import BodyMessages
from pop_ros.from_messages import decode_color, stamp_ns
from pop_ros.node_config import MeshConfig, NodeConfig
from pop_ros.person_ids import PersonIds
from pop_ros.skeleton_markers import HIDDEN
from pop_ros.to_messages import CLOUD_TYPE, body_poses

CAMERA = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)
STAMP_NS = 1_700_000_000_987_654_321


@pytest.fixture(scope='module')
def model() -> BodyModel:
    return default_body()


@pytest.fixture
def frame() -> RgbdFrame:
    rng = np.random.default_rng(2)
    rgb = rng.integers(0, 256, (48, 64, 3), dtype=np.uint8)
    depth_m = rng.uniform(1, 4, (48, 64)).astype(np.float32)
    depth_m[10:14, 20:30] = np.nan
    return RgbdFrame(rgb, depth_m, CAMERA, STAMP_NS)


def body(model: BodyModel, x_m: float = 0.0) -> BodyEstimate:
    rng = np.random.default_rng(1)
    parameters = BodyParameters(
        np.array([x_m, 0.2, 2.5]), np.array([np.pi, 0.1, 0.0]), rng.normal(0, 0.2, (23, 3)),
        np.zeros(10))
    mask = np.zeros((48, 64), dtype=bool)
    mask[8:40, 22:36] = True
    return BodyEstimate(
        parameters, vertices(model, parameters), joints(model, parameters),
        joint_rotations(model, parameters), np.zeros(24, dtype=np.int64),
        np.tile(np.eye(3) * 1e-4, (24, 1, 1)), mask, 0.9)


def result(*bodies: BodyEstimate) -> FrameResult:
    return FrameResult(bodies, (), {})


def test_poses_carry_position_and_orientation_of_every_joint(model: BodyModel) -> None:
    person = body(model)
    poses = body_poses(person)
    for pose, p, R in zip(poses, person.joints, person.joint_rotations, strict=True):
        q, at = pose.orientation, pose.position
        assert [at.x, at.y, at.z] == p.tolist()
        found = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
        np.testing.assert_allclose(found, R, atol=1e-12)


def test_every_message_has_stamp_and_frame_of_the_image(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(model, NodeConfig())
    messages.configure(NodeConfig(mesh=MeshConfig(lifetime_s=1.0)))
    outputs = dict(messages.build(result(body(model)), frame, 'optical', ('joints', 'cloud')))
    assert set(outputs) == {'joints', 'cloud'}
    for message in outputs.values():
        assert stamp_ns(message.header) == STAMP_NS
        assert message.header.frame_id == 'optical'


def test_the_cloud_holds_each_measured_pixel_of_each_person_once(
    model: BodyModel, frame: RgbdFrame
) -> None:
    people = result(body(model), body(model, x_m=1.5))
    messages = BodyMessages(model, NodeConfig())
    (_, cloud), = messages.build(people, frame, 'optical', ('cloud',))
    points = np.frombuffer(cloud.data.tobytes(), CLOUD_TYPE)
    mask = people.bodies[0].mask & np.isfinite(frame.depth_m)
    assert len(points) == 2 * mask.sum() == cloud.width
    assert cloud.row_step == len(cloud.data)
    first = points[points['person'] == 0]
    rows, columns = np.nonzero(mask)
    np.testing.assert_array_equal(first['z'], frame.depth_m[rows, columns])
    assert np.array_equal(first['rgb'] & 255, frame.rgb[rows, columns, 2])
    expected_x = (columns - CAMERA.cx) / CAMERA.fx * frame.depth_m[rows, columns]
    np.testing.assert_allclose(first['x'], expected_x, rtol=1e-6)


def test_a_person_who_leaves_is_deleted_once_and_an_empty_room_is_silent(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(model, NodeConfig())
    messages.build(result(body(model), body(model, 1.5)), frame, 'optical')
    gone = messages.build(result(), frame, 'optical')
    deleted = [m.id for name, m in gone if name == 'mesh']
    assert sorted(deleted) == [0, 1]
    assert all(m.action == 2 for name, m in gone if name == 'mesh')
    assert [len(m.poses) for name, m in gone if name == 'joints'] == [0]
    assert messages.build(result(), frame, 'optical') == []


def test_bones_of_hidden_joints_are_drawn_dark_and_the_id_above_the_head(
    model: BodyModel, frame: RgbdFrame
) -> None:
    person = body(model)
    person.joint_state[JOINT_INDEX['left_knee']] = JointState.SCENE_OCCLUDED
    messages = BodyMessages(model, NodeConfig(mesh=MeshConfig(detail='off')))
    bones, label = array_of(messages.build(result(person), frame, 'optical', ('mesh_array',)))
    ends = np.array([[p.x, p.y, p.z] for p in bones.points])
    assert len(ends) == 2 * 23 == len(bones.colors)
    knee = np.linalg.norm(ends - person.joints[JOINT_INDEX['left_knee']], axis=1) < 1e-9
    dark = np.array([color.r == HIDDEN.r for color in bones.colors])
    assert np.array_equal(dark, knee)
    assert knee.sum() == 2  # the thigh's end and the shin's
    assert label.text == '0'
    assert label.pose.position.y < person.joints[JOINT_INDEX['head'], 1]
    gone = array_of(messages.build(result(), frame, 'optical', ('mesh_array',)))
    assert [m.action for m in gone] == [Marker.DELETE, Marker.DELETE]
    assert messages.build(result(), frame, 'optical', ('mesh_array',)) == []


def array_of(outputs: list[tuple[str, object]]) -> list[Marker]:
    """Return the markers of the only message."""
    (_, message), = outputs
    found = deserialize_message(message, MarkerArray) if isinstance(message, bytes) else message
    return found.markers


def test_one_array_draws_what_the_single_markers_draw(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(model, NodeConfig(mesh=MeshConfig(detail='reduced')))
    outputs = messages.build(
        result(body(model), body(model, 1.5)), frame, 'optical', ('mesh', 'mesh_array'))
    single = [deserialize_message(m, Marker) for name, m in outputs if name == 'mesh']
    array = array_of([output for output in outputs if output[0] == 'mesh_array'])
    assert [m for m in array if m.ns == 'pop_mesh'] == single
    assert {(m.ns, m.id) for m in array} == {
        (name, k) for name in ('pop_mesh', 'pop_skeleton', 'pop_id') for k in (0, 1)}
    assert {(stamp_ns(m.header), m.header.frame_id) for m in array} == {(STAMP_NS, 'optical')}


def test_switching_meshes_off_removes_those_that_are_shown_and_nothing_else(
    model: BodyModel, frame: RgbdFrame
) -> None:
    topics = ('mesh', 'mesh_array')
    messages = BodyMessages(model, NodeConfig())
    people = result(body(model), body(model, 1.5))
    messages.build(people, frame, 'optical', topics)
    messages.configure(NodeConfig(mesh=MeshConfig(detail='off')))
    outputs = messages.build(people, frame, 'optical', topics)
    removed = [(m.action, m.ns, m.id) for name, m in outputs if name == 'mesh']
    expected = [(Marker.DELETE, 'pop_mesh', 0), (Marker.DELETE, 'pop_mesh', 1)]
    assert removed == expected
    array = array_of([output for output in outputs if output[0] == 'mesh_array'])
    assert [(m.action, m.ns, m.id) for m in array if m.action == Marker.DELETE] == expected
    assert len(array) == 2 + 4
    again = messages.build(people, frame, 'optical', topics)
    assert [name for name, _ in again] == ['mesh_array']
    assert all(m.action == Marker.ADD for m in array_of(again))


def test_meshes_keep_to_their_rate_and_removals_do_not_wait(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(
        model, NodeConfig(mesh=MeshConfig(detail='reduced', max_rate_hz=10.0)))
    kinds = []
    for k, people in enumerate([result(body(model))] * 7 + [result()]):
        later = replace(frame, stamp_ns=STAMP_NS + k * 1_000_000_000 // 30)
        found = messages.build(people, later, 'optical', ('mesh', 'joints'))
        kinds.append([type(m).__name__ for _, m in found])
    mesh, none, removal = ['bytes', 'PoseArray'], ['PoseArray'], ['Marker', 'PoseArray']
    assert kinds == [mesh, none, none, mesh, none, none, mesh, removal]


def test_clearing_says_that_everybody_has_left(model: BodyModel, frame: RgbdFrame) -> None:
    messages = BodyMessages(model, NodeConfig())
    topics = ('mesh', 'joints', 'cloud', 'mesh_array')
    assert messages.clear(topics) == []
    messages.build(result(body(model)), frame, 'optical', topics)
    outputs = dict(messages.clear(topics))
    assert outputs['mesh'].action == Marker.DELETE
    assert not outputs['joints'].poses
    assert outputs['cloud'].width == 0
    assert stamp_ns(outputs['joints'].header) == STAMP_NS
    assert messages.clear(topics) == []


def test_the_overlay_comes_with_every_frame_and_shows_the_body(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(model, NodeConfig())
    (_, empty), = messages.build(result(), frame, 'optical', ('overlay',))
    assert np.array_equal(decode_color(empty), frame.rgb)
    outputs = dict(messages.build(result(body(model)), frame, 'optical', ('overlay',)))
    assert stamp_ns(outputs['overlay'].header) == STAMP_NS
    changed = np.any(decode_color(outputs['overlay']) != frame.rgb, axis=2)
    assert changed[body(model).mask].mean() > 0.3


def test_the_overlay_of_a_distorted_camera_marks_what_its_pinhole_sees(
    model: BodyModel, frame: RgbdFrame
) -> None:
    bent = replace(
        CAMERA, distortion_model='plumb_bob', d=np.array([-0.4, 0.1, 0.0, 0.0, 0.0]))
    frame = replace(frame, camera=bent)
    aside = np.zeros((48, 64), dtype=bool)
    aside[8:18, 10:18] = True
    pinhole = undistort_mask(aside, bent)
    assert (pinhole != aside).sum() > 30  # the test would be empty otherwise
    drawn = []
    for mask in (aside, np.zeros_like(aside)):
        people = result(replace(body(model), mask=mask))
        (_, picture), = BodyMessages(model, NodeConfig()).build(
            people, frame, 'optical', ('overlay',))
        drawn.append(decode_color(picture).astype(int))
    marked = np.any(drawn[0] != drawn[1], axis=2)
    middle, seen, own = (np.argwhere(m).mean(axis=0) for m in (marked, pinhole, aside))
    assert np.linalg.norm(middle - seen) < 0.5 * np.linalg.norm(own - seen)


def test_the_overlay_which_takes_longest_holds_up_no_other_message(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(model, NodeConfig())
    stream = messages.stream(result(body(model)), frame, 'optical', ('overlay', 'mesh', 'joints'))
    assert [name for name, _ in stream] == ['mesh', 'joints', 'overlay']


def test_after_a_reset_ids_start_anew_and_old_ones_are_removed(
    model: BodyModel, frame: RgbdFrame
) -> None:
    messages = BodyMessages(model, NodeConfig())
    messages.build(result(body(model), body(model, 1.5)), frame, 'optical', ('mesh',))
    messages.build(result(body(model, 1.5)), frame, 'optical', ('mesh',))
    messages.reset()
    outputs = messages.build(result(body(model, 1.5)), frame, 'optical', ('mesh',))
    deleted = [m.id for name, m in outputs if name == 'mesh' and not isinstance(m, bytes)]
    assert deleted == [1]


@pytest.mark.parametrize(('detail', 'triangles'), [('full', 'f'), ('reduced', 'fit_faces')])
def test_mesh_detail_chooses_the_triangles(
    model: BodyModel, frame: RgbdFrame, detail: str, triangles: str
) -> None:
    messages = BodyMessages(model, NodeConfig(mesh=MeshConfig(detail=detail)))
    (_, data), = messages.build(result(body(model)), frame, 'optical', ('mesh',))
    size = getattr(model, triangles).size * 24
    assert size < len(data) < size + 300
    # The default shared-memory segment of Fast DDS holds half a megabyte.
    assert detail == 'full' or len(data) < 250_000


def test_without_mesh_the_other_outputs_still_come(model: BodyModel, frame: RgbdFrame) -> None:
    messages = BodyMessages(model, NodeConfig(mesh=MeshConfig(detail='off')))
    names = [name for name, _ in messages.build(result(body(model)), frame, 'optical')]
    assert 'mesh' not in names
    assert {'joints', 'cloud'} <= set(names)


def test_a_person_keeps_the_id_while_walking_and_the_order_changing() -> None:
    ids = PersonIds()
    a, b = np.array([0.0, 0, 2]), np.array([1.0, 0, 3])
    assert ids.assign(np.array([a, b])) == [0, 1]
    for _ in range(20):
        a, b = a + [0.1, 0, 0.02], b - [0.1, 0, 0.02]
        assert ids.assign(np.array([b, a])) == [1, 0]


def test_an_id_is_never_given_again() -> None:
    ids = PersonIds()
    here, there = np.array([[0.0, 0, 2]]), np.array([[3.0, 0, 2]])
    assert ids.assign(here) == [0]
    assert ids.assign(np.zeros((0, 3))) == []
    assert ids.assign(here) == [1]
    assert ids.assign(there) == [2]
