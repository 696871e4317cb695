"""A person who moves before a wall, seen by a small camera."""

import numpy as np
import pytest
from support.late import Late
from support.one_person import facing_person
from support.stage import Scripted

from pop_core.body.default_body import default_body
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library


@pytest.fixture(scope='session')
def body() -> BodyModel:
    return default_body()


@pytest.fixture(scope='session')
def person() -> BodyParameters:
    return facing_person(np.zeros(10))


@pytest.fixture(scope='module')
def pipeline(body: BodyModel) -> BodyPipeline:
    return BodyPipeline(body, default_library(), Scripted(body))


@pytest.fixture
def late() -> Late:
    return Late()
