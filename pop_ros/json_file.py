"""Read JSON that others wrote: damaged, huge and hostile files give one clear line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pop_core.errors import FrameError

MAX_BYTES = 16_000_000


def load_json_object(path: Path) -> dict[str, Any]:
    """Return the JSON object of a file.

    Raises:
        FrameError: If the file is not one JSON object in UTF-8 of at most MAX_BYTES.
    """
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise FrameError(f'{path}: expected at most {MAX_BYTES} bytes of JSON, found {size}')
    try:
        content = json.loads(path.read_text(encoding='utf-8-sig'))
    except (ValueError, RecursionError) as error:  # ValueError: bad UTF-8, JSON or huge integers
        raise FrameError(f'{path}: expected JSON, found {_first_line(error)}') from None
    if not isinstance(content, dict):
        raise FrameError(f'{path}: expected a JSON object, found {type(content).__name__}')
    return content


def _first_line(error: Exception) -> str:
    if isinstance(error, RecursionError):
        return 'brackets nested too deeply'
    return str(error).splitlines()[0]
