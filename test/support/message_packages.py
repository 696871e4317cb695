"""Message packages built by `make messages`, for processes that tests start."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.node import ROOT

BUILDS = Path(os.environ.get('POP_MESSAGES_BUILD', ROOT / 'build'))
PATHS = ('PYTHONPATH', 'LD_LIBRARY_PATH', 'AMENT_PREFIX_PATH')


def environment_with(*packages: str) -> dict[str, str]:
    """Return the environment in which packages, and the project, are importable; or skip."""
    environment = dict(os.environ)
    for package in packages:
        setup = BUILDS / package / 'setup.sh'
        if not setup.is_file():
            pytest.skip(f'looked for {setup}: `make messages` builds it')
        version = f'python{sys.version_info.major}.{sys.version_info.minor}'
        if version not in setup.read_text(encoding='utf-8'):
            pytest.skip(f'{setup}: built for another Python than {version}')
        lines = subprocess.run(
            ['sh', '-c', f'. {setup}; env'], env=environment, capture_output=True, text=True,
            check=True).stdout
        given = dict(line.split('=', 1) for line in lines.splitlines() if '=' in line)
        environment.update({name: given[name] for name in PATHS if name in given})
    path = [str(ROOT), str(ROOT / 'test'), environment.get('PYTHONPATH', '')]
    return {**environment, 'PYTHONPATH': os.pathsep.join(filter(None, path))}
