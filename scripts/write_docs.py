"""Write what is generated from the settings: `python -m scripts.write_docs`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from pop_core.config import PipelineConfig
from pop_core.settings import Setting, list_settings
from pop_ros.node_config import NodeConfig

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / 'docs' / 'parameters.md'
PARAMETER_FILE = ROOT / 'config' / 'pop.yaml'
HEADER = """\
# Settings

Written by `make docs` from the code; a test keeps it current. Every setting is a ROS parameter of
the node (`--ros-args -p fitting.surface_hypotheses:=6`); those of the pipeline are also flags of
`pop fit` (`--set fitting.surface_hypotheses=6`), and with those of the node also of `pop replay`.
A value of another type, out of range, or of an unknown name is refused with a sentence.
"""


def parameters_page() -> str:
    """Return docs/parameters.md."""
    parts = [
        HEADER, '## Pipeline\n', _table(list_settings(PipelineConfig())),
        '## Node only\n', _table(list_settings(NodeConfig()))]
    return '\n'.join(parts)


FILE_HEADER = """\
# Every parameter of the node with its default; written by `make docs` from the code.
#
# Keep in a file of your own only what you change, in this form, and give it behind this one:
#   pop node --ros-args --params-file pop.yaml --params-file mine.yaml
#   ros2 launch pop_ros pop.launch.py params_file:=mine.yaml,small_messages.yaml
# Later files win. `ros2 param dump /pop` writes the present values of a running node.
/**:
  ros__parameters:
"""


def parameter_file() -> str:
    """Return config/pop.yaml."""
    parts = [FILE_HEADER]
    for title, config in (('The node', NodeConfig()), ('The pipeline', PipelineConfig())):
        parts.append(f'    # {title}\n')
        parts += [_entry(item) for item in list_settings(config)]
    return ''.join(parts)


def _entry(item: Setting) -> str:
    # JSON's scalars are YAML's, and its quotes keep `off` from being read as false.
    bounds = '' if item.minimum is None else f', {item.minimum:g} to {item.maximum:g}'
    about = f'{item.about.rstrip(".")}{f" [{item.unit}]" if item.unit else ""}{bounds}'
    return f'    # {about}\n    {item.name}: {json.dumps(item.default)}\n'


def _table(settings: Iterable[Setting]) -> str:
    head = '| name | default | range | what it does |\n|---|---|---|---|\n'
    return head + ''.join(_row(item) for item in settings)


def _row(item: Setting) -> str:
    value = str(item.default).lower() if isinstance(item.default, bool) else str(item.default)
    default = f'{value} {item.unit}'.strip()
    bounds = '' if item.minimum is None else f'{item.minimum:g} to {item.maximum:g}'
    return f'| `{item.name}` | {default} | {bounds} | {item.about} |\n'


if __name__ == '__main__':
    PAGE.write_text(parameters_page(), encoding='utf-8')
    PARAMETER_FILE.write_text(parameter_file(), encoding='utf-8')
