"""Finished frames of a run, one JSON line each, so that an interrupted run goes on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pop_core


def cache_folder() -> Path:
    """Return where benchmarks keep finished frames."""
    base = os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache'
    return Path(base) / 'pop' / 'benchmarks'


def run_key(parts: Iterable[str]) -> str:
    """Return a short name of everything that results depend on: settings, code and data."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part.encode() + b'\0')
    for folder in (Path(pop_core.__file__).parent, Path(__file__).parent):
        for path in sorted(folder.rglob('*')):
            if path.suffix in ('.py', '.npz', '.onnx'):
                digest.update(path.relative_to(folder).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


class FrameCache:
    """Results by seed, appended to a file as they come."""

    def __init__(self, path: Path) -> None:
        """Read what is there; a line cut off by an interruption is dropped."""
        self.path = path
        self.done: dict[int, dict[str, Any]] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_file():
            text = path.read_text(encoding='utf-8')
            if text and not text.endswith('\n'):
                path.write_text(text + '\n', encoding='utf-8')  # a new line starts after it
            for line in text.splitlines():
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue
                self.done[int(entry['seed'])] = entry

    def add(self, entry: dict[str, Any]) -> None:
        """Keep the result of one frame."""
        self.done[int(entry['seed'])] = entry
        with self.path.open('a', encoding='utf-8') as file:
            file.write(json.dumps(entry) + '\n')
