"""Write constraints.txt: one pin per package where all Pythons agree, markers where not.

For each Python, resolve the requirements without installing them, then merge the reports:

    python3.X -m pip install --dry-run --ignore-installed --report 3.X.json '.[test,viz]'
    python scripts/pin_constraints.py 3.10.json 3.11.json 3.12.json 3.13.json > constraints.txt
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path

HEADER = """\
# Versions that the tests were run with; written by scripts/pin_constraints.py.
# empy: the message generators of ROS 2 Jazzy need version 3."""
FORCED = {'empy': '3.3.4'}
LEFT_OUT = {'pop-ros'}


def pins_of(report: Path) -> tuple[str, dict[str, str]]:
    """Return the Python (such as '3.11') of a pip report, and version by package."""
    content = json.loads(report.read_text(encoding='utf-8'))
    python = '.'.join(content['environment']['python_full_version'].split('.')[:2])
    found = (item['metadata'] for item in content['install'])
    pins = {item['name'].lower().replace('_', '-'): item['version'] for item in found}
    return python, {**pins, **FORCED}


def lines(reports: list[Path]) -> list[str]:
    """Return the lines of the constraints file."""
    by_python = dict(pins_of(report) for report in reports)
    pythons: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for python, pins in by_python.items():
        for name, version in pins.items():
            pythons[name][version].append(python)
    out = []
    for name in sorted(pythons.keys() - LEFT_OUT):
        for version, where in sorted(pythons[name].items()):
            out.append(f'{name}=={version}{marker(where, list(by_python))}')
    return out


def marker(where: list[str], everywhere: list[str]) -> str:
    """Return the environment marker of some of the Pythons; none when it is all of them."""
    if len(where) == len(everywhere):
        return ''
    return '; ' + ' or '.join(f"python_version == '{python}'" for python in where)


if __name__ == '__main__':
    print('\n'.join([HEADER, *lines([Path(name) for name in sys.argv[1:]])]))
