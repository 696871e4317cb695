"""Real RGB-D frames; tests that need them skip where the shared data is not there."""

from pathlib import Path

import pytest

from pop_core.rgbd import RgbdFrame
from pop_ros.frame_folder import load_frame

DATA = Path(__file__).resolve().parents[3] / 'shared' / 'data'
SOFA = ('00', '06', '12', '18', '24', '30', '36', '42', '48', '54', '60', '66')


def load(name: str) -> RgbdFrame:
    """Return a frame of the shared data by its folder."""
    folder = DATA / 'rgbd' / name
    if not folder.is_dir():
        pytest.skip(f'looked for {folder}')
    return load_frame(folder)
