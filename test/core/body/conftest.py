import numpy as np
import pytest

from pop_core.body.joints import N_JOINTS, PARENTS
from pop_core.body.model import BodyModel, BodyParameters

N_VERTICES = 60


@pytest.fixture
def random_model() -> BodyModel:
    """A body of random numbers: laws must not depend on looking like a person."""
    rng = np.random.default_rng(0)
    weights = rng.random((N_VERTICES, N_JOINTS))
    for row in weights:
        row[rng.permutation(N_JOINTS)[4:]] = 0
    weights /= weights.sum(axis=1, keepdims=True)
    regressor = rng.random((N_JOINTS, N_VERTICES))
    regressor /= regressor.sum(axis=1, keepdims=True)
    return BodyModel(
        'random', rng.normal(size=(N_VERTICES, 3)), 0.1 * rng.normal(size=(N_VERTICES, 3, 10)),
        None, regressor, weights, np.array(PARENTS), rng.integers(0, N_VERTICES, (50, 3)),
        np.arange(20), rng.integers(0, 20, (15, 3)))


@pytest.fixture
def random_parameters() -> BodyParameters:
    rng = np.random.default_rng(1)
    return BodyParameters(
        rng.normal(size=3), rng.normal(size=3), 0.6 * rng.normal(size=(23, 3)),
        rng.normal(size=10), 1.1)
