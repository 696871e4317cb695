"""Load and run ONNX networks with ONNX Runtime; an unknown file is taken for a hostile one.

What a file may do is bounded before it is run: its size, where it reads from (nowhere else), the
sizes of its inputs and outputs, what is computed while it is loaded. Everything that fails is told
in one line.
"""

from __future__ import annotations

import math
import stat
from collections.abc import Sequence
from pathlib import Path
from threading import Timer

import numpy as np
import onnxruntime

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.network import NetworkSpec, Tensor, TensorSpec

THREADS = 2
LARGEST_FILE = 2**31 - 1  # bytes; a protobuf cannot be larger
LARGEST_TENSOR = 2**27  # elements: 512 MB of float32
LONGEST_S = 60.0
FOLDING_BYTES = 2**26
DTYPES = {
    'tensor(uint8)': 'uint8', 'tensor(int32)': 'int32', 'tensor(float)': 'float32',
    'tensor(float16)': 'float16', 'tensor(int64)': 'int64', 'tensor(double)': 'float64',
    'tensor(bool)': 'bool', 'tensor(int8)': 'int8',
}
FLOATS = ('float32', 'float16')
# Fastest first. TensorRT is left out: it builds engines for minutes on first use.
PROVIDERS = ('CUDAExecutionProvider', 'CPUExecutionProvider')


class OnnxSession:
    """A loaded network."""

    def __init__(self, content: bytes, where: str, longest_s: float = LONGEST_S) -> None:
        """Load a network.

        Args:
            content: What the .onnx file holds.
            where: Name of the file, for messages.
            longest_s: A run that takes longer is ended [s]; a network may hold an endless loop.

        Raises:
            NetworkShapeError: If it is no network, needs other files or unknown operators, or
                declares tensors of impossible sizes.
        """
        self.where = where
        self.longest_s = longest_s
        self._session = _load(content, where)
        self.spec = _spec(self._session)
        self.facts = dict(self._session.get_modelmeta().custom_metadata_map)
        for tensor in (*self.spec.inputs, *self.spec.outputs):
            if tensor.dtype not in DTYPES.values():
                raise NetworkShapeError(f'{where}: expected tensors of numbers, found {tensor}')
            if math.prod(size or 1 for size in tensor.shape) > LARGEST_TENSOR:
                raise NetworkShapeError(
                    f'{where}: expected tensors of up to {LARGEST_TENSOR} elements, '
                    f'found {tensor}')

    def run(self, *tensors: Tensor) -> Sequence[Tensor]:
        """Return the outputs of its inputs, in the network's order, half floats as floats.

        Raises:
            NetworkShapeError: If the network fails, or gives other shapes than it declares.
        """
        if len(tensors) != len(self.spec.inputs):
            raise NetworkShapeError(
                f'{self.where}: expected {len(self.spec.inputs)} inputs, found {len(tensors)}')
        inputs = {
            entry.name: tensor.astype(entry.dtype, copy=False) if entry.dtype in FLOATS else tensor
            for entry, tensor in zip(self.spec.inputs, tensors, strict=True)}
        options = onnxruntime.RunOptions()
        alarm = Timer(self.longest_s, setattr, (options, 'terminate', True))
        alarm.daemon = True
        alarm.start()
        try:
            outputs = self._session.run(None, inputs, options)
        except Exception as error:  # noqa: BLE001 - ONNX Runtime's errors share no public base
            raise NetworkShapeError(
                f'{self.where}: expected outputs within {self.longest_s:.0f} s, found: '
                f'{one_line(error)}') from None
        finally:
            alarm.cancel()
        arrays = [np.asarray(output) for output in outputs]
        for declared, array in zip(self.spec.outputs, arrays, strict=True):
            _check_shape(declared, array, self.where)
        return [a.astype(np.float32) if a.dtype == np.float16 else a for a in arrays]


def load_network(path: Path) -> OnnxSession:
    """Return the network of a file.

    Raises:
        NetworkShapeError: If there is no such file or it is no network that can be run.
    """
    return OnnxSession(read_network(path), str(path))


def read_network(path: Path) -> bytes:
    """Return what a file of sane size holds.

    Raises:
        NetworkShapeError: If there is none, or it is no regular file, or too large.
    """
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise NetworkShapeError(f'{path}: expected an ONNX file, found none: not a file')
        if found.st_size > LARGEST_FILE:
            raise NetworkShapeError(
                f'{path}: expected an ONNX file of up to {LARGEST_FILE} bytes, '
                f'found {found.st_size}')
        return path.read_bytes()
    except OSError as error:
        raise NetworkShapeError(
            f'{path}: expected an ONNX file, found: {error.strerror}') from None


def _load(content: bytes, where: str) -> onnxruntime.InferenceSession:
    onnxruntime.disable_telemetry_events()  # a robot's perception tells nobody what it runs
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = THREADS
    options.inter_op_num_threads = 1
    options.log_severity_level = 4  # what goes wrong is raised, and told once
    # Spinning threads would take the cores from the fit between two images.
    options.add_session_config_entry('session.intra_op.allow_spinning', '0')
    # A file of 100 bytes may ask for a constant of gigabytes, computed while it is loaded.
    options.add_session_config_entry(
        'optimization.constant_folding_max_output_size_in_bytes', str(FOLDING_BYTES))
    providers = chosen_providers(onnxruntime.get_available_providers())
    try:
        # From memory a network cannot name other files as its weights.
        return onnxruntime.InferenceSession(content, options, providers=providers)
    except Exception as error:  # noqa: BLE001 - ONNX Runtime's errors share no public base
        raise NetworkShapeError(
            f'{where}: expected an ONNX network, found: {one_line(error)}') from None


def chosen_providers(there: Sequence[str]) -> list[str]:
    """Return the execution providers to use, fastest first, of those that are there."""
    return [name for name in PROVIDERS if name in there]


def one_line(said: object) -> str:
    """Return what somebody else says, as a line that fits into a message."""
    printable = ''.join(c if c.isprintable() else ' ' for c in str(said))
    return ' '.join(printable.split())[:160]


def _check_shape(declared: TensorSpec, array: Tensor, where: str) -> None:
    same = array.ndim == len(declared.shape) and all(
        size is None or size == found
        for size, found in zip(declared.shape, array.shape, strict=True))
    if not same or array.size > LARGEST_TENSOR or 0 in array.shape[:1]:
        raise NetworkShapeError(f'{where}: expected {declared}, found shape {array.shape}')


def _spec(session: onnxruntime.InferenceSession) -> NetworkSpec:
    sides = ([_tensor(item) for item in side]
             for side in (session.get_inputs(), session.get_outputs()))
    inputs, outputs = (tuple(side) for side in sides)
    return NetworkSpec(inputs, outputs)


def _tensor(item: onnxruntime.NodeArg) -> TensorSpec:
    shape = tuple(
        size if isinstance(size, int) and size > 0 else None for size in item.shape or ())
    return TensorSpec(item.name, shape, DTYPES.get(item.type, item.type))
