import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from pop_core.body.default_body import DEFAULT_BODY_FILE
from pop_core.body.model import BodyModel
from pop_core.body.model_file import (
    ARRAY_NAMES,
    ModelNotes,
    load_body_model,
    load_model_notes,
    save_body_model,
)
from pop_core.errors import ModelFileError


@pytest.fixture
def arrays() -> dict[str, np.ndarray]:
    with np.load(DEFAULT_BODY_FILE) as archive:
        return dict(archive)


def _refused(tmp_path: Path, arrays: dict[str, np.ndarray], message: str) -> None:
    path = tmp_path / 'broken.npz'
    np.savez(path, **arrays)
    with pytest.raises(ModelFileError, match=message) as caught:
        load_body_model(path)
    assert str(path) in str(caught.value)


def test_what_is_saved_is_what_is_loaded(tmp_path: Path) -> None:
    model = load_body_model(DEFAULT_BODY_FILE)
    save_body_model(tmp_path / 'copy.npz', model, ModelNotes('a licence', 'a source'))
    copy = load_body_model(tmp_path / 'copy.npz')
    for name in ARRAY_NAMES:
        np.testing.assert_array_equal(getattr(copy, name), getattr(model, name), err_msg=name)
    assert copy.name == 'default'
    assert copy.posedirs is None
    notes = load_model_notes(tmp_path / 'copy.npz')
    assert (notes.licence, notes.provenance) == ('a licence', 'a source')


def test_pose_offsets_survive_within_half_a_thousandth(
    tmp_path: Path, random_model: BodyModel
) -> None:
    posedirs = 0.02 * np.random.default_rng(2).normal(size=(len(random_model.v_template), 3, 207))
    fields = {name: getattr(random_model, name) for name in (*ARRAY_NAMES, 'name')}
    fields['f'] = np.array([[0, 1, 2]])
    fields['fit_faces'] = np.array([[0, 1, 2]])
    save_body_model(
        tmp_path / 'm.npz', BodyModel(**fields, posedirs=posedirs), ModelNotes('', ''))
    back = load_body_model(tmp_path / 'm.npz')
    assert back.posedirs is not None
    # float16 has 11 significant bits.
    np.testing.assert_allclose(back.posedirs, posedirs, rtol=2**-11, atol=1e-7)


@pytest.mark.parametrize('name', ARRAY_NAMES)
def test_a_missing_array_is_named(
    tmp_path: Path, arrays: dict[str, np.ndarray], name: str
) -> None:
    del arrays[name]
    _refused(tmp_path, arrays, f'found no {name}')


def test_a_file_of_smpl_itself_is_sent_to_the_importer(
    tmp_path: Path, arrays: dict[str, np.ndarray]
) -> None:
    del arrays['name'], arrays['fit_vertices']
    _refused(tmp_path, arrays, 'pop body import')


@pytest.mark.parametrize(('name', 'shape'), [
    ('v_template', (5, 2)), ('shapedirs', (6678, 3)), ('weights', (6678, 23)),
    ('J_regressor', (23, 6678)), ('parents', (23,)), ('f', (10, 4)), ('fit_vertices', (3, 1)),
    ('v_template', (0, 3)),
])
def test_a_wrong_shape_is_named_with_what_was_expected(
    tmp_path: Path, arrays: dict[str, np.ndarray], name: str, shape: tuple[int, ...]
) -> None:
    arrays[name] = np.zeros(shape, dtype=arrays[name].dtype)
    _refused(tmp_path, arrays, rf'expected {name}.*found.*\({shape[0]},')


def test_fractional_indices_are_refused(tmp_path: Path, arrays: dict[str, np.ndarray]) -> None:
    arrays['f'] = arrays['f'].astype(np.float32)
    _refused(tmp_path, arrays, 'f as integers')


def test_arrays_of_different_bodies_are_refused(
    tmp_path: Path, arrays: dict[str, np.ndarray]
) -> None:
    arrays['v_template'] = arrays['v_template'][:-1]
    _refused(tmp_path, arrays, r'shapedirs .* \(6677, 3, b\), found .* \(6678, 3, 10\)')


def test_nan_is_refused(tmp_path: Path, arrays: dict[str, np.ndarray]) -> None:
    arrays['shapedirs'][7, 1, 2] = np.nan
    _refused(tmp_path, arrays, 'finite shapedirs')


def test_weights_that_do_not_sum_to_one_are_refused(
    tmp_path: Path, arrays: dict[str, np.ndarray]
) -> None:
    arrays['weights'][3] *= 0.9
    _refused(tmp_path, arrays, r'off by 0\.1')


def test_a_child_before_its_parent_is_refused(
    tmp_path: Path, arrays: dict[str, np.ndarray]
) -> None:
    arrays['parents'][1] = 4
    _refused(tmp_path, arrays, 'parents before their children')


@pytest.mark.parametrize('name', ['f', 'fit_faces', 'fit_vertices'])
def test_indices_beyond_their_array_are_refused(
    tmp_path: Path, arrays: dict[str, np.ndarray], name: str
) -> None:
    arrays[name].flat[0] = 6678
    _refused(tmp_path, arrays, f'expected {name} that index.*6678')


def test_a_triangle_that_repeats_a_vertex_is_refused(
    tmp_path: Path, arrays: dict[str, np.ndarray]
) -> None:
    arrays['f'][5, 0] = arrays['f'][5, 1]
    _refused(tmp_path, arrays, '1 that repeat a vertex')


def test_pickled_contents_are_never_opened(
    tmp_path: Path, arrays: dict[str, np.ndarray]
) -> None:
    arrays['weights'] = np.array([{'a': 1}], dtype=object)
    path = tmp_path / 'broken.npz'
    np.savez(path, **arrays)
    with pytest.raises(ModelFileError, match='plain arrays'):
        load_body_model(path)


def test_no_file_and_no_archive_are_named(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match='found nothing'):
        load_body_model(tmp_path / 'none.npz')
    damaged = tmp_path / 'damaged.npz'
    for content in (b'', b'PK\x03\x04 cut short', DEFAULT_BODY_FILE.read_bytes()[:9000]):
        damaged.write_bytes(content)
        with pytest.raises(ModelFileError, match=r'damaged\.npz'):
            load_body_model(damaged)


def test_damage_inside_an_archive_and_a_single_array_are_named(tmp_path: Path) -> None:
    sound = DEFAULT_BODY_FILE.read_bytes()
    with zipfile.ZipFile(DEFAULT_BODY_FILE) as archive:
        packed = archive.getinfo('v_template.npy')
    names = sound.index(b'v_template.npy', packed.header_offset) + len(packed.filename)
    extra = int.from_bytes(sound[packed.header_offset + 28:packed.header_offset + 30], 'little')
    data, directory = bytearray(sound), bytearray(sound)
    data[names + extra] = 0xff  # no kind of deflated block
    directory[sound.index(b'PK\x01\x02') + 10] = 99  # no way to compress
    alone = io.BytesIO()
    np.save(alone, np.zeros(3))
    path = tmp_path / 'body.npz'
    for content in (data, directory, alone.getvalue()):
        path.write_bytes(content)
        with pytest.raises(ModelFileError, match=r'body\.npz: expected an npz archive'):
            load_body_model(path)
