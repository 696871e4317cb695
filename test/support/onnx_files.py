"""Tiny ONNX networks of known behaviour, written by tests."""

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

KINDS = {
    'uint8': TensorProto.UINT8, 'float32': TensorProto.FLOAT, 'float16': TensorProto.FLOAT16,
    'int64': TensorProto.INT64, 'int32': TensorProto.INT32,
}


def save_network(
    path: Path, outputs: dict, input_shape=(1, 481, 641, 3), input_kind: str = 'uint8'
) -> Path:
    """Write a network whose outputs are known, whatever image it is shown."""
    nodes, values = [], []
    for name, array in outputs.items():
        constant = numpy_helper.from_array(array, f'{name}_value')
        nodes.append(helper.make_node('Constant', [], [name], value=constant))
        values.append(helper.make_tensor_value_info(name, KINDS[str(array.dtype)], array.shape))
    return save_graph(path, nodes, values, input_shape, input_kind)


def save_graph(
    path: Path, nodes, values, input_shape, input_kind: str = 'float32', **model
) -> Path:
    """Write a network of nodes, whose input is `image`."""
    image = helper.make_tensor_value_info('image', KINDS[input_kind], input_shape)
    graph = helper.make_graph(nodes, 'known', [image], values)
    document = helper.make_model(graph, opset_imports=[helper.make_opsetid('', 13)], **model)
    document.ir_version = 8
    onnx.save(document, path)
    return path


def float_array(values) -> np.ndarray:
    """Return values as networks give them."""
    return np.asarray(values, np.float32)
