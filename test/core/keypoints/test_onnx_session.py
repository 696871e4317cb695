"""Networks as they come from anywhere: each ends in one line or in outputs."""

import os
import resource

import numpy as np
import onnx
import pytest
from onnx import helper, numpy_helper
from support.onnx_files import KINDS, save_graph, save_network

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.onnx_session import (
    OnnxSession,
    chosen_providers,
    load_network,
    read_network,
)

SMALL = (1, 3, 4, 4)


def info(name, shape=SMALL, kind='float32'):
    return helper.make_tensor_value_info(name, KINDS[kind], shape)


def constant(name, array):
    return helper.make_node('Constant', [], [name], value=numpy_helper.from_array(array, name))


def refused(path):
    with pytest.raises(NetworkShapeError) as error:
        load_network(path)
    message = str(error.value)
    assert message.startswith(str(path))
    assert '\n' not in message
    assert len(message) < 300
    return message


def fails(path, tensor=None):
    session = load_network(path)
    with pytest.raises(NetworkShapeError) as error:
        session.run(np.zeros(SMALL, np.float32) if tensor is None else tensor)
    assert str(error.value).startswith(str(path))
    assert '\n' not in str(error.value)


def test_a_network_gives_its_outputs(tmp_path):
    double = helper.make_node('Add', ['image', 'image'], ['out'])
    session = load_network(save_graph(tmp_path / 'n.onnx', [double], [info('out')], SMALL))
    image = np.random.default_rng(0).random(SMALL).astype(np.float32)
    np.testing.assert_allclose(session.run(image)[0], 2 * image)
    assert str(session.spec) == 'image (1, 3, 4, 4) float32 -> out (1, 3, 4, 4) float32'


def test_as_many_inputs_as_a_network_has_are_asked_for(tmp_path):
    double = helper.make_node('Add', ['image', 'image'], ['out'])
    session = load_network(save_graph(tmp_path / 'n.onnx', [double], [info('out')], SMALL))
    image = np.zeros(SMALL, np.float32)
    with pytest.raises(NetworkShapeError, match='expected 1 inputs, found 2'):
        session.run(image, image)


@pytest.mark.parametrize(('there', 'chosen'), [
    (['CPUExecutionProvider'], ['CPUExecutionProvider']),
    (['TensorrtExecutionProvider', 'CUDAExecutionProvider', 'CPUExecutionProvider'],
     ['CUDAExecutionProvider', 'CPUExecutionProvider']),
    (['CPUExecutionProvider', 'CUDAExecutionProvider', 'AzureExecutionProvider'],
     ['CUDAExecutionProvider', 'CPUExecutionProvider'])], ids=str)
def test_a_gpu_is_used_where_there_is_one(there, chosen):
    assert chosen_providers(there) == chosen


def test_half_floats_go_in_and_come_out_as_floats(tmp_path):
    double = helper.make_node('Add', ['image', 'image'], ['out'])
    path = save_graph(
        tmp_path / 'n.onnx', [double], [info('out', kind='float16')], SMALL, 'float16')
    (out,) = load_network(path).run(np.full(SMALL, 0.25, np.float32))
    assert out.dtype == np.float32
    assert (out == 0.5).all()


def test_free_sizes_are_unknown(tmp_path):
    double = helper.make_node('Add', ['image', 'image'], ['out'])
    path = save_graph(tmp_path / 'n.onnx', [double], [info('out', ('n', 3, None, 4))],
                      ('n', 3, 'height', 4))
    assert load_network(path).spec.inputs[0].shape == (None, 3, None, 4)


def test_an_operator_that_nobody_knows_is_told(tmp_path):
    node = helper.make_node('OpenDoor', ['image'], ['out'], domain='evil.example')
    path = save_graph(tmp_path / 'n.onnx', [node], [info('out')], SMALL)
    assert 'evil.example' in refused(path)


def test_weights_in_other_files_are_not_read(tmp_path):
    (tmp_path / 'secret.bin').write_bytes(bytes(4 * 48))
    path = save_graph(tmp_path / 'n.onnx', [helper.make_node('Add', ['image', 'w'], ['out'])],
                      [info('out')], SMALL)
    model = onnx.load(path)
    weights = model.graph.initializer.add()
    weights.CopyFrom(numpy_helper.from_array(np.zeros(SMALL, np.float32), 'w'))
    weights.ClearField('raw_data')
    weights.data_location = onnx.TensorProto.EXTERNAL
    for location in ('secret.bin', '../secret.bin', '/etc/passwd'):
        del weights.external_data[:]
        entry = weights.external_data.add()
        entry.key, entry.value = 'location', location
        path.write_bytes(model.SerializeToString())
        refused(path)


def test_a_constant_of_gigabytes_is_not_made_while_loading(tmp_path):
    nodes = [
        constant('size', np.array([2**28], np.int64)),
        helper.make_node('ConstantOfShape', ['size'], ['big']),
        helper.make_node('ReduceSum', ['big'], ['sum']),
        helper.make_node('Add', ['image', 'sum'], ['out']),
    ]
    path = save_graph(tmp_path / 'n.onnx', nodes, [info('out')], SMALL)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    load_network(path)
    grown_mb = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    assert grown_mb < 300  # the constant has 1024


def test_a_tensor_that_no_memory_holds_is_told_when_run(tmp_path):
    nodes = [
        constant('size', np.array([10**12], np.int64)),
        helper.make_node('ConstantOfShape', ['size'], ['big']),
        helper.make_node('ReduceSum', ['big'], ['sum']),
        helper.make_node('Add', ['image', 'sum'], ['out']),
    ]
    fails(save_graph(tmp_path / 'n.onnx', nodes, [info('out')], SMALL))


def test_declared_sizes_have_bounds(tmp_path):
    double = helper.make_node('Add', ['image', 'image'], ['out'])
    shape = (1, 3, 100_000, 100_000)
    path = save_graph(tmp_path / 'n.onnx', [double], [info('out', shape)], shape)
    assert '134217728 elements' in refused(path)


def test_outputs_of_another_shape_than_declared_are_told(tmp_path):
    # Only the image's content decides how many columns there are: none for a black one.
    node = helper.make_node('NonZero', ['image'], ['out'])
    path = save_graph(tmp_path / 'n.onnx', [node], [info('out', (4, 7), 'int64')], SMALL)
    with pytest.raises(NetworkShapeError, match=r'expected out \(4, 7\) int64, found shape'):
        load_network(path).run(np.zeros(SMALL, np.float32))


def test_outputs_of_nobody_at_all_are_told(tmp_path):
    nodes = [helper.make_node('NonZero', ['image'], ['cells']),
             helper.make_node('Transpose', ['cells'], ['out'])]
    path = save_graph(tmp_path / 'n.onnx', nodes, [info('out', ('n', 4), 'int64')], SMALL)
    fails(path)


def test_texts_are_no_outputs(tmp_path):
    text = helper.make_tensor('t', onnx.TensorProto.STRING, [1], [b'open the door'])
    node = helper.make_node('Constant', [], ['out'], value=text)
    value = helper.make_tensor_value_info('out', onnx.TensorProto.STRING, [1])
    path = save_graph(tmp_path / 'n.onnx', [node], [value], SMALL)
    assert 'expected tensors of numbers' in refused(path)


def test_sequences_are_no_outputs(tmp_path):
    node = helper.make_node('SequenceConstruct', ['image'], ['out'])
    value = helper.make_tensor_sequence_value_info('out', onnx.TensorProto.FLOAT, SMALL)
    path = save_graph(tmp_path / 'n.onnx', [node], [value], SMALL)
    assert 'expected tensors of numbers' in refused(path)


def test_a_network_that_fails_on_its_input_is_told(tmp_path):
    path = save_network(tmp_path / 'n.onnx', {'out': np.zeros((1, 2), np.float32)}, SMALL,
                        'float32')
    fails(path, np.zeros((1, 3, 9, 9), np.float32))


def test_an_endless_network_is_ended(tmp_path):
    """A loop of 2^60 rounds, each of which adds one."""
    body = helper.make_graph(
        [helper.make_node('Identity', ['go'], ['go_on']),
         helper.make_node('Add', ['before', 'one'], ['after'])], 'body',
        [helper.make_tensor_value_info('round', KINDS['int64'], ()),
         helper.make_tensor_value_info('go', onnx.TensorProto.BOOL, ()), info('before')],
        [helper.make_tensor_value_info('go_on', onnx.TensorProto.BOOL, ()), info('after')])
    nodes = [constant('rounds', np.array(2**60, np.int64)), constant('start', np.array(True)),
             constant('one', np.ones(SMALL, np.float32)),
             helper.make_node('Loop', ['rounds', 'start', 'image'], ['out'], body=body)]
    path = save_graph(tmp_path / 'n.onnx', nodes, [info('out')], SMALL)
    session = OnnxSession(path.read_bytes(), str(path), longest_s=0.5)
    with pytest.raises(NetworkShapeError, match='expected outputs within'):
        session.run(np.zeros(SMALL, np.float32))


@pytest.mark.parametrize('content', [b'', b'no network', bytes(range(256)) * 40, b'\x08' * 10**6])
def test_bytes_that_are_no_network_are_told(tmp_path, content):
    (tmp_path / 'n.onnx').write_bytes(content)
    assert 'expected an ONNX network' in refused(tmp_path / 'n.onnx')


def test_damaged_networks_are_told(tmp_path):
    path = save_network(
        tmp_path / 'n.onnx', {'out': np.zeros((1, 9), np.float32)}, SMALL, 'float32')
    good = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(60):
        bad = bytearray(good)
        for _ in range(int(rng.integers(1, 6))):
            bad[int(rng.integers(len(bad)))] = int(rng.integers(256))
        try:
            session = OnnxSession(bytes(bad[: int(rng.integers(1, len(bad) + 1))]), 'n.onnx')
            session.run(np.zeros(SMALL, np.float32))
        except NetworkShapeError as error:
            assert '\n' not in str(error)  # noqa: PT017 - some of them still are networks


def test_a_folder_a_pipe_and_nothing_are_no_networks(tmp_path):
    os.mkfifo(tmp_path / 'pipe.onnx')
    (tmp_path / 'folder.onnx').mkdir()
    for name in ('pipe.onnx', 'folder.onnx', 'none.onnx'):
        with pytest.raises(NetworkShapeError, match='expected an ONNX file'):
            read_network(tmp_path / name)


def test_a_file_too_large_to_be_a_network_is_not_read(tmp_path):
    with (tmp_path / 'n.onnx').open('wb') as file:
        file.truncate(2**31 + 1)  # takes no room on the disk
    with pytest.raises(NetworkShapeError, match='expected an ONNX file of up to'):
        read_network(tmp_path / 'n.onnx')
