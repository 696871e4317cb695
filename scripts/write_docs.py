"""Write the generated pages of docs/: `python -m scripts.write_docs`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from pop_core.config import PipelineConfig
from pop_core.settings import Setting, list_settings
from pop_ros.node_config import NodeConfig

DOCS = Path(__file__).resolve().parents[1] / 'docs'
HEADER = """\
# Settings

Written by `make docs` from the code; a test keeps it current. Every setting is a ROS parameter of
the node (`--ros-args -p fitting.surface_hypotheses:=6`); those of the pipeline are also flags of
`pop fit` (`--set fitting.surface_hypotheses=6`). A value of another type, out of range, or of an
unknown name is refused with a sentence.
"""


def parameters_page() -> str:
    """Return docs/parameters.md."""
    parts = [
        HEADER, '## Pipeline\n', _table(list_settings(PipelineConfig())),
        '## Node only\n', _table(list_settings(NodeConfig()))]
    return '\n'.join(parts)


def _table(settings: Iterable[Setting]) -> str:
    head = '| name | default | range | what it does |\n|---|---|---|---|\n'
    return head + ''.join(_row(item) for item in settings)


def _row(item: Setting) -> str:
    value = str(item.default).lower() if isinstance(item.default, bool) else str(item.default)
    default = f'{value} {item.unit}'.strip()
    bounds = '' if item.minimum is None else f'{item.minimum:g} to {item.maximum:g}'
    return f'| `{item.name}` | {default} | {bounds} | {item.about} |\n'


if __name__ == '__main__':
    (DOCS / 'parameters.md').write_text(parameters_page(), encoding='utf-8')
