"""`pop models` from the command line."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from onnx import helper, numpy_helper
from support.onnx_files import KINDS, save_graph, save_network

from pop_ros.network_registry import known_entry, load_registry, networks_folder, save_record

ROOT = Path(__file__).resolve().parents[2]
PEOPLE = {'dets': np.zeros((1, 4, 5), np.float32),
          'keypoints': np.zeros((1, 4, 17, 3), np.float32)}


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path / 'cache'))


def pop(*arguments, code=0):
    environment = {**os.environ, 'PYTHONPATH': str(ROOT), 'COLUMNS': '200'}
    done = subprocess.run(
        [sys.executable, '-m', 'pop_ros.cli', 'models', *map(str, arguments)],
        capture_output=True, text=True, env=environment, timeout=120, check=False)
    assert done.returncode == code, done.stderr
    assert 'Traceback' not in done.stderr
    return done.stdout if code == 0 else done.stderr


def test_the_list_says_what_is_here_and_what_lacks_a_hash():
    entry = known_entry('movenet-multipose')
    networks_folder().mkdir(parents=True)
    entry.path.write_bytes(b'network')
    save_record(entry, b'network', hashlib.sha256(b'network').hexdigest())
    known_entry('rtmo-l').path.write_bytes(b'something')
    state = {line.split()[0]: line for line in pop('list').splitlines() if line.strip()}
    assert ' yes ' in state['movenet-multipose']
    assert ' damaged ' in state['rtmo-l']
    assert ' no ' in state['rtmo-m']
    assert 'needs --sha256' in state['rtmpose-m']
    assert 'Apache-2.0' in state['rtmo-m']


def test_the_long_list_says_where_networks_come_from_and_what_they_hash_to():
    said = pop('list', '--urls')
    for entry in load_registry():
        assert entry.url in said
        assert (entry.sha256 or 'give it with --sha256') in said


def test_check_says_how_a_file_is_read_what_it_hashes_to_and_how_long_it_takes(tmp_path):
    path = save_network(tmp_path / 'net.onnx', PEOPLE, (1, 3, 64, 64), 'float32')
    out = pop('check', path)
    assert 'read as rtmo' in out
    assert hashlib.sha256(path.read_bytes()).hexdigest() in out
    assert 'ms per image' in out


def test_check_goes_on_after_a_bad_one(tmp_path):
    (tmp_path / 'bad.onnx').write_bytes(b'no network')
    good = save_network(tmp_path / 'net.onnx', PEOPLE, (1, 3, 64, 64), 'float32')
    error = pop('check', tmp_path / 'bad.onnx', tmp_path / 'none.onnx', good, code=2)
    assert len(error.splitlines()) == 2


def test_a_network_that_eats_all_memory_fails_alone(tmp_path):
    size = numpy_helper.from_array(np.array([2**32], np.int64), 's')
    nodes = [
        helper.make_node('Constant', [], ['s'], value=size),
        helper.make_node('ConstantOfShape', ['s'], ['big']),
        helper.make_node('ReduceMax', ['big'], ['dets'], keepdims=0),
        helper.make_node('Constant', [], ['keypoints'],
                         value=numpy_helper.from_array(PEOPLE['keypoints'], 'k')),
    ]
    values = [helper.make_tensor_value_info('dets', KINDS['float32'], (1, None, 5)),
              helper.make_tensor_value_info('keypoints', KINDS['float32'], (1, 4, 17, 3))]
    path = save_graph(tmp_path / 'net.onnx', nodes, values, (1, 3, 64, 64))
    error = pop('check', path, code=2)
    assert len(error.splitlines()) == 1
    assert str(path) in error


def test_names_that_are_not_known_are_told_with_those_that_are():
    assert 'rtmo-m' in pop('fetch', 'nonsense', code=2)


def test_one_hash_is_for_one_network():
    assert 'one NAME' in pop('fetch', 'rtmo-m', 'rtmo-l', '--sha256', '0' * 64, code=2)


def test_without_networks_check_says_so():
    assert 'no network was fetched' in pop('check')
