"""Tell body models apart by a short digest of the arrays that decide where vertices go."""

from __future__ import annotations

import hashlib
from functools import lru_cache

import numpy as np

from pop_core.body.model import BodyModel

DIGEST_DIGITS = 16  # 64 bits: models are told apart, nobody defends against forgery
FLOATS = ('v_template', 'shapedirs', 'posedirs', 'J_regressor', 'weights')
INTEGERS = ('parents', 'f')


@lru_cache(maxsize=4)  # by identity: results of every frame state it
def model_digest(model: BodyModel) -> str:
    """Return hexadecimal digits that are equal for models that give equal meshes.

    Numbers count as float32: what a file may hold. The name and the coarse mesh, which only the
    fit uses, do not count.
    """
    digest = hashlib.sha256()
    for name in FLOATS + INTEGERS:
        array = getattr(model, name)
        kind = '<f4' if name in FLOATS else '<i4'
        numbers = np.zeros(0, kind) if array is None else np.ascontiguousarray(array, kind)
        digest.update(f'{name}{numbers.shape}'.encode())
        digest.update(numbers.tobytes())
    return digest.hexdigest()[:DIGEST_DIGITS]
