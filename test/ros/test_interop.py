"""People in messages of other packages keep their places, sizes, ids and confidences."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support import interop_sender
from support.estimates import CAMERA, estimate
from support.interop_sender import FRAME_ID, PEOPLE, STAMP_NS
from support.message_packages import environment_with
from support.node import RunningNode
from support.recording import record

from pop_core.body.default_body import default_body
from pop_core.body.joints import COCO_17_NAMES, JOINT_INDEX
from pop_core.body.landmarks import LANDMARK_NAMES, landmark_vertices
from pop_core.estimate import BodyEstimate
from pop_ros.interop import misfit
from pop_ros.interop_hri import SKELETON_NAMES
from pop_ros.interop_person import PersonReader
from pop_ros.interop_vision import pose_covariance
from pop_ros.interop_zed import BODY_38

SINGLE = 1e-6  # relative: of a float32
MIDDLE, CUT, BESIDE = range(3)  # the people of PEOPLE


@pytest.fixture(scope='module')
def messages() -> dict[str, Any]:
    environment = environment_with(
        'pop_msgs', 'hri_msgs', 'zed_msgs', 'vision_msgs', 'yolo_msgs')
    done = subprocess.run(
        [sys.executable, interop_sender.__file__], env=environment, capture_output=True,
        text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope='module')
def bodies() -> list[BodyEstimate]:
    return interop_sender.bodies(default_body())


def place(body: BodyEstimate, name: str) -> np.ndarray:
    """Return where a joint or landmark is [m]."""
    if name in JOINT_INDEX:
        return body.joints[JOINT_INDEX[name]]
    return body.vertices[landmark_vertices(default_body())[LANDMARK_NAMES.index(name)]]


def xyz(point: dict[str, float]) -> list[float]:
    return [point['x'], point['y'], point['z']]


def check_box(centre: dict[str, Any], size: dict[str, float], body: BodyEstimate) -> None:
    """Check that a box holds every vertex and is no larger than it must be."""
    middle, half = np.array(xyz(centre['position'])), 0.5 * np.array(xyz(size))
    assert centre['orientation'] == {'x': 0, 'y': 0, 'z': 0, 'w': 1}
    away = np.abs(body.vertices - middle)
    np.testing.assert_allclose(away.max(axis=0), half, rtol=1e-9)


def test_every_package_fits_and_every_message_has_stamp_and_frame(
    messages: dict[str, Any]
) -> None:
    assert messages['misfits'] == [''] * 4
    heads = [messages[name] for name in (
        'vision_detections', 'yolo_detections', 'zed_objects', 'ids')]
    for message in heads + messages['skeletons'] + messages['regions'] + messages['pictures']:
        stamp = message['header']['stamp']
        assert stamp['sec'] * 10**9 + stamp['nanosec'] == STAMP_NS
        assert message['header']['frame_id'] == FRAME_ID
    assert messages['ids']['ids'] == ['a', 'b']


def test_detections_3d_hold_the_mesh_and_stand_at_the_pelvis(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    found = messages['vision_detections']['detections']
    assert [d['id'] for d in found] == [str(seed) for seed in PEOPLE]
    for detection, body in zip(found, bodies, strict=True):
        check_box(detection['bbox']['center'], detection['bbox']['size'], body)
        result, = detection['results']
        assert result['hypothesis'] == {'class_id': 'person', 'score': body.score}
        np.testing.assert_allclose(xyz(result['pose']['pose']['position']), body.joints[0])
        covariance = np.reshape(result['pose']['covariance'], (6, 6))
        np.testing.assert_allclose(covariance[:3, :3], body.joint_covariance[0])
        assert np.all(np.linalg.eigvalsh(covariance) > 0)


def test_a_turn_is_as_sure_as_the_hips_are() -> None:
    body, model = estimate(default_body(), 3), default_body()
    person = PersonReader(model).read(0, body, CAMERA)
    hips = body.joints[[JOINT_INDEX['left_hip'], JOINT_INDEX['right_hip']]]
    body.joint_covariance[:] = np.eye(3) * 0.01**2
    half_m = 0.5 * np.linalg.norm(hips[0] - hips[1])
    sigma_rad = np.sqrt(pose_covariance(person)[5, 5])
    # A hip that moves by a centimetre turns the pelvis by a centimetre over the lever.
    np.testing.assert_allclose(sigma_rad, 0.01 / half_m)


def test_yolo_keypoints_are_the_body_s_in_3d_and_their_pixels_in_2d(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    found = messages['yolo_detections']['detections']
    # Who is beside the image is no detection of it.
    assert [d['id'] for d in found] == [str(seed) for seed in list(PEOPLE)[:BESIDE]]
    for detection, body in zip(found, bodies[:BESIDE], strict=True):
        assert (detection['class_id'], detection['class_name']) == (0, 'person')
        check_box(detection['bbox3d']['center'], detection['bbox3d']['size'], body)
        points = {k['id']: k for k in detection['keypoints3d']['data']}
        assert list(points) == list(range(1, 18))
        for name, point in zip(COCO_17_NAMES, points.values(), strict=True):
            np.testing.assert_allclose(xyz(point['point']), place(body, name), err_msg=name)
        for point in detection['keypoints']['data']:
            uv = [point['point']['x'], point['point']['y']]
            at = np.array([xyz(points[point['id']]['point'])])
            np.testing.assert_allclose(uv, CAMERA.project(at)[0])
            assert -0.5 <= uv[0] <= CAMERA.width - 0.5
            assert point['score'] == points[point['id']]['score']
    assert len(found[MIDDLE]['keypoints']['data']) == 17
    assert 0 < len(found[CUT]['keypoints']['data']) < 17


def test_yolo_boxes_hold_the_keypoints_and_outlines_the_visible_pixels(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    for detection, body in zip(
            messages['yolo_detections']['detections'], bodies[:BESIDE], strict=True):
        centre, size = detection['bbox']['center']['position'], detection['bbox']['size']
        left, right = centre['x'] - size['x'] / 2, centre['x'] + size['x'] / 2
        top, bottom = centre['y'] - size['y'] / 2, centre['y'] + size['y'] / 2
        assert 0 <= left < right <= CAMERA.width - 1
        assert 0 <= top < bottom <= CAMERA.height - 1
        columns = np.flatnonzero(body.mask.any(axis=0))
        rows = np.flatnonzero(body.mask.any(axis=1))
        # The rendered silhouette holds pixels whose centre is covered: thin tips are none.
        margin_px = np.abs(
            np.array([columns[0] - left, rows[0] - top, right - columns[-1], bottom - rows[-1]]))
        # Of whom the border cuts, the box is the whole one's part that lies in the image.
        assert margin_px.max() < (1.5 if columns[-1] < CAMERA.width - 1 else 10)
        mask = detection['mask']
        assert (mask['height'], mask['width']) == (CAMERA.height, CAMERA.width)
        outline = np.array([[p['x'], p['y']] for p in mask['data']], int)
        assert body.mask[outline[:, 1], outline[:, 0]].all()
        assert np.ptp(outline[:, 1]) > 0.9 * np.ptp(rows)


def test_zed_skeletons_are_body_38_with_sureness_that_follows_the_covariance(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    for found, body in zip(messages['zed_objects']['objects'], bodies, strict=True):
        assert (found['body_format'], found['skeleton_available']) == (2, True)
        points = np.array([k['kp'] for k in found['skeleton_3d']['keypoints']])
        pixels = np.array([k['kp'] for k in found['skeleton_2d']['keypoints']])
        sure = np.array(found['skeleton_keypoint_confidence'])
        known = np.array([bool(name) for name in BODY_38] + [False] * 32)
        assert np.array_equal(np.isfinite(points).all(axis=1), known)
        assert np.array_equal(np.isfinite(sure), known)
        expected = np.array([place(body, name) for name in BODY_38 if name])
        np.testing.assert_allclose(points[known], expected, rtol=SINGLE, atol=SINGLE)
        seen = pixels[:, 0] >= 0
        assert not seen[~known].any()
        np.testing.assert_allclose(
            pixels[seen], CAMERA.project(points[seen]), rtol=1e-5, atol=1e-3)
        joints = [(slot, JOINT_INDEX[n]) for slot, n in enumerate(BODY_38) if n in JOINT_INDEX]
        slots, rows = np.array(joints).T
        variance = np.trace(body.joint_covariance, axis1=1, axis2=2)[rows]
        assert np.array_equal(np.argsort(sure[slots]), np.argsort(-variance))
        assert 0 <= sure[known].min() <= sure[known].max() <= 100


def test_zed_boxes_have_their_corners_in_zed_s_order(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    for (seed, found), body in zip(
            zip(PEOPLE, messages['zed_objects']['objects'], strict=True), bodies, strict=True):
        assert (found['label'], found['label_id']) == (f'Body_{seed}', seed)
        assert found['confidence'] == pytest.approx(100 * body.score)
        corners = np.array([c['kp'] for c in found['bounding_box_3d']['corners']])
        np.testing.assert_allclose(corners.min(axis=0), body.vertices.min(axis=0), rtol=1e-5)
        np.testing.assert_allclose(corners.max(axis=0), body.vertices.max(axis=0), rtol=1e-5)
        np.testing.assert_allclose(found['dimensions_3d'], np.ptp(corners, axis=0), rtol=1e-5)
        # Four above (up is -y), and below each of them one of the others.
        assert np.all(corners[:4, 1] < corners[4:, 1])
        np.testing.assert_array_equal(corners[:4, [0, 2]], corners[4:, [0, 2]])
        # Neighbours in the ring share an edge.
        ring = np.abs(np.diff(corners[[0, 1, 2, 3, 0]][:, [0, 2]], axis=0)) > 1e-6
        assert np.array_equal(ring.sum(axis=1), [1, 1, 1, 1])
        flat = np.array([c['kp'] for c in found['bounding_box_2d']['corners']], float)
        if seed == list(PEOPLE)[BESIDE]:
            assert not flat.any()
        else:
            (left, top), (right, bottom) = flat[0], flat[2]
            assert flat.tolist() == [[left, top], [right, top], [right, bottom], [left, bottom]]
            assert left < right
            assert top < bottom
        head = np.array([c['kp'] for c in found['head_bounding_box_3d']['corners']])
        assert np.all((head.min(axis=0) < place(body, 'nose')) & (place(body, 'nose')
                                                                  < head.max(axis=0)))


def test_zed_searches_for_people_who_are_predicted_only(messages: dict[str, Any]) -> None:
    found = messages['zed_objects']['objects']
    assert [o['tracking_available'] for o in found] == [False, True, True]
    assert [o['tracking_state'] for o in found] == [1, 2, 2]  # ok, searching


def test_bodies_say_everything_of_each_person(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    near = {'rtol': SINGLE, 'atol': SINGLE}
    for found, number, body in zip(messages['bodies']['bodies'], PEOPLE, bodies, strict=True):
        assert found['id'] == number
        given = found['parameters']
        for name in ('transl', 'global_orient', 'betas', 'scale'):
            np.testing.assert_allclose(given[name], getattr(body.parameters, name), **near)
        np.testing.assert_allclose(given['body_pose'], body.parameters.body_pose.ravel(), **near)
        joints = found['joints']
        assert [joint['state'] for joint in joints] == body.joint_state.tolist()
        assert found['visible_fraction'] == pytest.approx(np.mean(body.joint_state == 0))
        places = [xyz(joint['pose']['position']) for joint in joints]
        np.testing.assert_allclose(places, body.joints)
        turns = Rotation.from_quat([
            [*xyz(joint['pose']['orientation']), joint['pose']['orientation']['w']]
            for joint in joints])
        np.testing.assert_allclose(turns.as_matrix(), body.joint_rotations, atol=1e-9)
        np.testing.assert_allclose(
            [joint['covariance'] for joint in joints], body.joint_covariance.reshape(24, 9),
            **near)
        assert dict(zip(found['energy_names'], found['energies'], strict=True)) == body.energies
        assert found['score'] == pytest.approx(body.score)


def test_bodies_say_how_fresh_a_person_is_and_that_nobody_is_tracked(
    messages: dict[str, Any]
) -> None:
    found = messages['bodies']['bodies']
    assert [b['track_state'] for b in found] == [255, 2, 3]
    assert [b['age_s'] for b in found] == [0, 4.5, 4.5]
    assert [b['unseen_s'] for b in found] == [0, 1, 1.5]


def test_hri_skeletons_are_shares_of_the_image_and_unsure_outside_it(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    size = np.array([CAMERA.width, CAMERA.height])
    counts = []
    for found, body in zip(messages['skeletons'], bodies, strict=True):
        points = np.array([[p['x'], p['y'], p['c']] for p in found['skeleton']])
        assert points.shape == (18, 3)
        assert 0 <= points.min() <= points.max() <= 1
        uv = CAMERA.project(np.array([place(body, name) for name in SKELETON_NAMES]))
        inside = points[:, 2] > 0
        # Pixel centres are integers: the first pixel reaches from -0.5 to 0.5.
        np.testing.assert_allclose(points[inside, :2] * size - 0.5, uv[inside], atol=1e-3)
        counts.append(inside.sum())
    assert counts[MIDDLE] == 18
    assert 0 < counts[CUT] < 18
    assert counts[BESIDE] == 0


def test_hri_regions_hold_the_person_and_pictures_show_them(
    messages: dict[str, Any], bodies: list[BodyEstimate]
) -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (CAMERA.height, CAMERA.width, 3), np.uint8)
    for found, picture, body in zip(
            messages['regions'][:BESIDE], messages['pictures'], bodies, strict=False):
        assert found['c'] == pytest.approx(body.score)
        left, right = np.array([found['xmin'], found['xmax']]) * CAMERA.width - 0.5
        top, bottom = np.array([found['ymin'], found['ymax']]) * CAMERA.height - 0.5
        rows, columns = np.nonzero(body.mask)
        assert left - 0.51 <= columns.min() <= columns.max() <= right + 0.51
        assert top - 0.51 <= rows.min() <= rows.max() <= bottom + 0.51
        pixels = np.array(picture['data'], np.uint8).reshape(
            picture['height'], picture['width'], 3)
        first_row, first_column = int(np.floor(top + 1e-3)), int(np.floor(left + 1e-3))
        assert np.array_equal(pixels, rgb[first_row:first_row + picture['height'],
                                          first_column:first_column + picture['width']])
    assert messages['regions'][BESIDE]['c'] == 0
    assert messages['pictures'][BESIDE]['data'] == []


def test_a_package_that_is_not_there_or_of_another_version_is_said_so() -> None:
    def fails(_module: Any) -> None:
        raise AttributeError("'Odd' object has no attribute 'keypoints'")

    assert misfit('no_such_msgs', fails) == 'no_such_msgs is not installed'
    assert misfit('std_msgs', fails).startswith('std_msgs is of another version: ')
    assert misfit('std_msgs', lambda module: module.Header()) == ''


def test_the_node_tells_of_one_person_by_one_number_on_every_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    environment = environment_with(
        'pop_msgs', 'tf2_msgs', 'hri_msgs', 'zed_msgs', 'vision_msgs', 'yolo_msgs')
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    recording = record(tmp_path, n_frames=1, rate_hz=1.0)
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    node = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints),
                       '--ros-args', '-p', 'rep155:=true')
    script = interop_sender.__file__.replace('interop_sender', 'outputs_listener')
    listener = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True)
    try:
        node.wait_for('ready after')
        subprocess.run(
            [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--out',
             str(tmp_path / 'out'), '--node-running'],
            check=True, capture_output=True, timeout=120)
        told, _ = listener.communicate(timeout=30)
    finally:
        listener.kill()
        code = node.end()
    assert code == 0, node.output
    found = json.loads(told)
    body, = found['/pop/bodies']['bodies']
    number, at = body['id'], xyz(body['joints'][0]['pose']['position'])
    assert np.linalg.norm(at - recording.pelvis(recording.stamps[0])) < 0.05
    detection, = found['/pop/vision_detections']['detections']
    seen, = found['/pop/yolo_detections']['detections']
    thing, = found['/pop/zed_objects']['objects']
    assert detection['id'] == seen['id'] == f'{number}'
    assert (thing['label_id'], thing['label']) == (number, f'Body_{number}')
    assert found['/humans/bodies/tracked']['ids'] == [f'pop_{number}']
    np.testing.assert_allclose(xyz(detection['results'][0]['pose']['pose']['position']), at)
    np.testing.assert_allclose(thing['skeleton_3d']['keypoints'][0]['kp'], at, rtol=1e-5)
