"""Files of depth networks: what they tell of themselves, and which look they are for."""

import math

import onnx
import pytest

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.close_view import BEFORE_M, SHOWN_AT_M
from pop_core.keypoints.depth_net import load_depth_net
from pop_core.keypoints.depth_network import EMBEDDED, DepthNetwork, close_path
from pop_core.keypoints.onnx_session import load_network


def told(path, **facts):
    """Write the embedded network with other facts; None leaves one out."""
    model = onnx.load(EMBEDDED)
    known = {fact.key: fact.value for fact in model.metadata_props} | facts
    del model.metadata_props[:]
    for key, value in known.items():
        if value is not None:
            model.metadata_props.add(key=key, value=value)
    onnx.save(model, str(path))
    return path


def test_a_network_of_whole_images_shows_near_people_as_they_are():
    network = DepthNetwork(load_network(EMBEDDED))
    assert not network.is_close
    assert network.enlarged(0.5 * SHOWN_AT_M) == 1.0
    assert network.enlarged(2.0 * SHOWN_AT_M) == 2.0
    assert network.before_m(SHOWN_AT_M) == math.inf
    assert network.before_m(2.0 * SHOWN_AT_M) == BEFORE_M


def test_a_network_of_near_looks_shows_everybody_at_one_distance(tmp_path):
    network = DepthNetwork(load_network(told(tmp_path / 'net.onnx', shown_at_m='2.5')))
    assert network.is_close
    assert network.enlarged(1.25) == 0.5
    assert network.enlarged(5.0) == 2.0
    assert {network.before_m(z_m) for z_m in (1.25, 2.5, 5.0)} == {BEFORE_M}


@pytest.mark.parametrize('fact', [
    {'shown_at_m': 'near'}, {'shown_at_m': '0'}, {'shown_at_m': 'nan'}, {'focal_px': 'inf'},
    {'focal_px': None}])
def test_facts_that_make_no_sense_are_told(tmp_path, fact):
    session = load_network(told(tmp_path / 'net.onnx', **fact))
    (name,) = fact
    with pytest.raises(NetworkShapeError, match=rf'net\.onnx: expected {name} of .* found'):
        DepthNetwork(session)


def test_cells_of_another_size_are_told(tmp_path):
    model = onnx.load(told(tmp_path / 'net.onnx'))
    output = model.graph.output[0]
    coarse = onnx.helper.make_node(
        'AveragePool', ['fine'], [output.name], kernel_shape=[2, 2], strides=[2, 2])
    for node in model.graph.node:
        node.output[:] = ['fine' if name == output.name else name for name in node.output]
    model.graph.node.append(coarse)
    onnx.save(model, str(tmp_path / 'net.onnx'))
    with pytest.raises(NetworkShapeError, match=r'a cell for every 4 pixels.*32x32.*\(4, 4\)'):
        DepthNetwork(load_network(tmp_path / 'net.onnx'))


def test_what_a_file_says_of_itself_is_one_line(tmp_path):
    session = load_network(told(tmp_path / 'net.onnx', about='one\ntwo\x1b ' + 1000 * 'x'))
    about = DepthNetwork(session).about
    assert about.startswith('one two xxx')
    assert len(about) <= 160


def test_another_format_is_told(tmp_path):
    session = load_network(told(tmp_path / 'net.onnx', pop_depth_net='2'))
    with pytest.raises(NetworkShapeError, match=r'format 1; found .* format 2'):
        DepthNetwork(session)


def test_a_network_of_near_looks_is_taken_from_beside(tmp_path):
    whole = told(tmp_path / 'net.onnx')
    assert 'net_close' not in load_depth_net(whole).reason
    told(close_path(whole), shown_at_m='2.0', about='near looks')
    detector = load_depth_net(whole)
    assert 'net_close.onnx (near looks)' in detector.reason


def test_networks_of_the_wrong_look_are_told(tmp_path):
    close = told(tmp_path / 'close.onnx', shown_at_m='2.0')
    with pytest.raises(NetworkShapeError, match=r'close\.onnx: expected a network of whole'):
        load_depth_net(close)
    whole = told(tmp_path / 'net.onnx')
    told(close_path(whole))
    with pytest.raises(NetworkShapeError, match=r'net_close\.onnx: expected a network of near'):
        load_depth_net(whole)
