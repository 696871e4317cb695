"""A stock of people who appear in many scenes: drawing somebody new costs more than a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.retrieval.procedural.families import FAMILIES, draw_batch
from pop_core.synthesis.clothes import draw_outfit
from pop_core.synthesis.people import THICKEST_M, Actor, settled
from pop_core.synthesis.pose_parts import jittered
from pop_core.synthesis.poses import ScenePose, balancing_tilt, draw_pose

# Shares of a detector's world: people sit and stand; the rest keeps it from being surprised.
SHARES = {
    'standing': 0.24, 'walking': 0.14, 'sitting': 0.2, 'sitting crossed': 0.06,
    'sitting on the floor': 0.04, 'crouching': 0.04, 'kneeling': 0.02, 'half kneeling': 0.02,
    'bending': 0.05, 'climbing': 0.02, 'lying': 0.05, 'motion': 0.12,
}
SEATED = ('sitting', 'sitting crossed')
BATCH = 24       # poses of a family drawn at once
SEAT_SHARE = 0.85  # sitters with a seat; the others sit on something that depth misses
CHILD_SHARE, CHILD_SCALE = 0.15, (0.55, 0.85)
BARE_SHARE = 0.05
MAX_BETA = 2.5
ATTEMPTS = 40


class Troupe:
    """Draws people, most of them again."""

    def __init__(
        self, model: BodyModel, *, size: int = 300, fresh_share: float = 0.4,
        motions: Sequence[Float[np.ndarray, '23 3']] = (),
    ) -> None:
        """Begin with nobody.

        Args:
            model: Body that all wear.
            size: Most people remembered; the oldest leave.
            fresh_share: Share of people never seen before, once the stock is full.
            motions: Captured poses to draw from besides the learned prior's.
        """
        self.model = model
        self.size = size
        self.fresh_share = fresh_share
        self.motions = motions
        self._stock: list[Actor] = []
        self._next = 0
        self._poses: dict[str, list[ScenePose]] = {name: [] for name in SHARES}

    def draw(self, rng: np.random.Generator) -> Actor:
        """Return somebody above the origin who heads along +z, as `draw_actor` does."""
        if len(self._stock) == self.size and rng.random() > self.fresh_share:
            return self._stock[int(rng.integers(self.size))]
        actor = self._fresh(rng)
        if len(self._stock) < self.size:
            self._stock.append(actor)
        else:
            self._stock[self._next] = actor
            self._next = (self._next + 1) % self.size
        return actor

    def _fresh(self, rng: np.random.Generator) -> Actor:
        names, shares = list(SHARES), np.array(list(SHARES.values()))
        for _ in range(ATTEMPTS):
            pose = self._pose(str(rng.choice(names, p=shares / shares.sum())), rng)
            actor = self._settled(pose, rng)
            if actor is not None:
                return actor
        raise AssertionError(f'none of {ATTEMPTS} poses settled')  # one in ten does not

    def _settled(self, pose: ScenePose, rng: np.random.Generator) -> Actor | None:
        model = self.model
        betas = np.clip(rng.normal(0.0, 1.1, model.n_betas), -MAX_BETA, MAX_BETA)
        scale = float(rng.uniform(*CHILD_SCALE)) if rng.random() < CHILD_SHARE else 1.0
        outfit = draw_outfit(model, rng, 0.0 if rng.random() < BARE_SHARE else THICKEST_M)
        parameters = BodyParameters(np.zeros(3), pose.tilt, pose.body_pose, betas, scale)
        kind = pose.kind
        if kind in SEATED:
            kind = 'seated' if rng.random() < SEAT_SHARE else 'hovering'
        return settled(model, kind, parameters, outfit, rng)

    def _pose(self, name: str, rng: np.random.Generator) -> ScenePose:
        stock = self._poses[name]
        while not stock:
            stock += self._batch(name, rng)
        return stock.pop()

    def _batch(self, name: str, rng: np.random.Generator) -> list[ScenePose]:
        if name == 'motion':
            return [self._motion(rng)]
        drawn = draw_batch(FAMILIES[name], self.model, rng, BATCH)
        poses = [ScenePose(name, pose, tilt)
                 for pose, tilt in zip(drawn.body_pose, drawn.tilt, strict=True)]
        return [poses[k] for k in rng.permutation(len(poses))]

    def _motion(self, rng: np.random.Generator) -> ScenePose:
        if not self.motions or rng.random() < 0.3:
            return draw_pose(self.model, 'motion', rng)
        pose = jittered(self.motions[int(rng.integers(len(self.motions)))], rng)
        return ScenePose('motion', pose, balancing_tilt(self.model, pose))

