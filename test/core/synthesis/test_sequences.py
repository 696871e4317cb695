import numpy as np
import pytest

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.skinning import vertices
from pop_core.estimate import JointState
from pop_core.geometry.transform import transform_points
from pop_core.keypoints.detection import Detection
from pop_core.synthesis.blocks import depth_inside
from pop_core.synthesis.keypoints import KeypointNoise
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.synthesis.sequence_keypoints import KeypointStream
from pop_core.synthesis.sequence_kinds import draw_script
from pop_core.synthesis.sequence_legs import Feet, Legs
from pop_core.synthesis.sequence_names import ABOUT, SequenceKind
from pop_core.synthesis.sequence_routes import Loop, TurnAround, ease
from pop_core.synthesis.sequence_walk import Walk

RATE_HZ = 30.0
SHARPEST_M_S2 = 130.0  # hands of fast arms stay below; a jump of 4 cm at 60 Hz does not
FEET = [JOINT_INDEX[name] for name in ('left_foot', 'right_foot')]


def film(model, kind, n_frames, seed=0, rate_hz=RATE_HZ, **settings):
    config = SequenceConfig(SequenceKind(kind), n_frames, rate_hz, colour=False, **settings)
    return list(film_sequence(model, seed, config))


def script_of(model, kind, seed=0):
    return draw_script(model, SequenceKind(kind), np.random.default_rng([seed, 3]), 2.0)


def paths(model, kind, seconds, rate_hz=60.0):
    """Return joints (people, frames, 24, 3) of a script, room frame."""
    script = script_of(model, kind)
    times = np.arange(int(seconds * rate_hz)) / rate_hz
    return np.array([
        [joints(model, performer.motion(t)) for t in times] for performer in script.performers])


def test_every_kind_is_described():
    assert set(ABOUT) == set(SequenceKind)


@pytest.mark.parametrize('kind', list(SequenceKind))
def test_nobody_jumps(model, kind):
    p = paths(model, kind, 2.5)
    acceleration = np.linalg.norm(np.diff(p, 2, axis=1) * 60.0**2, axis=-1)
    assert acceleration.max() < SHARPEST_M_S2
    pelvis = acceleration[:, :, 0]
    assert np.percentile(pelvis, 95) < 12.0


@pytest.mark.parametrize('kind', list(SequenceKind))
def test_feet_stay_on_the_floor_and_out_of_the_furniture(model, kind):
    script = script_of(model, kind)
    for t in (0.0, 0.7, 1.3, 2.9):
        for performer in script.performers:
            skin = vertices(model, performer.motion(t))
            assert -0.02 < skin[:, 1].min() < 0.02
            deepest = max(depth_inside(block, skin).max() for block in script.stage.blocks)
            assert deepest < 0.05  # a chair gives way, and legs pass its edge


@pytest.mark.parametrize('kind', ['crossing', 'three'])
def test_people_do_not_walk_through_each_other(model, kind):
    script = script_of(model, kind)
    for t in np.arange(0.0, 7.0, 0.25):
        middles = [performer.motion(t).transl[[0, 2]] for performer in script.performers]
        gaps = [np.linalg.norm(a - b) for i, a in enumerate(middles) for b in middles[:i]]
        assert min(gaps) > 0.45


def test_a_foot_that_stands_stands_still(model):
    p = paths(model, 'table', 4.0)[0]
    steps = np.linalg.norm(np.diff(p[:, FEET], axis=0), axis=-1)
    standing = (steps < 1e-6).mean(axis=0)
    assert (standing > 0.3).all()  # 60 % of each pair of steps, less the raising of the heel
    assert ((steps < 1e-6).any(axis=1)).mean() > 0.7
    speed = np.linalg.norm(np.diff(p[:, 0, [0, 2]], axis=0), axis=1) * 60
    assert 0.8 < speed.min()


def test_planted_feet_are_where_they_were_put(model):
    betas = np.random.default_rng(3).normal(size=model.n_betas)
    walk = Walk(model, betas, TurnAround(np.zeros(3), 0.4))
    standing = walk(0.0)
    soles = np.array([[0.12, 0.0, 0.25], [-0.05, 0.0, -0.2]])
    feet = Feet(soles, np.array([0.5, 0.3]), np.zeros(2))
    legs = Legs(model, betas)
    p = joints(model, legs.planted(standing, feet))
    ankles = p[[JOINT_INDEX['left_ankle'], JOINT_INDEX['right_ankle']]]
    assert np.allclose(ankles, soles + [0.0, legs.ankle_m, 0.0], atol=1e-9)


def test_a_loop_closes_with_its_speed():
    loop = Loop(np.array([0.3, 0.0, -0.2]), 1.2, 2.0, -1.4)
    lap_s = 2 * (2.0 + 1.4) / loop.speed_m_s
    first, again = loop(0.4), loop(0.4 + lap_s)
    assert np.allclose(first.p, again.p, atol=1e-3)  # the table's steps are 5 mm
    assert again.yaw_rad - first.yaw_rad == pytest.approx(-2 * np.pi)
    for t in np.arange(0.0, lap_s, 0.11):
        here, there = loop(t), loop(t + 0.01)
        step = there.p - here.p
        assert np.linalg.norm(step) == pytest.approx(0.01 * loop.speed_m_s, rel=0.02)
        ahead = np.array([np.sin(here.yaw_rad), 0.0, np.cos(here.yaw_rad)])
        assert step @ ahead > 0.99 * np.linalg.norm(step)


def test_easing_begins_and_ends_at_rest():
    x = np.linspace(0, 1, 101)
    y = np.array([ease(share) for share in x])
    speed = np.gradient(y, x)
    assert (y[0], y[-1], ease(-1.0), ease(2.0)) == (0.0, 1.0, 0.0, 1.0)
    assert (np.diff(y) >= 0).all()
    assert max(speed[0], speed[-1]) < 0.01


def test_a_moving_camera_sees_a_still_room(model):
    first, last = film(model, 'camera', 2, rate_hz=1.0)
    assert not np.allclose(first.scene.T_camera_room, last.scene.T_camera_room)
    # The floor stays at height 0 of the room, from wherever it is seen.
    for frame in (first, last):
        camera = frame.scene.frame.camera
        u, v = 5, camera.height - 5
        depth = float(frame.scene.true_depth_m[v, u])
        ray = camera.ray_grid()[v, u]
        point = np.array([ray[0] * depth, ray[1] * depth, depth])
        T_room_camera = np.linalg.inv(frame.scene.T_camera_room)
        assert transform_points(T_room_camera, point[None])[0][1] == pytest.approx(0.0, abs=1e-3)


def test_person_clothes_and_room_last_while_noise_is_new(model):
    first, second = film(model, 'still', 2)
    a, b = first.scene, second.scene
    assert np.array_equal(a.people[0].joints, b.people[0].joints)
    assert np.array_equal(a.people[0].clothed_vertices, b.people[0].clothed_vertices)
    assert np.array_equal(a.true_depth_m, b.true_depth_m)
    assert not np.array_equal(a.frame.depth_m, b.frame.depth_m, equal_nan=True)
    assert not np.array_equal(
        first.detections[0].keypoints_px, second.detections[0].keypoints_px, equal_nan=True)


def test_the_same_seed_gives_the_same_recording(model):
    once, again = film(model, 'arms', 2, seed=5), film(model, 'arms', 2, seed=5)
    other = film(model, 'arms', 2, seed=6)
    for a, b, c in zip(once, again, other, strict=True):
        assert np.array_equal(a.scene.frame.depth_m, b.scene.frame.depth_m, equal_nan=True)
        assert np.array_equal(
            a.detections[0].keypoints_px, b.detections[0].keypoints_px, equal_nan=True)
        assert not np.array_equal(a.scene.true_depth_m, c.scene.true_depth_m)


def test_the_wall_hides_everything_for_a_while_and_nobody_is_detected_then(model):
    frames = film(model, 'wall', 18, rate_hz=6.0)
    hidden = np.array([frame.scene.people[0].hidden_share == 1.0 for frame in frames])
    assert 0.2 < hidden.mean() < 0.8
    assert not hidden[0]
    assert all(frame.detections[0] is None for frame, h in zip(frames, hidden, strict=True) if h)


def test_who_leaves_is_out_of_the_image_and_comes_back(model):
    frames = film(model, 'leaving', 15, rate_hz=2.5)
    out = np.array([
        (frame.scene.people[0].joint_state == JointState.OUT_OF_IMAGE).all() for frame in frames])
    gone = np.flatnonzero(out)
    assert 0 < len(gone)
    assert not out[0]
    assert not out[-1]
    assert (gone[-1] - gone[0]) / 2.5 < 3.0


def test_who_crosses_behind_is_hidden_by_the_nearer_person(model):
    frames = film(model, 'crossing', 24, rate_hz=8.0)
    far = [frame.scene.people[1] for frame in frames]
    hidden = [(person.joint_state == JointState.SCENE_OCCLUDED).sum() for person in far]
    assert min(hidden) <= 4
    assert max(hidden) >= 12


def test_sitting_lowers_the_pelvis_onto_the_chair(model):
    p = paths(model, 'sitting', 3.0, rate_hz=10.0)[0]
    assert p[:, 0, 1].max() - p[:, 0, 1].min() > 0.25


def test_turning_shows_front_and_back(model):
    p = paths(model, 'turning', 3.0, rate_hz=10.0)[0]
    across = p[:, JOINT_INDEX['left_hip'], 0] - p[:, JOINT_INDEX['right_hip'], 0]
    assert across.max() > 0.08
    assert across.min() < -0.08


def errors_of(model, n, rate_hz):
    frame = film(model, 'still', 1)[0]
    person, camera = frame.scene.people[0], frame.scene.frame.camera
    noise = KeypointNoise((4.0, 4.0), 0.0, 0.0, 0.0, 0.0, 0.0)
    stream = KeypointStream(noise, rate_hz, np.random.default_rng(1))
    truth = camera.project(person.shared_points)
    found = [stream.detect([person], camera)[0] for _ in range(n)]
    assert all(isinstance(detection, Detection) for detection in found)
    return np.array([detection.keypoints_px - truth for detection in found])


def test_keypoint_errors_have_the_stated_size_and_last_for_some_frames(model):
    errors = errors_of(model, 900, 30.0)
    seen = np.isfinite(errors).all(axis=(0, 2))
    errors = errors[:, seen]
    assert errors.std() == pytest.approx(4.0, rel=0.1)

    def correlation(frames):
        a, b = errors[:-frames].ravel(), errors[frames:].ravel()
        return float((a * b).mean() / errors.var())

    # 70 % of the variance lasts, to 1/e in 0.3 s (9 frames at 30 Hz).
    assert correlation(1) == pytest.approx(0.7 * np.exp(-1 / 9), abs=0.08)
    assert correlation(9) == pytest.approx(0.7 / np.e, abs=0.1)
