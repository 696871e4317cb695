"""Lost limbs of a followed body: which are looked for, and whether what was found is better."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from pop_core.body.model import BodyParameters
from pop_core.fitting.observation import Observation
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.tracking.body_filter import FilterState
from pop_core.tracking.limb_claims import limbs_of, open_shares
from pop_core.tracking.limb_rest import Tried
from pop_core.tracking.limb_search import LimbSearch
from pop_core.tracking.limbs import contradicted_joints, limbs_in_the_open, loosened, lost_limbs
from pop_core.tracking.rivals import costs, costs_over
from pop_core.tracking.warm_start import FollowedBody, WarmFit, WarmStart

LESS_OPEN = 0.1  # share of a limb, by which a better place for it shows through less
RESOLVED = 8.0  # cost that a body may be worse by for each joint that agrees with it instead

Joints = Bool[np.ndarray, '24']


@dataclass(frozen=True, slots=True, eq=False)
class LostLimbs:
    """A body some limbs of which may be elsewhere.

    Args:
        belief: The belief that the body was fitted from.
        body: The fit.
        observation: What the sensor says.
        lifted: The person's joints, as they were detected.
        resting: Joints that are not looked for.
    """

    belief: FilterState
    body: FollowedBody
    observation: Observation
    lifted: LiftedJoints
    resting: Joints

    @property
    def any_awake(self) -> bool:
        """Return whether there is a limb to look for."""
        return not all(map(self.rests, [*self.contradicted(), *self.in_the_open()]))

    def rests(self, limb: Joints) -> bool:
        """Return whether all joints of a limb rest."""
        return bool(self.resting[limb].all())

    def contradicted(self) -> list[Joints]:
        """Return the joints of the limbs that keypoints contradict."""
        return lost_limbs(contradicted_joints(self.body.state, self.lifted))

    def in_the_open(self) -> list[Joints]:
        """Return the joints of the limbs that the camera saw through."""
        return limbs_in_the_open(
            open_shares(self.body.state, self.body.visibility, self.observation))


@dataclass(frozen=True, slots=True, eq=False)
class Recovery:
    """What became of the limbs that were looked for.

    Args:
        tried: The joints of each limb, in order, and whether it was found.
        belief: The belief that `fit` was fitted from.
        fit: The body with the limbs that were found; None where none was.
    """

    tried: tuple[Tried, ...]
    belief: FilterState
    fit: WarmFit | None


class LimbRecovery:
    """Looks anew for limbs that keypoints contradict, or depth."""

    def __init__(self, warm: WarmStart, steps: int) -> None:
        """Fit what is found with `steps` steps."""
        self._warm, self._steps = warm, steps
        self._search = LimbSearch(warm.fitter.prior)

    def recover(self, lost: LostLimbs) -> Recovery:
        """Return a body with its lost limbs where they explain more."""
        tried: list[Tried] = []
        fit = None
        for limbs in (LostLimbs.contradicted, LostLimbs.in_the_open):
            for loose in limbs(lost):
                if lost.rests(loose):
                    continue
                better = self._with_limb_found(lost, loose)
                tried.append((loose, better is not None))
                if better is None:
                    lost = replace(lost, resting=lost.resting | loose)
                else:
                    belief, fit = better
                    lost = replace(
                        lost, belief=belief, body=fit, resting=lost.resting & ~loose)
        return Recovery(tuple(tried), lost.belief, fit)

    def _with_limb_found(
        self, lost: LostLimbs, loose: Joints
    ) -> tuple[FilterState, WarmFit] | None:
        """Return a fit with some limbs looked for anew, if that explains more, and its belief."""
        body, observation = lost.body, lost.observation
        found = self._search.find(body.state, observation, loose)
        if self.is_in_vain(lost, found):
            return None
        free = replace(loosened(lost.belief, loose), parameters=found)
        other = self._warm.fit(free, observation, self._steps, detected=True, loose=loose)
        ours, theirs = costs(self._warm.fitter, [body, other], observation)
        before, after = (contradicted_joints(b.state, lost.lifted).sum() for b in (body, other))
        # A keypoint may itself be wrong: a limb is where measured points are its own, and not
        # where the camera saw through.
        limbs = limbs_of(loose)
        is_seen = other.of_limb[limbs].sum() > body.of_limb[limbs].sum()
        opened, closed = (
            open_shares(b.state, b.visibility, observation)[limbs].max() for b in (body, other))
        is_hidden = closed < opened - LESS_OPEN
        if theirs >= ours + RESOLVED * int(before - after) or not (is_seen or is_hidden):
            return None
        return free, other

    def is_in_vain(self, lost: LostLimbs, found: BodyParameters) -> bool:
        """Return whether a limb was found where so much speaks against it that no fit mends it."""
        fitter = self._warm.fitter
        bodies = [lost.body.state, fitter.coarse.state(found)]
        ours, theirs = costs_over(fitter, bodies, lost.observation, lost.body.segment)
        resolved = max(int(contradicted_joints(lost.body.state, lost.lifted).sum()), 1)
        return theirs > ours + RESOLVED * resolved
