"""`pop replay --set`: settings of pipeline and node, in this process and in that of a node."""

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node

from pop_core.config import PipelineConfig
from pop_core.errors import SettingError
from pop_ros.node_config import NodeConfig
from pop_ros.parameters import ConfigParameters
from pop_ros.replay_settings import ReplaySettings

# One of each kind, and those that YAML would take for another kind.
FLAGS = (
    'max_people=3', 'max_range_m=7', 'region.x_min_m=-2.5', 'tracking.enabled=false',
    'mesh.lifetime_s=0.000001', 'mesh.detail=off', 'snapshot.folder=1',
    'depth.extrinsics=0 0 0.1 0 0 0 1')


@pytest.fixture
def context() -> Iterator[Context]:
    made = Context()
    yield made
    rclpy.shutdown(context=made)


def test_a_node_that_is_given_them_has_the_same_settings(context: Context) -> None:
    settings = ReplaySettings.of_flags(FLAGS)
    assert (settings.pipeline.max_range_m, settings.node.mesh.detail) == (7.0, 'off')
    rclpy.init(args=['node', '--ros-args', *settings.as_ros_arguments()], context=context)
    node = Node('of_a_replay', context=context)
    found = ConfigParameters(node, NodeConfig(), PipelineConfig(), lambda: None)
    assert found.pipeline_config == settings.pipeline
    assert found.node_config == settings.node
    node.destroy_node()


def test_defaults_need_no_words() -> None:
    assert ReplaySettings.of_flags([]) == ReplaySettings()
    assert ReplaySettings.of_flags(['tracking.enabled=true']).as_ros_arguments() == []


@pytest.mark.parametrize(('flag', 'told'), [
    ('max_peple=3', r'max_peple: expected one of .*max_people.*tracking\.enabled'),
    ('max_people', 'expected NAME=VALUE'),
    ('max_people=many', 'expected int'),
    ('mesh.detail=huge', 'expected one of full, reduced, off'),
    ('sync.slop_s=0.1', 'expected sync.slop_s as --slop'),
    ('enabled=false', 'autostart and enabled'),
    ('autostart=false', 'autostart and enabled'),
])
def test_what_does_not_fit_is_refused_with_what_would(flag: str, told: str) -> None:
    with pytest.raises(SettingError, match=told):
        ReplaySettings.of_flags([flag])
