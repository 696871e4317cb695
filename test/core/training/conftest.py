"""A handful of small training scenes."""

import pytest

from pop_core.body.default_body import default_body
from pop_core.synthesis.coarse_body import coarse_body
from pop_core.synthesis.training_scenes import TrainingScenes


@pytest.fixture(scope='session')
def small_scenes():
    body = coarse_body(default_body())
    stream = TrainingScenes(body, seed=1, width=112, height=80, focal_px=80.0)
    return [stream.draw() for _ in range(12)]
