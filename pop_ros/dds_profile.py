"""The Fast DDS profile that lets whole images travel through shared memory."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

NAME = 'fastdds_large_data.xml'
VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
SHARED_MEMORY = Path('/dev/shm')
FREE_BYTES = 100_000_000  # 32 MB on either side, and room for others


def use_large_shared_memory() -> None:
    """Choose the profile for this process and its children, unless the user chose one.

    Without it, images travel in fragments over loopback, and one that is lost is sent again only
    seconds later: its pair has been given up by then. It needs shared memory to spare.
    """
    profile = _profile()
    if profile is None or not SHARED_MEMORY.is_dir():
        return
    if shutil.disk_usage(SHARED_MEMORY).free > FREE_BYTES:
        os.environ.setdefault(VARIABLE, str(profile))


def _profile() -> Path | None:
    """Return the profile of an installation by pip or by colcon, or that of the source tree."""
    share = Path('share') / 'pop_ros' / 'config' / NAME
    prefixes = [Path(sys.prefix), *map(Path, _ament_prefixes())]
    places = [*(prefix / share for prefix in prefixes),
              Path(__file__).resolve().parents[1] / 'config' / NAME]
    return next((place for place in places if place.is_file()), None)


def _ament_prefixes() -> list[str]:
    return [part for part in os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep) if part]
