"""People of a sequence: one shape, one set of clothes, one motion each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.synthesis.clothes import Outfit, draw_outfit, dressed
from pop_core.synthesis.people import Actor

Motion = Callable[[float], BodyParameters]


@dataclass(frozen=True, slots=True, eq=False)
class Performer:
    """A person who moves.

    Args:
        motion: Body at a time [s], room frame.
        outfit: Clothes.
        kind: What the person does.
    """

    motion: Motion
    outfit: Outfit
    kind: str

    def at(self, model: BodyModel, seconds: float) -> Actor:
        """Return the person at a time."""
        parameters = self.motion(seconds)
        skin = vertices(model, parameters)
        return Actor(
            parameters, skin, dressed(skin, model.f, self.outfit), self.outfit, (), self.kind)


def draw_look(
    model: BodyModel, rng: np.random.Generator
) -> tuple[Float[np.ndarray, 'b'], Outfit]:
    """Return the shape and the clothes of a person."""
    outfit = draw_outfit(model, rng)
    return np.clip(rng.normal(size=model.n_betas), -1.2, 1.2), outfit
