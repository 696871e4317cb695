"""The rules of docs/architecture.md, as tests over the source itself."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Top to bottom: a module may import its own part and what stands on lines below.
LAYERS = (
    ('pop_ros',),
    ('pop_core.tracking',),
    ('pop_core.pipeline',),
    ('pop_core.config',),
    ('pop_core.fitting',),
    ('pop_core.segmentation', 'pop_core.retrieval'),
    ('pop_core.completion',),
    ('pop_core.rendering', 'pop_core.keypoints'),
    ('pop_core.estimate',),
    ('pop_core.body',),
    ('pop_core.rgbd', 'pop_core.depth_noise'),
    ('pop_core.geometry',),
    ('pop_core.settings', 'pop_core.stopwatch'),
    ('pop_core.errors',),
)
LINE = {part: number for number, parts in enumerate(LAYERS) for part in parts}
ABOVE_ALL = ('pop_core.synthesis', 'pop_core.training')
MAY_USE_SYNTHESIS = re.compile(r'pop_ros\.(\w+_commands?|demo\w*)$')
ROS = re.compile(r'^(rclpy|rosbags|\w+_msgs|builtin_interfaces|rcl_interfaces|ament_\w+)(\.|$)')


def modules() -> dict[str, Path]:
    paths = [p for package in ('pop_core', 'pop_ros') for p in (ROOT / package).rglob('*.py')]
    return {_name(path): path for path in paths}


def _name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix('').parts
    return '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)


def imports(path: Path) -> set[str]:
    """Return every module named by an import, those inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f'{path}: relative import'
            found.add(node.module)
            if (ROOT / node.module.replace('.', '/')).is_dir():
                found |= {f'{node.module}.{alias.name}' for alias in node.names}
    return found


def part_of(name: str) -> str | None:
    """Return the part of the architecture a module belongs to."""
    known = [*LINE, *ABOVE_ALL]
    return next((part for part in known if name == part or name.startswith(part + '.')), None)


def test_every_module_has_a_place_in_the_architecture():
    homeless = [name for name in modules() if part_of(name) is None and name != 'pop_core']
    assert homeless == []


def test_imports_point_downwards():
    wrong = []
    for name, path in modules().items():
        own = part_of(name)
        if own in ABOVE_ALL or own is None:
            continue
        for other in imports(path):
            part = part_of(other)
            if part in LINE and part != own and LINE[part] <= LINE[own]:
                wrong.append(f'{name} imports {other}')
    assert wrong == []


def test_the_live_path_does_not_know_synthesis_training_or_batch():
    wrong = []
    for name, path in modules().items():
        allowed = part_of(name) in ABOVE_ALL or MAY_USE_SYNTHESIS.match(name)
        used = [other for other in imports(path) if part_of(other) in ABOVE_ALL]
        if used and not allowed:
            wrong.append(f'{name} imports {used}')
    assert wrong == []


@pytest.mark.parametrize(
    ('library', 'home'),
    [
        (ROS, re.compile(r'pop_ros')),
        (re.compile(r'^torch(\.|$)'), re.compile(r'pop_core\.(training|batch)')),
        (re.compile(r'^time$'), re.compile(r'pop_ros|pop_core\.stopwatch|pop_core\.training')),
        (re.compile(r'^(typer|rich)(\.|$)'), re.compile(r'pop_ros|pop_core\.training')),
    ],
    ids=['ros', 'torch', 'clocks', 'terminal'],
)
def test_libraries_are_imported_only_where_they_belong(library, home):
    wrong = [
        f'{name} imports {other}'
        for name, path in modules().items() if not home.match(name)
        for other in imports(path) if library.match(other)
    ]
    assert wrong == []


def test_versions_agree():
    patterns = {
        'setup.py': r"^VERSION = '([^']+)'",
        'pop_core/__init__.py': r"^__version__ = '([^']+)'",
        'package.xml': r'<version>([^<]+)</version>',
        'msg_defs/package.xml': r'<version>([^<]+)</version>',
        'CHANGELOG.rst': r'^(\d+\.\d+\.\d+) \(',
    }
    found = {}
    for name, pattern in patterns.items():
        match = re.search(pattern, (ROOT / name).read_text(encoding='utf-8'), re.MULTILINE)
        found[name] = match.group(1) if match else None
    assert len(set(found.values())) == 1, found


def test_mypy_knows_every_kernel_module():
    # Kernels carry no annotations, and mypy takes no pattern for the end of a name.
    listed = re.findall(
        r'"([\w.]+_kernels)"', (ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
    assert sorted(listed) == sorted(name for name in modules() if name.endswith('_kernels'))
