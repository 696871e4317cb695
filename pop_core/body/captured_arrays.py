"""Turn what a restricted pickle captured of scipy.sparse and chumpy objects into arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from pop_core.body.restricted_unpickler import CapturedObject
from pop_core.errors import ModelFileError

EXPECTED = 'an array, a sparse matrix or a chumpy array'


def dense_array(value: Any, where: str) -> np.ndarray:
    """Return the array that a value stands for.

    Args:
        value: A numpy array, or a captured csc_matrix, csr_matrix, Ch, Select or Reshape.
        where: File and array name, for the message.

    Raises:
        ModelFileError: If it stands for no array of numbers.
    """
    try:
        array = _evaluate(value)
    except (KeyError, ValueError, IndexError, TypeError) as error:
        raise ModelFileError(f'{where}: expected {EXPECTED}, found {error!r}') from error
    if array.dtype.kind not in 'fiu':
        raise ModelFileError(f'{where}: expected {EXPECTED}, found {array.dtype} entries')
    return array


def _evaluate(value: Any) -> np.ndarray:
    if not isinstance(value, CapturedObject):
        return np.asarray(value)
    name, state = value.library_name, value.state
    if name.startswith('scipy.'):
        return _dense_of_sparse(state, by_column=name.endswith('csc_matrix'))
    if name == 'chumpy.Ch':
        return np.asarray(state['x'])
    if name == 'chumpy.Select':
        picked = _evaluate(state['a']).ravel()[state['idxs']]
        return picked.reshape(state.get('preferred_shape', picked.shape))
    if name == 'chumpy.Reshape':
        return _evaluate(state['a']).reshape(state['newshape'])
    raise ValueError(name)


def _dense_of_sparse(state: dict[str, Any], *, by_column: bool) -> np.ndarray:
    """Expand compressed rows or columns; repeated entries add up, as in scipy."""
    rows, columns = state['_shape'] if '_shape' in state else state['shape']
    shape = (columns, rows) if by_column else (rows, columns)
    dense = np.zeros(shape)
    major = np.repeat(np.arange(shape[0]), np.diff(state['indptr']))
    np.add.at(dense, (major, state['indices']), state['data'])
    return dense.T if by_column else dense
