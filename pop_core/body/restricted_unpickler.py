"""Read arrays out of a pickle without letting the pickle run code.

A pickle names functions and calls them. Here every name is looked up in one table: numpy's array
constructors, and inert stand-ins for scipy.sparse and chumpy objects, which keep their state and
do nothing. Any other name refuses the file.
"""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np

from pop_core.errors import ModelFileError, UnsafeFileError


class CapturedObject:
    """What a pickle said about an object of a library that is not called."""

    library_name = ''

    def __new__(cls, *_: object) -> CapturedObject:
        """Take any constructor arguments and ignore them."""
        return super().__new__(cls)

    def __init__(self, *_: object) -> None:
        self.state: dict[str, Any] = {}

    def __setstate__(self, state: object) -> None:
        self.state = dict(state) if isinstance(state, dict) else {}


def load_restricted_pickle(path: Path) -> dict[str, Any]:
    """Return the top-level dictionary of a pickle (Python 2 strings decoded as latin1).

    Raises:
        UnsafeFileError: If the file names anything but numpy, scipy.sparse or chumpy data.
        ModelFileError: If it is no pickle, or damaged, or holds no dictionary.
    """
    try:
        with path.open('rb') as stream:
            content = _RestrictedUnpickler(stream, path).load()
    except OSError as error:
        raise ModelFileError(f'{path}: expected a readable file, found {error}') from error
    except _DAMAGE as error:
        raise ModelFileError(f'{path}: expected a whole pickle, found {error!r}') from error
    if not isinstance(content, dict):
        raise ModelFileError(
            f'{path}: expected a pickled dictionary of arrays, found {type(content).__name__}'
        )
    return content


# What the pickle machine raises on bytes that are cut or are no pickle at all.
_DAMAGE = (
    pickle.UnpicklingError, EOFError, ValueError, TypeError, AttributeError, LookupError,
    ImportError, MemoryError, OverflowError, RecursionError,
)


class _RestrictedUnpickler(pickle.Unpickler):
    def __init__(self, stream: Any, path: Path) -> None:
        super().__init__(stream, encoding='latin1')
        self._path = path

    def find_class(self, module: str, name: str) -> Any:
        """Return the stand-in of a name, or refuse the file."""
        allowed = _ALLOWED.get(f'{module}.{name}')
        if allowed is not None:
            return allowed
        library = module.split('.')[0]
        if library == 'chumpy' or (module.startswith('scipy.sparse') and '_matrix' in name):
            return _stub(f'{library}.{name}')
        raise UnsafeFileError(
            f'{self._path}: expected numpy, scipy.sparse and chumpy data only, found '
            f'{module}.{name}; nothing of the file was run'
        )


def _stub(library_name: str) -> type[CapturedObject]:
    return type('CapturedObject', (CapturedObject,), {'library_name': library_name})


def _reconstructed(cls: type, *_: object) -> object:
    """Stand in for copyreg._reconstructor: an empty object of a captured class."""
    if not (isinstance(cls, type) and issubclass(cls, CapturedObject)):
        raise pickle.UnpicklingError(f'reconstruction of {cls!r}')
    return cls()


def _latin1_bytes(text: str, encoding: str) -> bytes:
    """Stand in for _codecs.encode: how Python 3 writes bytes into old pickles."""
    if encoding != 'latin1':
        raise pickle.UnpicklingError(f'bytes encoded as {encoding}')
    return text.encode('latin1')


def _numpy_constructors() -> dict[str, Any]:
    """Return numpy's own constructors under the module names of numpy 1 and 2."""
    array = np.zeros(1)
    functions = {
        'multiarray._reconstruct': array.__reduce__()[0],
        'multiarray.scalar': np.float64(0).__reduce__()[0],
        'numeric._frombuffer': array.__reduce_ex__(5)[0],
    }
    return {
        f'numpy.{core}.{name}': function
        for core in ('core', '_core')
        for name, function in functions.items()
    }


_ALLOWED: dict[str, Any] = {
    **_numpy_constructors(),
    'numpy.ndarray': np.ndarray,
    'numpy.dtype': np.dtype,
    '__builtin__.object': object,
    'builtins.object': object,
    '__builtin__.set': set,
    'builtins.set': set,
    'collections.OrderedDict': dict,
    'copy_reg._reconstructor': _reconstructed,
    'copyreg._reconstructor': _reconstructed,
    '_codecs.encode': _latin1_bytes,
}
