"""A person who moves before a wall, seen by a small camera."""

import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.body.model import BodyModel, BodyParameters


@pytest.fixture(scope='session')
def body() -> BodyModel:
    return default_body()


@pytest.fixture(scope='session')
def person() -> BodyParameters:
    """A person facing the camera with lowered, slightly bent arms."""
    pose = np.zeros((23, 3))
    pose[15, 2], pose[16, 2] = -1.1, 1.1
    pose[17, 1], pose[18, 1] = -0.5, 0.5
    return BodyParameters(
        np.array([0.1, 0.1, 2.5]), np.array([np.pi, 0, 0]), pose, np.zeros(10))
