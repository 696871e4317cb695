"""rviz2 is shown the same as rviz of ROS 1, whose pictures are tested."""

from typing import Any

import pytest
from ruamel.yaml import YAML
from support.node import ROOT

from pop_ros.qos import output_qos

# What rviz_common and rviz_default_plugins of Jazzy export, as far as it is of use here.
RVIZ2 = {
    'rviz_common/Displays', 'rviz_common/Views', 'rviz_common/Time',
    *(f'rviz_default_plugins/{name}' for name in (
        'Grid', 'Marker', 'MarkerArray', 'PoseArray', 'PointCloud2', 'Image', 'TF', 'MoveCamera',
        'Interact', 'Measure', 'Orbit')),
}


def load(name: str) -> dict[str, Any]:
    return YAML(typ='safe').load((ROOT / 'rviz' / name).read_text())


def classes(value: Any) -> list[str]:
    """Return every class that a configuration names."""
    if isinstance(value, list):
        return [name for item in value for name in classes(item)]
    if not isinstance(value, dict):
        return []
    own = [value['Class']] if value.get('Class') else []
    return own + [name for item in value.values() for name in classes(item)]


def displays(config: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the displays in the words of ROS 1's rviz."""
    out = []
    for display in config['Visualization Manager']['Displays']:
        same = {key: value for key, value in display.items()
                if key not in {'Queue Size', 'Marker Topic', 'Topic'}}
        topic = display.get('Marker Topic', display.get('Topic'))
        same['topic'] = topic['Value'] if isinstance(topic, dict) else topic
        same['Class'] = display['Class'].split('/')[1]
        out.append(same)
    return out


@pytest.mark.parametrize('name', ['pop.rviz', 'pop_viewer.rviz'])
def test_rviz2_has_every_class_that_is_named(name: str) -> None:
    assert set(classes(load(name))) <= RVIZ2


def test_both_configurations_show_the_same() -> None:
    ros1, ros2 = load('pop_ros1.rviz'), load('pop.rviz')
    assert displays(ros1) == displays(ros2)
    views = [config['Visualization Manager']['Views']['Current'] for config in (ros1, ros2)]
    assert {**views[0], 'Class': ''} == {**views[1], 'Class': ''}


def test_rviz2_asks_for_what_the_node_offers() -> None:
    offered = output_qos().reliability.name.title()
    for display in load('pop.rviz')['Visualization Manager']['Displays']:
        if 'Topic' in display:
            assert display['Topic']['Reliability Policy'] == offered
