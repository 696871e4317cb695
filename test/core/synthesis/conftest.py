import pytest

from pop_core.body.default_body import default_body
from pop_core.synthesis.scenes import synthesise_scene

SEEDS = (1, 3, 8, 10, 42)


@pytest.fixture(scope='session')
def model():
    return default_body()


@pytest.fixture(scope='session')
def scenes(model):
    return [synthesise_scene(model, seed) for seed in SEEDS]
