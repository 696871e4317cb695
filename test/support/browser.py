"""Debian's Chromium without a window: a page in, a picture out."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np

CHROMIUM = shutil.which('chromium')
SIZE = (1200, 900)
# Root, as in a container, may not use the sandbox; WebGL is drawn by the processor.
FLAGS = ('--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
         '--enable-unsafe-swiftshader', '--hide-scrollbars', '--virtual-time-budget=3000')


def photograph(page: Path, script: str = '') -> np.ndarray:
    """Return what a browser shows of a page after a script has run in it, as RGB."""
    assert CHROMIUM is not None
    acted = page.with_name(f'acted_{page.name}')
    acted.write_text(page.read_text().replace('</body>', f'<script>{script}</script></body>'))
    picture = page.with_suffix('.png')
    picture.unlink(missing_ok=True)
    done = subprocess.run(
        [CHROMIUM, *FLAGS, '--window-size={},{}'.format(*SIZE), f'--screenshot={picture}',
         f'--user-data-dir={page.parent / "profile"}', acted.as_uri()],
        capture_output=True, text=True, timeout=120, check=False)
    assert picture.is_file(), done.stderr
    return cv2.cvtColor(cv2.imread(str(picture)), cv2.COLOR_BGR2RGB)
