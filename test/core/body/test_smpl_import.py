import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_matrix, csr_matrix
from support.smpl_files import (
    family_arrays,
    slow_skinning,
    write_python2_pickle,
    write_smpl_pickle,
)

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.model_file import ModelNotes, load_body_model, save_body_model
from pop_core.body.skinning import vertices
from pop_core.body.smpl_import import import_body_model
from pop_core.errors import ModelFileError, UnsafeFileError

# Columns of the published joint orders: fingers of the left, then of the right hand.
FINGERS = {52: (slice(22, 37), slice(37, 52)), 55: (slice(25, 40), slice(40, 55))}
MIDDLE = {52: (25, 40), 55: (28, 43)}
LEFT, RIGHT, HEAD = (JOINT_INDEX[name] for name in ('left_hand', 'right_hand', 'head'))


def _npz(path: Path, arrays: dict[str, np.ndarray], **more: np.ndarray) -> Path:
    np.savez(path, **arrays, **more)
    return path


def _random_pose(joints: int) -> tuple[np.ndarray, BodyParameters]:
    """A pose of the 22 common joints, fingers at rest, for the slow twin and for us."""
    rng = np.random.default_rng(5)
    common = 0.5 * rng.normal(size=(22, 3))
    rotvecs = np.zeros((joints, 3))
    rotvecs[:22] = common
    body_pose = np.zeros((23, 3))
    body_pose[:21] = common[1:]
    return rotvecs, BodyParameters(np.zeros(3), common[0], body_pose, rng.normal(size=10))


def _assert_same_bodies(model: BodyModel, arrays: dict[str, np.ndarray]) -> None:
    rotvecs, parameters = _random_pose(arrays['weights'].shape[1])
    slow = slow_skinning(arrays, rotvecs, parameters.betas)
    np.testing.assert_allclose(vertices(model, parameters), slow, atol=1e-9)


@pytest.fixture
def smpl() -> dict[str, np.ndarray]:
    return family_arrays(24, 10, 207)


def test_smpl_pickle_of_python_2_with_chumpy_and_sparse_arrays(
    tmp_path: Path, smpl: dict[str, np.ndarray]
) -> None:
    model = import_body_model(write_smpl_pickle(tmp_path / 'basicmodel_m_lbs.pkl', smpl))
    for name in ('v_template', 'shapedirs', 'posedirs', 'weights', 'J_regressor'):
        np.testing.assert_allclose(getattr(model, name), smpl[name], err_msg=name)
    np.testing.assert_array_equal(model.f, smpl['f'])
    assert model.parents[0] == -1
    _assert_same_bodies(model, smpl)


@pytest.mark.parametrize('protocol', [0, 2, 4, 5])
def test_smpl_pickle_of_todays_python_and_scipy(
    tmp_path: Path, smpl: dict[str, np.ndarray], protocol: int
) -> None:
    for sparse in (csc_matrix, csr_matrix):
        content = {**smpl, 'J_regressor': sparse(smpl['J_regressor'])}
        path = tmp_path / 'model.pkl'
        path.write_bytes(pickle.dumps(content, protocol=protocol))
        np.testing.assert_allclose(import_body_model(path).J_regressor, smpl['J_regressor'])


def test_smplh_poses_like_all_its_52_joints_while_fingers_rest(tmp_path: Path) -> None:
    arrays = family_arrays(52, 16, 459)
    model = import_body_model(_npz(tmp_path / 'SMPLH_MALE.npz', arrays))
    assert model.n_betas == 10
    _assert_same_bodies(model, arrays)


def test_smplx_poses_like_all_its_55_joints_while_fingers_and_face_rest(tmp_path: Path) -> None:
    arrays = family_arrays(55, 400, 486)
    # The published file holds pickled dictionaries too; they must neither run nor disturb.
    path = _npz(tmp_path / 'SMPLX_NEUTRAL.npz', arrays, joint2num=np.array({'Pelvis': 0}))
    _assert_same_bodies(import_body_model(path), arrays)


@pytest.mark.parametrize(('joints', 'features'), [(52, 459), (55, 486)])
def test_fingers_fold_into_the_hand_and_the_face_into_the_head(
    tmp_path: Path, joints: int, features: int
) -> None:
    arrays = family_arrays(joints, 10, features)
    model = import_body_model(_npz(tmp_path / 'm.npz', arrays))
    left, right = FINGERS[joints]
    face = arrays['weights'][:, 22:25].sum(axis=1) if joints == 55 else 0.0
    expected = {
        LEFT: arrays['weights'][:, left].sum(axis=1),
        RIGHT: arrays['weights'][:, right].sum(axis=1),
        HEAD: arrays['weights'][:, HEAD] + face,
    }
    for joint, weights in expected.items():
        np.testing.assert_allclose(model.weights[:, joint], weights)
    np.testing.assert_allclose(model.weights.sum(axis=1), 1)
    for hand, middle in zip((LEFT, RIGHT), MIDDLE[joints], strict=True):
        np.testing.assert_allclose(model.J_regressor[hand], arrays['J_regressor'][middle])


def test_star_is_read_without_its_quaternion_driven_offsets(tmp_path: Path) -> None:
    arrays = family_arrays(24, 300, 93)
    model = import_body_model(_npz(tmp_path / 'STAR_FEMALE.npz', arrays))
    assert model.posedirs is None
    _assert_same_bodies(model, arrays)


def test_the_wanted_number_of_betas_is_kept(tmp_path: Path) -> None:
    arrays = family_arrays(24, 300, 93)
    model = import_body_model(_npz(tmp_path / 'm.npz', arrays), n_betas=16)
    np.testing.assert_array_equal(model.shapedirs, arrays['shapedirs'][:, :, :16])


def test_an_imported_body_survives_its_own_file(
    tmp_path: Path, smpl: dict[str, np.ndarray]
) -> None:
    model = import_body_model(write_smpl_pickle(tmp_path / 'm.pkl', smpl))
    save_body_model(tmp_path / 'm.npz', model, ModelNotes('theirs', 'here'))
    back = load_body_model(tmp_path / 'm.npz')
    _, parameters = _random_pose(24)
    # Template in float32, directions in float16: 2^-11 of offsets of 3 cm, summed over betas.
    np.testing.assert_allclose(vertices(back, parameters), vertices(model, parameters), atol=3e-4)


class _Runs:
    """Pickles to a call of any function, as an attacker would write it."""

    def __init__(self, function: object, *arguments: object) -> None:
        self.call = (function, arguments)

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return self.call


@pytest.mark.parametrize('protocol', [0, 2, 4])
@pytest.mark.parametrize('name', ['system', 'eval', 'fromfile', 'getattr'])
def test_a_hostile_pickle_is_refused_by_name_and_never_run(
    tmp_path: Path, smpl: dict[str, np.ndarray], name: str, protocol: int
) -> None:
    marker = tmp_path / 'ran'
    call = {
        'system': _Runs(os.system, f'touch {marker}'),
        'eval': _Runs(eval, f'open({str(marker)!r}, "w")'),
        'fromfile': _Runs(np.fromfile, '/etc/hostname'),
        'getattr': _Runs(getattr, 'text', 'upper'),
    }[name]
    path = tmp_path / 'evil.pkl'
    path.write_bytes(pickle.dumps({**smpl, 'weights': call}, protocol=protocol))
    with pytest.raises(UnsafeFileError, match=name):
        import_body_model(path)
    assert not marker.exists()


def test_a_captured_class_cannot_be_reached_through_dots(tmp_path: Path) -> None:
    # STACK_GLOBAL may ask for dotted names, and through __class__ and __globals__ leads a way out.
    path = tmp_path / 'dots.pkl'
    path.write_bytes(b'\x80\x04\x8c\x05numpy\x8c\x11ndarray.__class__\x93.')
    with pytest.raises(UnsafeFileError, match=r'ndarray\.__class__'):
        import_body_model(path)


def test_reconstruction_of_other_classes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'm.pkl'
    path.write_bytes(b'ccopy_reg\n_reconstructor\n(cnumpy\nndarray\nc__builtin__\nobject\nNtR.')
    with pytest.raises(ModelFileError, match='whole pickle'):
        import_body_model(path)


def test_a_cut_pickle_is_named(tmp_path: Path, smpl: dict[str, np.ndarray]) -> None:
    path = write_smpl_pickle(tmp_path / 'm.pkl', smpl)
    path.write_bytes(path.read_bytes()[:-1000])
    with pytest.raises(ModelFileError, match='whole pickle'):
        import_body_model(path)


def test_a_pickle_of_something_else_is_named(tmp_path: Path) -> None:
    path = write_python2_pickle(tmp_path / 'm.pkl', [1, 2])
    with pytest.raises(ModelFileError, match='dictionary of arrays, found list'):
        import_body_model(path)


def test_missing_arrays_are_named(tmp_path: Path, smpl: dict[str, np.ndarray]) -> None:
    del smpl['weights'], smpl['f']
    with pytest.raises(ModelFileError, match='weights, f'):
        import_body_model(_npz(tmp_path / 'm.npz', smpl))


def test_another_number_of_joints_is_named(tmp_path: Path, smpl: dict[str, np.ndarray]) -> None:
    smpl['weights'] = np.ones((120, 16)) / 16
    with pytest.raises(ModelFileError, match=r'24 \(SMPL\), 52 \(SMPL-H\), 55 \(SMPL-X\).*16'):
        import_body_model(_npz(tmp_path / 'MANO_RIGHT.npz', smpl))


def test_another_tree_is_named(tmp_path: Path, smpl: dict[str, np.ndarray]) -> None:
    smpl['kintree_table'][0, 4] = 3
    with pytest.raises(ModelFileError, match='kinematic tree'):
        import_body_model(_npz(tmp_path / 'm.npz', smpl))


def test_faces_beyond_the_vertices_are_named(
    tmp_path: Path, smpl: dict[str, np.ndarray]
) -> None:
    smpl['f'][0, 0] = 120
    with pytest.raises(ModelFileError, match='up to 120'):
        import_body_model(_npz(tmp_path / 'm.npz', smpl))


def test_pickled_arrays_in_an_npz_are_refused(
    tmp_path: Path, smpl: dict[str, np.ndarray]
) -> None:
    smpl['weights'] = np.array([_Runs(os.system, 'true')], dtype=object)
    with pytest.raises(ModelFileError, match='plain arrays'):
        import_body_model(_npz(tmp_path / 'm.npz', smpl))


@pytest.mark.parametrize(('per_metre', 'unit'), [
    (3.281, 'feet'), (39.37, 'inches'), (100.0, 'centimetres'), (1000.0, 'millimetres')])
def test_a_body_that_is_not_in_metres_is_refused_with_its_unit(
    tmp_path: Path, smpl: dict[str, np.ndarray], per_metre: float, unit: str
) -> None:
    smpl['v_template'] *= per_metre
    with pytest.raises(ModelFileError, match=rf'm\.npz: .*in metres .*would be {unit}$'):
        import_body_model(_npz(tmp_path / 'm.npz', smpl))


@pytest.mark.parametrize('factor', [0.1, 3.6e5])
def test_a_body_of_no_unit_is_refused(
    tmp_path: Path, smpl: dict[str, np.ndarray], factor: float
) -> None:
    smpl['v_template'] *= factor
    with pytest.raises(ModelFileError, match=r'0\.4 to 2\.5 m tall, found one of [\d.e+]+$'):
        import_body_model(_npz(tmp_path / 'm.npz', smpl))


def test_a_file_may_be_named_by_text(tmp_path: Path, smpl: dict[str, np.ndarray]) -> None:
    path = _npz(tmp_path / 'm.npz', smpl)
    model = import_body_model(str(path))
    save_body_model(str(tmp_path / 'copy.npz'), model, ModelNotes('theirs', 'here'))
    assert load_body_model(str(tmp_path / 'copy.npz')).name == 'm'


def test_another_suffix_and_a_missing_file_are_named(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"\.pkl or \.npz file, found '\.fbx'"):
        import_body_model(tmp_path / 'm.fbx')
    for suffix in ('pkl', 'npz'):
        with pytest.raises(ModelFileError, match=f'm.{suffix}'):
            import_body_model(tmp_path / f'm.{suffix}')
