"""Body model files: one compressed npz under SMPL's array names, read without pickle."""

from __future__ import annotations

import math
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from pop_core.body.joints import N_JOINTS
from pop_core.body.model import BodyModel
from pop_core.errors import ModelFileError

# Axes of each array: v vertices, j joints, p entries of 23 rotations, others free.
AXES = {
    'v_template': 'v 3',
    'shapedirs': 'v 3 b',
    'posedirs': 'v 3 p',
    'J_regressor': 'j v',
    'weights': 'v j',
    'parents': 'j',
    'f': 'm 3',
    'fit_vertices': 'n',
    'fit_faces': 'k 3',
}
INTEGERS = ('parents', 'f', 'fit_vertices', 'fit_faces')
ARRAY_NAMES = tuple(name for name in AXES if name != 'posedirs')
IMPORT_HINT = 'convert SMPL, SMPL-H, SMPL-X and STAR files with `pop body import`'
# float32 sums of a few hundred terms, and files written with four decimals.
WEIGHT_SUM_TOLERANCE = 1e-3
# What numpy raises for a file that is no npz archive (a single array among them), and for one that
# is damaged: in its data, in its directory, or where an entry says how it is packed.
NO_ARCHIVE = (
    OSError, ValueError, EOFError, AttributeError, TypeError, RuntimeError, zipfile.BadZipFile,
    zlib.error)


@dataclass(frozen=True, slots=True, eq=False)
class ModelNotes:
    """What a body model file says about itself.

    Args:
        licence: Licence of the arrays, such as 'Apache-2.0'.
        provenance: Where they come from, in sentences.
    """

    licence: str
    provenance: str


def load_body_model(path: str | Path) -> BodyModel:
    """Read and check a body model file written by `save_body_model`.

    Raises:
        ModelFileError: If the file is missing, damaged, or its arrays do not form a body.
    """
    path = Path(path)
    arrays = _read_arrays(path)
    missing = [name for name in ('name', *ARRAY_NAMES) if name not in arrays]
    if missing:
        raise ModelFileError(
            f'{path}: expected the arrays {", ".join(ARRAY_NAMES)}, found no {", ".join(missing)}'
            f'; {IMPORT_HINT}'
        )
    fields = {name: _checked(arrays, name, path) for name in ARRAY_NAMES}
    posedirs = _checked(arrays, 'posedirs', path) if 'posedirs' in arrays else None
    model = BodyModel(name=str(arrays['name']), posedirs=posedirs, **fields)
    check_body_model(model, str(path))
    return model


def load_model_notes(path: str | Path) -> ModelNotes:
    """Read licence and provenance of a body model file; empty where it states none."""
    arrays = _read_arrays(Path(path))
    return ModelNotes(str(arrays.get('licence', '')), str(arrays.get('provenance', '')))


def save_body_model(path: str | Path, model: BodyModel, notes: ModelNotes) -> None:
    """Write a body model: directions as float16 (0.1 mm at 20 cm), everything else 32 bits."""
    half, single, whole = np.float16, np.float32, np.int32
    arrays: dict[str, Any] = {
        'name': np.array(model.name),
        'licence': np.array(notes.licence),
        'provenance': np.array(notes.provenance),
        'v_template': model.v_template.astype(single),
        'shapedirs': model.shapedirs.astype(half),
        'J_regressor': model.J_regressor.astype(single),
        'weights': model.weights.astype(single),
        'parents': model.parents.astype(whole),
        'f': model.f.astype(whole),
        'fit_vertices': model.fit_vertices.astype(whole),
        'fit_faces': model.fit_faces.astype(whole),
    }
    if model.posedirs is not None:
        arrays['posedirs'] = model.posedirs.astype(half)
    with Path(path).open('wb') as stream:
        np.savez_compressed(stream, **arrays)


def check_body_model(model: BodyModel, where: str) -> None:
    """Raise ModelFileError unless the arrays form one body that can be posed."""
    for name in ('v_template', 'shapedirs', 'J_regressor', 'weights'):
        _expect(bool(np.isfinite(getattr(model, name)).all()), where, f'finite {name}', 'NaN')
    sums = model.weights.sum(axis=1)
    worst = float(np.abs(sums - 1.0).max())
    expected = f'weights that sum to 1 within {WEIGHT_SUM_TOLERANCE}'
    _expect(worst <= WEIGHT_SUM_TOLERANCE, where, expected, f'a row that is off by {worst:.3g}')
    parents = model.parents
    is_tree = parents[0] == -1 and all(0 <= parents[j] < j for j in range(1, N_JOINTS))
    _expect(bool(is_tree), where, 'parents before their children, root -1', str(parents.tolist()))
    _check_faces(model.f, len(model.v_template), where, 'f')
    _check_faces(model.fit_faces, len(model.fit_vertices), where, 'fit_faces')
    fit = model.fit_vertices
    inside = len(fit) > 0 and fit.min() >= 0 and fit.max() < len(model.v_template)
    _expect(bool(inside), where, 'fit_vertices that index v_template', _range(fit))


def _check_faces(faces: Int[np.ndarray, 'm 3'], count: int, where: str, name: str) -> None:
    inside = len(faces) > 0 and faces.min() >= 0 and faces.max() < count
    _expect(bool(inside), where, f'{name} that index {count} vertices', _range(faces))
    a, b, c = faces.T
    repeated = int(np.sum((a == b) | (b == c) | (c == a)))
    _expect(repeated == 0, where, f'triangles in {name}', f'{repeated} that repeat a vertex')


def _range(indices: np.ndarray) -> str:
    return f'indices {indices.min()} to {indices.max()}' if indices.size else 'none'


def _expect(holds: bool, where: str, expected: str, found: str) -> None:
    if not holds:
        raise ModelFileError(f'{where}: expected {expected}, found {found}')


def _read_arrays(path: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError as error:
        raise ModelFileError(f'{path}: expected a body model file, found nothing') from error
    except NO_ARCHIVE as error:
        raise ModelFileError(
            f'{path}: expected an npz archive of plain arrays, found another or a damaged file, '
            f'or pickled objects; {IMPORT_HINT}'
        ) from error


def _checked(arrays: dict[str, np.ndarray], name: str, path: Path) -> np.ndarray:
    array, axes = arrays[name], AXES[name].split()
    vertices = arrays['v_template'].shape[:1]
    sizes = {'3': 3, 'j': N_JOINTS, 'p': 9 * (N_JOINTS - 1), 'v': math.prod(vertices)}
    whole = name in INTEGERS
    shape_fits = len(axes) == array.ndim and array.size > 0 and all(
        sizes.get(axis, size) == size for axis, size in zip(axes, array.shape, strict=True)
    )
    if not shape_fits or array.dtype.kind not in ('iu' if whole else 'fiu'):
        wanted = ', '.join(str(sizes.get(axis, axis)) for axis in axes)
        raise ModelFileError(
            f'{path}: expected {name} as {"integers" if whole else "numbers"} of shape '
            f'({wanted}), found {array.dtype} of shape {array.shape}'
        )
    return array.astype(np.int64 if whole else np.float64)
