"""`pop version`: what a result depends on, for bug reports."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of

import typer

from pop_core import __version__

DEPENDENCIES = ('numpy', 'scipy', 'numba', 'opencv-python-headless', 'onnxruntime', 'rclpy')


def version() -> None:
    """Print the versions of pop, Python and the libraries results depend on."""
    typer.echo(f'pop {__version__}')
    typer.echo(f'python {platform.python_version()} on {platform.platform()}')
    for name in DEPENDENCIES:
        typer.echo(f'{name} {_version(name)}')


def _version(name: str) -> str:
    try:
        return version_of(name)
    except PackageNotFoundError:
        return 'not installed'
