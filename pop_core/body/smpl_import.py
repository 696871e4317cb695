"""Convert the user's own SMPL, SMPL-H, SMPL-X and STAR files to the package's 24-joint body.

Loper et al. 2015 (SMPL), Romero et al. 2017 (SMPL-H), Pavlakos et al. 2019 (SMPL-X), Osman et al.
2020 (STAR). All are in metres, y up, facing +z, and share the first 22 joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from pop_core.body.body_facts import stature_m
from pop_core.body.captured_arrays import dense_array
from pop_core.body.decimation import decimate
from pop_core.body.joints import JOINT_INDEX, N_JOINTS, PARENTS
from pop_core.body.model import BodyModel
from pop_core.body.model_file import NO_ARCHIVE, check_body_model
from pop_core.body.restricted_unpickler import load_restricted_pickle
from pop_core.errors import ModelFileError

NEEDED = ('v_template', 'shapedirs', 'J_regressor', 'weights', 'kintree_table', 'f')
FIT_VERTICES = 1200
COMMON_JOINTS = 22  # pelvis to wrists: the same in every family
ENTRIES = 9  # of one rotation matrix in the pose blend feature
STATURE_M = (0.4, 2.5)  # of a mean body: infants (SMIL) to giants
# How many make a metre; no two of them take one number for a stature.
OTHER_UNITS = {'feet': 3.281, 'inches': 39.37, 'centimetres': 100.0, 'millimetres': 1000.0}


@dataclass(frozen=True, slots=True)
class Family:
    """Where the joints of one family go among the 24.

    Args:
        name: As users call it.
        folded: For each joint from 22 on, the joint that takes over its weights.
        hands: Joints that stand for left_hand and right_hand: the middle fingers' first ones.
    """

    name: str
    folded: tuple[int, ...]
    hands: tuple[int, int]


_LEFT, _RIGHT, _HEAD = (JOINT_INDEX[name] for name in ('left_hand', 'right_hand', 'head'))
# Fingers come as index, middle, pinky, ring, thumb, three joints each.
_FINGERS = (_LEFT,) * 15 + (_RIGHT,) * 15
FAMILIES = {
    24: Family('SMPL', (_LEFT, _RIGHT), (22, 23)),
    52: Family('SMPL-H', _FINGERS, (25, 40)),
    55: Family('SMPL-X', (_HEAD,) * 3 + _FINGERS, (28, 43)),  # jaw and eyes come first
}


def import_body_model(path: str | Path, n_betas: int = 10) -> BodyModel:
    """Read a body of the SMPL family, whatever its number of joints.

    Args:
        path: `.pkl` (also with chumpy arrays of Python 2) or `.npz` as published.
        n_betas: Shape coefficients to keep, the first ones; expressions come later in SMPL-X.

    Raises:
        ModelFileError: If the file is damaged, of another family, or not in metres with y up.
        UnsafeFileError: If the file asks for code to be run.
    """
    path = Path(path)
    raw = _load_raw(path)
    arrays = {name: dense_array(raw[name], f'{path}: {name}') for name in NEEDED}
    family = _family(arrays['weights'], path)
    _check_tree(arrays['kintree_table'], path)
    v_template = arrays['v_template'].astype(np.float64)
    f = arrays['f'].astype(np.int64)
    _check_shapes(v_template, arrays['shapedirs'], f, path)
    fit_vertices, fit_faces = decimate(v_template, f, FIT_VERTICES)
    model = BodyModel(
        name=path.stem,
        v_template=v_template,
        shapedirs=arrays['shapedirs'][:, :, :n_betas].astype(np.float64),
        posedirs=_posedirs(raw, len(family.folded) + COMMON_JOINTS, path),
        J_regressor=_joint_rows(arrays['J_regressor'].astype(np.float64), family, path),
        weights=_folded_weights(arrays['weights'].astype(np.float64), family),
        parents=np.array(PARENTS),
        f=f,
        fit_vertices=fit_vertices,
        fit_faces=fit_faces,
    )
    check_body_model(model, str(path))
    _check_stature(model, path)
    return model


def _load_raw(path: Path) -> dict[str, Any]:
    if path.suffix == '.npz':
        raw = _load_npz(path)
    elif path.suffix == '.pkl':
        raw = load_restricted_pickle(path)
    else:
        raise ModelFileError(f'{path}: expected a .pkl or .npz file, found {path.suffix!r}')
    missing = [name for name in NEEDED if name not in raw]
    if missing:
        raise ModelFileError(
            f'{path}: expected the arrays of an SMPL body, found none named {", ".join(missing)}'
        )
    return raw


def _load_npz(path: Path) -> dict[str, Any]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            # SMPL-X also holds pickled dictionaries: they are not needed and never opened.
            names = [name for name in (*NEEDED, 'posedirs') if name in archive.files]
            return {name: archive[name] for name in names}
    except NO_ARCHIVE as error:
        # numpy's own message would advise to allow pickles.
        raise ModelFileError(
            f'{path}: expected an npz archive of plain arrays, found none, a damaged one, or '
            'pickled objects'
        ) from error


def _check_stature(model: BodyModel, path: Path) -> None:
    low, high = STATURE_M
    found = stature_m(model, np.zeros(model.n_betas))
    if low <= found <= high:
        return
    units = [name for name, count in OTHER_UNITS.items() if 1.0 <= found / count <= high]
    guess = f', which would be {units[0]}' if units else ''
    raise ModelFileError(
        f'{path}: expected v_template in metres with y up, a mean body {low} to {high} m tall, '
        f'found one of {found:.4g}{guess}')


def _family(weights: np.ndarray, path: Path) -> Family:
    joints = weights.shape[1] if weights.ndim == 2 else 0
    if joints not in FAMILIES:
        known = ', '.join(f'{n} ({family.name})' for n, family in FAMILIES.items())
        raise ModelFileError(
            f'{path}: expected weights of {known} joints, found an array {weights.shape}'
        )
    return FAMILIES[joints]


def _check_shapes(
    v_template: np.ndarray, shapedirs: np.ndarray, f: np.ndarray, path: Path
) -> None:
    n = len(v_template)
    shapes = (v_template.shape, shapedirs.shape[:2], shapedirs.ndim, f.shape[1:])
    if shapes != ((n, 3), (n, 3), 3, (3,)) or f.min() < 0 or f.max() >= n:
        raise ModelFileError(
            f'{path}: expected v_template (v, 3), shapedirs (v, 3, b) and f (m, 3) below v, found '
            f'{v_template.shape}, {shapedirs.shape} and {f.shape} up to {f.max()}'
        )


def _check_tree(kintree_table: np.ndarray, path: Path) -> None:
    # The root's parent is left out: it is -1 written as an unsigned number.
    found = kintree_table[0, 1:COMMON_JOINTS].tolist() if kintree_table.ndim == 2 else []
    if found != list(PARENTS[1:COMMON_JOINTS]):
        raise ModelFileError(f'{path}: expected the kinematic tree of SMPL, found parents {found}')


def _folded_weights(
    weights: Float[np.ndarray, 'v n'], family: Family
) -> Float[np.ndarray, 'v 24']:
    target = np.array((*range(COMMON_JOINTS), *family.folded))
    return weights @ (target[:, None] == np.arange(N_JOINTS)).astype(np.float64)


def _joint_rows(
    regressor: Float[np.ndarray, 'n v'], family: Family, path: Path
) -> Float[np.ndarray, '24 v']:
    if len(regressor) != COMMON_JOINTS + len(family.folded):
        raise ModelFileError(
            f'{path}: expected as many joints in J_regressor as in weights, found '
            f'{len(regressor)} for {family.name}'
        )
    return regressor[[*range(COMMON_JOINTS), *family.hands]]


def _posedirs(
    raw: dict[str, Any], joints: int, path: Path
) -> Float[np.ndarray, 'v 3 207'] | None:
    """Keep the pose offsets driven by rotation matrices; the folded joints stay at rest.

    STAR's are driven by quaternions and shape, which the skinning does not know: they are left
    out, a few millimetres at strongly bent joints.
    """
    if 'posedirs' not in raw:
        return None
    posedirs = dense_array(raw['posedirs'], f'{path}: posedirs')
    if posedirs.shape[-1] != ENTRIES * (joints - 1):
        return None
    out = np.zeros((*posedirs.shape[:2], ENTRIES * (N_JOINTS - 1)))
    kept = ENTRIES * ((N_JOINTS if joints == N_JOINTS else COMMON_JOINTS) - 1)
    out[:, :, :kept] = posedirs[:, :, :kept]
    return out
