"""Small files in the exact formats of the SMPL family, made of random numbers."""

from __future__ import annotations

import io
import pickle
import struct
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar

import numpy as np

from pop_core.body.joints import PARENTS
from pop_core.geometry.rotation import from_rotvec

N_VERTICES = 120
BODY_JOINTS = 22
# Parents of what follows the wrists (20, 21): fingers hang in chains of three, jaw and eyes on
# the head (15).
HANDS = {24: (), 52: (20, 21), 55: (20, 21)}


def family_parents(joints: int) -> list[int]:
    """Return the published kinematic tree of SMPL (24), SMPL-H (52) or SMPL-X (55)."""
    if joints == len(PARENTS):
        return list(PARENTS)
    parents = [*PARENTS[:BODY_JOINTS], *([15] * 3 if joints == 55 else [])]
    for wrist in HANDS[joints]:
        for _ in range(5):
            parents += [wrist, len(parents), len(parents) + 1]
    return parents


def family_arrays(joints: int, shapes: int, features: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Return random arrays under their published names and types."""
    rng = np.random.default_rng(seed)
    weights = rng.random((N_VERTICES, joints))
    for row in weights:
        row[rng.permutation(joints)[4:]] = 0
    regressor = rng.random((joints, N_VERTICES)) * (rng.random((joints, N_VERTICES)) < 0.2)
    regressor[:, 0] += 0.1
    parents = np.array(family_parents(joints), dtype=np.int64)
    return {
        'v_template': rng.uniform(-0.9, 0.9, size=(N_VERTICES, 3)),  # metres
        'shapedirs': 0.01 * rng.normal(size=(N_VERTICES, 3, shapes)),
        'posedirs': 0.01 * rng.normal(size=(N_VERTICES, 3, features)),
        'weights': weights / weights.sum(axis=1, keepdims=True),
        'J_regressor': regressor / regressor.sum(axis=1, keepdims=True),
        # The root's parent is -1 written unsigned: 4294967295.
        'kintree_table': np.stack([parents, np.arange(joints)]).astype(np.uint32),
        'f': _triangles(rng),
    }


def slow_skinning(
    arrays: dict[str, np.ndarray], rotvecs: np.ndarray, betas: np.ndarray
) -> np.ndarray:
    """LBS of all published joints, 4x4 matrix by 4x4 matrix (Loper et al. 2015)."""
    shaped = arrays['v_template'] + arrays['shapedirs'][:, :, : len(betas)] @ betas
    rest = arrays['J_regressor'] @ shaped
    R = np.stack([from_rotvec(rotvec) for rotvec in rotvecs])
    if arrays['posedirs'].shape[2] == 9 * (len(R) - 1):
        shaped = shaped + arrays['posedirs'] @ (R[1:] - np.eye(3)).ravel()
    world: list[np.ndarray] = []
    for joint, parent in enumerate(family_parents(len(R))):
        local = np.eye(4)
        local[:3, :3] = R[joint]
        local[:3, 3] = rest[joint] - (rest[parent] if parent >= 0 else 0)
        world.append(world[parent] @ local if parent >= 0 else local)
    out = np.zeros_like(shaped)
    for joint, T in enumerate(world):
        carried = (shaped - rest[joint]) @ T[:3, :3].T + T[:3, 3]
        out += arrays['weights'][:, [joint]] * carried
    return out


def _triangles(rng: np.random.Generator) -> np.ndarray:
    """Return triangles of three different vertices that use every vertex."""
    return np.stack([rng.permutation(N_VERTICES)[:3] for _ in range(60)] + [
        np.array([3 * i, 3 * i + 1, 3 * i + 2]) for i in range(N_VERTICES // 3)]).astype(np.uint32)


class Ch:
    """Stands for chumpy.ch.Ch: what it pickles, and nothing else."""

    def __init__(self, x: np.ndarray) -> None:
        self.x = x
        self._dirty_vars = {'x'}
        self._itr = None
        self._depends_on_deps: dict[str, Any] = {}


class Select(Ch):
    """Stands for chumpy.reordering.Select: a slice of another chumpy array."""

    def __init__(self, a: Ch, idxs: np.ndarray, shape: tuple[int, ...]) -> None:
        self.a, self.idxs, self.preferred_shape = a, idxs, shape


class CscMatrix:
    """Stands for the csc_matrix of an old scipy."""

    def __init__(self, dense: np.ndarray) -> None:
        columns, rows = np.nonzero(dense.T)
        self._shape = dense.shape
        self.maxprint = 50
        self.indices = rows.astype(np.int32)
        self.indptr = np.searchsorted(columns, np.arange(dense.shape[1] + 1)).astype(np.int32)
        self.data = dense[rows, columns]


PUBLISHED_NAMES = {
    Ch: 'chumpy.ch Ch',
    Select: 'chumpy.reordering Select',
    CscMatrix: 'scipy.sparse.csc csc_matrix',
}


class Python2Pickler(pickle._Pickler):
    """Writes protocol 2 as Python 2 did: byte strings, old module names."""

    dispatch: ClassVar = dict(pickle._Pickler.dispatch)

    def save_string(self, text: str | bytes) -> None:
        """Write a BINSTRING."""
        data = text.encode('latin1') if isinstance(text, str) else text
        self.write(b'T' + struct.pack('<i', len(data)) + data)
        self.memoize(text)

    def save_global(self, thing: Any, name: str | None = None) -> None:
        """Write a GLOBAL under the name that Python 2 knew."""
        module = thing.__module__.replace('numpy._core', 'numpy.core')
        module = {'builtins': '__builtin__', 'copyreg': 'copy_reg'}.get(module, module)
        plain = f'{module} {name or thing.__qualname__}'
        self.write(b'c%s\n%s\n' % tuple(PUBLISHED_NAMES.get(thing, plain).encode().split()))
        self.memoize(thing)

    dispatch[str] = save_string
    dispatch[bytes] = save_string
    dispatch[FunctionType] = save_global


def write_python2_pickle(path: Path, content: object) -> Path:
    """Write a pickle as a Python 2 program would have."""
    stream = io.BytesIO()
    Python2Pickler(stream, protocol=2).dump(content)
    path.write_bytes(stream.getvalue())
    return path


def write_smpl_pickle(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    """Write basicmodel_*_lbs_10_207_0_*.pkl: chumpy arrays and sparse regressors."""
    vertices = len(arrays['v_template'])
    full = np.concatenate([arrays['shapedirs'], np.zeros((vertices, 3, 5))], axis=2)
    picked = np.arange(full.size).reshape(full.shape)[:, :, : arrays['shapedirs'].shape[2]]
    content = {
        **arrays,
        'v_template': Ch(arrays['v_template']),
        'shapedirs': Select(Ch(full), picked.ravel(), picked.shape),
        'J_regressor': CscMatrix(arrays['J_regressor']),
        'J_regressor_prior': CscMatrix(arrays['J_regressor']),
        'bs_style': 'lbs',
        'bs_type': 'lrotmin',
        'vert_sym_idxs': np.arange(vertices),
    }
    return write_python2_pickle(path, content)
