"""The launch file starts the node that its arguments ask for.

ROS 2's launch is not on PyPI: a double stands in for it that keeps what it is given. What the
node makes of its arguments and parameter files is tested with the node itself.
"""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml
from support.node import ROOT, RunningNode

from pop_core.config import PipelineConfig
from pop_core.settings import apply_settings, list_settings
from pop_ros.camera_presets import CAMERA_PRESETS
from pop_ros.model_files import ModelFiles
from pop_ros.node_arguments import parse_arguments
from pop_ros.node_config import NodeConfig

DOUBLE = ROOT / 'test' / 'support' / 'launch_double'
FILES = sorted((ROOT / 'config').glob('*.yaml'))


@pytest.fixture
def launch_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """Return the launch file as a module, found as in an installation."""
    prefix = tmp_path / 'prefix'
    index = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
    index.mkdir(parents=True)
    (index / 'pop_ros').touch()
    (prefix / 'share' / 'pop_ros').symlink_to(ROOT, target_is_directory=True)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix))
    monkeypatch.setattr(sys, 'path', [str(DOUBLE), *sys.path])
    spec = importlib.util.spec_from_file_location(
        'pop_launch', ROOT / 'launch' / 'pop.launch.py')
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    for name in [n for n in sys.modules if n.split('.')[0] in ('launch', 'launch_ros')]:
        del sys.modules[name]


def perform(module: ModuleType, **arguments: str) -> tuple[dict[str, str], list[Any]]:
    """Return the environment and the nodes that a launch with these arguments starts."""
    entities = module.generate_launch_description().entities
    context = module.LaunchContext()
    environment, started = {}, []
    for entity in entities:
        if isinstance(entity, module.DeclareLaunchArgument):
            value = arguments.pop(entity.name, entity.default_value)
            context.launch_configurations[entity.name] = value
    assert not arguments, 'the launch file does not declare these'
    for entity in entities:
        if entity.condition is not None and not entity.condition.evaluate(context):
            continue
        if isinstance(entity, module.SetEnvironmentVariable):
            environment[entity.name] = entity.value
        elif isinstance(entity, module.OpaqueFunction):
            started += [e for e in entity.function(context) if isinstance(e, module.Node)]
        elif isinstance(entity, module.Node):
            started.append(entity)
    return environment, started


@pytest.mark.parametrize('camera', sorted(CAMERA_PRESETS))
def test_a_camera_s_topics_become_the_node_s_inputs(
    launch_file: ModuleType, camera: str
) -> None:
    _, (node,) = perform(launch_file, camera=camera, keypoints='network.onnx')
    topics = CAMERA_PRESETS[camera].topics
    assert dict(node.remappings) == {
        'color/image': topics.color, 'depth/image': topics.depth,
        'color/camera_info': topics.info}
    assert parse_arguments(node.arguments).sources.keypoints == 'network.onnx'
    assert (node.package, node.executable, node.name) == ('pop_ros', 'pop_node', 'pop')


def test_body_and_library_become_the_node_s(launch_file: ModuleType) -> None:
    _, (node,) = perform(launch_file, body='/my/smpl.npz', library='/my/all.poplib')
    files = ModelFiles(Path('/my/smpl.npz'), Path('/my/all.poplib'))
    assert parse_arguments(node.arguments).models == files
    _, (node,) = perform(launch_file)
    assert parse_arguments(node.arguments).models == ModelFiles()


def test_topics_named_by_hand_win_over_the_camera_s(launch_file: ModuleType) -> None:
    _, (node,) = perform(launch_file, camera='zed', depth='/my/depth')
    assert dict(node.remappings)['depth/image'] == '/my/depth'
    assert dict(node.remappings)['color/image'] == CAMERA_PRESETS['zed'].topics.color


def test_parameter_files_are_layered_in_the_order_given(
    launch_file: ModuleType, tmp_path: Path
) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.touch()
    _, (node,) = perform(launch_file, params_file=f'pop.yaml, small_messages.yaml,{mine}')
    assert [Path(p).name for p in node.parameters] == [
        'pop.yaml', 'small_messages.yaml', 'mine.yaml']
    assert all(Path(p).is_file() for p in node.parameters)


def test_rviz_and_the_fast_dds_profile_are_switches(launch_file: ModuleType) -> None:
    environment, nodes = perform(launch_file, rviz='true')
    assert Path(environment['FASTRTPS_DEFAULT_PROFILES_FILE']).is_file()
    rviz, = (n for n in nodes if n.package == 'rviz2')
    assert Path(rviz.arguments[1]).is_file()
    environment, nodes = perform(launch_file, large_data='false')
    assert not environment
    assert [n.package for n in nodes] == ['pop_ros']


@pytest.mark.parametrize('path', FILES, ids=lambda path: path.name)
def test_parameter_files_hold_settings_that_are_accepted(path: Path) -> None:
    given = yaml.safe_load(path.read_text(encoding='utf-8'))['/**']['ros__parameters']
    for config in (NodeConfig(), PipelineConfig()):
        own = {item.name for item in list_settings(config)}
        apply_settings(config, {name: value for name, value in given.items() if name in own})
        given = {name: value for name, value in given.items() if name not in own}
    assert not given


def test_the_node_reads_all_parameter_files_and_later_ones_win(tmp_path: Path) -> None:
    mine = tmp_path / 'mine.yaml'
    mine.write_text('/**:\n  ros__parameters:\n    mesh.detail: "huge"\n', encoding='utf-8')
    files = [part for path in [*FILES, mine] for part in ('--params-file', str(path))]
    running = RunningNode('--ros-args', *files)
    # Everything before was accepted, or that would be told.
    assert running.wait() == 2
    running.end()
    assert "mesh.detail: expected one of full, reduced, off, found 'huge'" in running.output
