"""docs/ros_api.md names what the node has, no more and no less."""

import re

import yaml
from support.node import ROOT

from pop_core.config import PipelineConfig
from pop_core.settings import list_settings
from pop_ros.body_messages import OUTPUT_TYPES
from pop_ros.camera_presets import CAMERA_PRESETS
from pop_ros.from_messages import COLOR_CHANNELS, DEPTH_TYPES
from pop_ros.inputs import TRANSPORTS
from pop_ros.interop import INTEROP
from pop_ros.node_config import NodeConfig

PAGE = (ROOT / 'docs' / 'ros_api.md').read_text(encoding='utf-8')


def first_cells(section: str) -> set[str]:
    """Return the names in the first column of the tables of a section."""
    text = PAGE.split(f'## {section}\n')[1].split('\n## ')[0]
    return set(re.findall(r'^\| `([^`]+)` \|', text, re.MULTILINE))


def test_outputs_are_those_of_the_node() -> None:
    # Whichever message packages are installed here, the page tells of all their topics.
    names = {*OUTPUT_TYPES, *INTEROP, 'bodies', 'body_model'} - {'tf'}
    assert first_cells('Outputs') == {f'~/{name}' for name in names} | {'/tf', '/diagnostics'}


def test_inputs_and_their_transports_are_those_of_the_node() -> None:
    assert first_cells('Inputs') == set(TRANSPORTS)
    for role, transports in TRANSPORTS.items():
        for suffix, _ in transports:
            assert f'`{role}{suffix}`' in PAGE


def test_encodings_are_those_that_are_decoded() -> None:
    for encoding in (*COLOR_CHANNELS, *DEPTH_TYPES):
        assert re.search(rf'[` ]{encoding}[` ]', PAGE), encoding


def test_parameters_of_the_node_stand_with_their_defaults() -> None:
    # Those of a part of the core stand in parameters.md only.
    settings = {item.name: item.default for item in list_settings(NodeConfig())
                if not item.name.startswith('tracking.')}
    assert first_cells('Parameters') == set(settings)
    for name, default in settings.items():
        shown = f'{default:g}' if type(default) is float else str(default)
        assert f'| `{name}` | {shown.lower()} |' in PAGE


def test_cameras_are_those_with_presets() -> None:
    named = re.search(r'`--camera ([^`]+)`', PAGE)
    assert named is not None
    assert set(named[1].split('|')) == set(CAMERA_PRESETS)


def test_rviz_configurations_show_what_is_published() -> None:
    for name in ('pop.rviz', 'pop_ros1.rviz'):
        text = (ROOT / 'rviz' / name).read_text(encoding='utf-8')
        assert yaml.safe_load(text)['Visualization Manager']['Displays']
        assert set(re.findall(r'/pop/(\w+)', text)) <= set(OUTPUT_TYPES)


def test_the_camera_tutorial_lists_every_camera_and_what_to_switch_on() -> None:
    page = (ROOT / 'docs' / 'camera.md').read_text(encoding='utf-8')
    rows = re.findall(r'^\| `(\w+)` \| ([^|]+) \| ([^|]+) \|$', page, re.MULTILINE)
    assert rows == [(name, p.driver, p.hint) for name, p in CAMERA_PRESETS.items()]


def test_the_camera_tutorial_names_parameters_that_exist() -> None:
    page = (ROOT / 'docs' / 'camera.md').read_text(encoding='utf-8')
    known = {item.name for config in (NodeConfig(), PipelineConfig())
             for item in list_settings(config)}
    named = set(re.findall(r'`((?:region|diagnostics|tf|mesh|sync)\.\w+)', page))
    assert named
    assert named <= known
