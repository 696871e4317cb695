"""Shape checking of pop_core at run time, for every test.

Modules of numba kernels (`*_kernels.py`) are left alone: numba cannot compile wrapped functions.
"""

from pathlib import Path

from jaxtyping import install_import_hook

ROOT = Path(__file__).resolve().parents[1]


def checked_modules() -> list[str]:
    paths = sorted((ROOT / 'pop_core').rglob('*.py'))
    named = [path for path in paths if path.stem != '__init__']
    plain = [path for path in named if not path.stem.endswith('_kernels')]
    return ['.'.join(path.relative_to(ROOT).with_suffix('').parts) for path in plain]


install_import_hook(checked_modules(), 'beartype.beartype')
