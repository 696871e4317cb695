"""Message packages that may or may not be installed: an ament_python package brings none."""

from __future__ import annotations

import importlib
from typing import Any


def message_module(package: str) -> Any:
    """Return the module of a package's messages, or None if it is not installed."""
    try:
        return importlib.import_module(f'{package}.msg')
    except ImportError:
        return None
