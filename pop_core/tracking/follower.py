"""Following one tracked person into a frame: predict, fit, judge, update."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from pop_core.body.model import BodyParameters
from pop_core.estimate import BodyEstimate
from pop_core.fitting.body_fit import BodyFit
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.disagreement import disagreement, unnamed_joints
from pop_core.fitting.observation import Observation
from pop_core.fitting.plausibility import plausibility
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.tracking.association import Expected
from pop_core.tracking.body_filter import (
    FilterState,
    difference,
    first_state,
    inverse,
    predict,
    with_known_shape,
)
from pop_core.tracking.calibration import TRACKED
from pop_core.tracking.doubts import has_outgrown_evidence
from pop_core.tracking.finder import FoundBody
from pop_core.tracking.fresh_fits import FreshFit
from pop_core.tracking.late_belief import caught_up, moved_on
from pop_core.tracking.limb_claims import limbs_of, open_shares
from pop_core.tracking.limb_rest import LimbRests
from pop_core.tracking.limb_search import LimbSearch
from pop_core.tracking.limbs import contradicted_joints, limbs_in_the_open, loosened, lost_limbs
from pop_core.tracking.liveliness import followed_trail, liveliness
from pop_core.tracking.motion import N_MOVING
from pop_core.tracking.rivals import (
    BETTER,
    MUCH_BETTER,
    costs,
    costs_over,
    follow_alternatives,
)
from pop_core.tracking.sides import misnamed_joints, without_joints
from pop_core.tracking.track import Alternative, PersonTrack
from pop_core.tracking.track_view import observe_track
from pop_core.tracking.tracked_energy import prior_curvature
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import SeenBody, WarmFit, WarmStart, sighting, updated

MIN_SEEN = 0.04  # share of the body that must be seen for the frame to say anything of it
CONTRADICTED = 0.4  # a body is not where the camera saw through this share of it
USUAL_SHARE = 0.05  # how fast the usual E_depth follows
TRUSTED_SUPPORT = 0.5
HIDDEN_TURN_RAD = 0.5  # people hidden for a while come out much as they went in
LESS_OPEN = 0.1  # share of a limb, by which a better place for it shows through less
RESOLVED = 8.0  # cost that a body may be worse by for each joint that agrees with it instead


class Follower:
    """Follows people with the terms of one pipeline."""

    def __init__(self, pipeline: BodyPipeline, config: TrackingConfig) -> None:
        """Use a pipeline's model, fitter and settings."""
        self.pipeline, self.config = pipeline, config
        self.warm = WarmStart(pipeline.fitter, config.prior_weight)
        self.limb_search = LimbSearch(pipeline.fitter.prior)

    def predict(self, track: PersonTrack, now_ns: int) -> None:
        """Move a track's beliefs to the time of a frame."""
        track.gap_s = (now_ns - track.now_ns) * 1e-9
        track.now_ns = now_ns
        joints = self._body(track.filter).joints
        track.trail = followed_trail(
            joints if track.trail is None else track.trail, joints, track.gap_s)
        track.left_m = float(np.linalg.norm(joints - track.trail, axis=1).max())
        lively = liveliness(joints, track.trail, track.joint_state)
        track.filter = predict(track.filter, self.pipeline.model, track.gap_s, lively)
        for other in track.alternatives:
            other.filter = predict(other.filter, self.pipeline.model, track.gap_s)

    def expected(self, track: PersonTrack) -> Expected:
        """Return where a predicted person should be."""
        doubt_m = float(np.sqrt(np.trace(track.filter.covariance[:3, :3]) / 3.0))
        return Expected(self._body(track.filter).landmarks, doubt_m, track.mask)

    def follow(
        self, track: PersonTrack, scene: Scene, lifted: LiftedJoints | None,
        rival: FreshFit | None = None,
    ) -> BodyEstimate | None:
        """Return the person in a frame, or None where nothing is given out.

        Args:
            track: A predicted track; moved on.
            scene: The frame, with what nearer people explain.
            lifted: The person's joints if they were detected in this frame.
            rival: A fit that knows nothing of the track, where the prediction is in doubt.
        """
        body = self._body(track.filter)
        track.blur_m = float(scene.noise.sigma_m(body.joints[:1, 2])[0])
        if lifted is not None:
            track.misnamed = misnamed_joints(body.landmarks, lifted)
            lifted = lifted.with_sides_exchanged(track.misnamed)
        observation = observe_track(
            scene.frame, scene.ground, scene.taken, body, track.joint_state, lifted,
            noise=scene.noise)
        start = SeenBody.look(body, observation)
        if sighting(start.visibility).seen < MIN_SEEN and lifted is None:
            return self._coast(track, scene, start)
        fit = self._fit(track, observation, lifted, start)
        if rival is not None:
            fit = self._better(track, fit, rival, without_joints(observation, track.misnamed))
        sight = sighting(fit.visibility)
        if sight.seen < MIN_SEEN or sight.contradicted > CONTRADICTED + sight.seen:
            return self._coast(track, scene, start)
        return self._accept(track, scene, fit, lifted)

    def restart(
        self, track: PersonTrack, fresh: FreshFit, lifted: LiftedJoints | None = None
    ) -> None:
        """Take over a fit that began with retrieved poses; the shape stays the person's."""
        track.filter = self._found_anew(track, fresh, lifted)
        assert fresh.person.body is not None
        self.begin(track, fresh.person.body)
        track.tries += 1
        track.limb_rests = LimbRests()
        late_s = (track.now_ns - fresh.stamp_ns) * 1e-9
        for other in track.alternatives:
            other.filter = moved_on(other.filter, self.pipeline.fitter.coarse, late_s, lifted)
        track.depth_level = None

    def catch_up(self, track: PersonTrack, lifted: LiftedJoints, late_s: float) -> None:
        """Move a person to where keypoints are, which were there `late_s` ago [s] at most."""
        body = self.pipeline.fitter.coarse
        track.filter = caught_up(track.filter, body, late_s, lifted)
        for other in track.alternatives:
            other.filter = caught_up(other.filter, body, late_s, lifted)

    def begin(self, track: PersonTrack, found: FoundBody) -> None:
        """Keep the other explanations of a fresh fit while they may be true."""
        track.restarted_ns, track.evidence = track.now_ns, found.evidence
        track.doubts, track.is_doubtful = 0, False
        track.alternatives = [
            Alternative(first_state(other, found.hessian), 0.0, track.now_ns)
            for other in found.runners_up[: self.config.hypotheses - 1]]

    def _fit(
        self, track: PersonTrack, observation: Observation, lifted: LiftedJoints | None,
        start: SeenBody,
    ) -> WarmFit:
        """Return the best explanation of the person in a frame, and the belief it began with."""
        steps, detected = self.config.steps, lifted is not None
        fit = self.warm.fit(track.filter, observation, steps, detected=detected, start=start)
        if lifted is not None:
            fit = self._without_lost_limbs(track, fit, observation, lifted)
        if track.alternatives:
            fit = follow_alternatives(
                self.warm, track, fit, observation, self.config, detected=detected)
        return fit

    def _better(
        self, track: PersonTrack, fit: WarmFit, rival: FreshFit, observation: Observation
    ) -> WarmFit:
        """Return the better of what was followed and what was found anew."""
        assert rival.person.body is not None
        seen = rival.person.body.evidence
        if not has_outgrown_evidence(track, seen):
            # What was compared for new evidence only puts off nothing that doubts ask for.
            track.restarted_ns, track.doubts = track.now_ns, 0
        track.evidence = track.evidence | seen
        belief = self._found_anew(track, rival, observation.lifted)
        other = self.warm.fit(belief, observation, self.config.steps, detected=True)
        ours, theirs = costs(self.warm.fitter, [fit, other], observation)
        # Keypoints of one frame err together: who was followed well is believed more than them.
        if theirs >= ours - (BETTER if track.tries > 0 else MUCH_BETTER):
            track.tries += track.tries > 0
            return fit
        track.restarted_ns, track.doubts = track.now_ns, 0
        track.tries += 1
        track.filter, track.depth_level = belief, None
        track.limb_rests = LimbRests()
        track.alternatives.clear()
        return other

    def _found_anew(
        self, track: PersonTrack, fresh: FreshFit, lifted: LiftedJoints | None
    ) -> FilterState:
        """Return the belief in a fresh fit of a known person: the shape stays theirs."""
        found = fresh.person.body
        assert found is not None
        belief = first_state(found.parameters, found.hessian)
        belief = with_known_shape(belief, track.filter, self.pipeline.model)
        late_s = (track.now_ns - fresh.stamp_ns) * 1e-9
        return moved_on(belief, self.pipeline.fitter.coarse, late_s, lifted)

    def _without_lost_limbs(
        self, track: PersonTrack, fit: WarmFit, observation: Observation, lifted: LiftedJoints
    ) -> WarmFit:
        """Look anew for limbs that keypoints contradict, or depth; return the better fit."""
        for loose in lost_limbs(contradicted_joints(fit.state, lifted)):
            fit = self._unless_it_rests(track, fit, observation, lifted, loose)
        for loose in limbs_in_the_open(
                open_shares(fit.state, fit.visibility, observation)):
            fit = self._unless_it_rests(track, fit, observation, lifted, loose)
        return fit

    def _unless_it_rests(
        self, track: PersonTrack, fit: WarmFit, observation: Observation, lifted: LiftedJoints,
        loose: Bool[np.ndarray, '24'],
    ) -> WarmFit:
        """Look for a limb, but not in every frame for one that is never found."""
        if track.limb_rests.rests(loose, track.now_ns):
            return fit
        other = self._with_limb_found(track, fit, observation, lifted, loose)
        if other is fit:
            track.limb_rests.missed(loose, track.now_ns)
        else:
            track.limb_rests.found(loose)
        return other

    def _with_limb_found(
        self, track: PersonTrack, fit: WarmFit, observation: Observation, lifted: LiftedJoints,
        loose: Bool[np.ndarray, '24'],
    ) -> WarmFit:
        """Return a fit with some limbs looked for anew, if that explains more."""
        found = self.limb_search.find(fit.state, observation, loose)
        if self._is_in_vain(found, fit, observation, lifted):
            return fit
        free = replace(loosened(track.filter, loose), parameters=found)
        other = self.warm.fit(
            free, observation, self.config.steps, detected=True, loose=loose)
        ours, theirs = costs(self.warm.fitter, [fit, other], observation)
        before, after = (contradicted_joints(f.state, lifted).sum() for f in (fit, other))
        # A keypoint may itself be wrong: a limb is where measured points are its own, and not
        # where the camera saw through.
        limbs = limbs_of(loose)
        is_seen = other.of_limb[limbs].sum() > fit.of_limb[limbs].sum()
        opened, closed = (
            open_shares(f.state, f.visibility, observation)[limbs].max() for f in (fit, other))
        is_hidden = closed < opened - LESS_OPEN
        if theirs >= ours + RESOLVED * int(before - after) or not (is_seen or is_hidden):
            return fit
        track.filter = free
        return other

    def _is_in_vain(
        self, found: BodyParameters, fit: WarmFit, observation: Observation,
        lifted: LiftedJoints,
    ) -> bool:
        """Return whether a limb was found where so much speaks against it that no fit mends it."""
        bodies = [fit.state, self.pipeline.fitter.coarse.state(found)]
        ours, theirs = costs_over(self.warm.fitter, bodies, observation, fit.segment)
        resolved = max(int(contradicted_joints(fit.state, lifted).sum()), 1)
        return theirs > ours + RESOLVED * resolved

    def _accept(
        self, track: PersonTrack, scene: Scene, fit: WarmFit, lifted: LiftedJoints | None
    ) -> BodyEstimate | None:
        """Update a track by a fit and return the person."""
        track.filter = updated(track.filter, fit)
        if lifted is not None:
            track.unnamed = unnamed_joints(fit.state, lifted)
        body = fit.as_body_fit(
            inverse(track.filter.covariance) + fit.curvature.prior,
            [self._body(other.filter) for other in track.alternatives], track.unnamed)
        if lifted is not None:
            track.trust = plausibility(body, lifted)
        body = self._smoothed(track, body)
        estimate, support = self.pipeline.estimate(scene, body, track.trust, TRACKED)
        self._judge(track, fit, support, lifted)
        track.note_seen(estimate, self.config)
        if support < self.pipeline.config.min_support:
            track.note_unseen(False, self.config)
            return None
        return replace(estimate, track=track.tag())

    def _smoothed(self, track: PersonTrack, body: BodyFit) -> BodyFit:
        """Return a body moved back toward the last one that was given out."""
        if self.config.smoothing > 0.0 and track.shown is not None:
            back = -self.config.smoothing * difference(body.parameters, track.shown)
            coarse = body.coarse.moved(back)
            body = replace(body, parameters=coarse.parameters, coarse=coarse)
        track.shown = body.parameters
        return body

    def _judge(
        self, track: PersonTrack, fit: WarmFit, support: float, lifted: LiftedJoints | None
    ) -> None:
        """Note whether a fit is worse than it used to be, or against its keypoints."""
        depth_m = fit.energies['E_depth']
        unusual = track.is_unusual(depth_m)
        if not unusual:
            usual_m = depth_m if track.depth_level is None else track.depth_level
            track.depth_level = (1.0 - USUAL_SHARE) * usual_m + USUAL_SHARE * depth_m
        track.is_doubtful = unusual or support < TRUSTED_SUPPORT
        if lifted is not None:
            against = contradicted_joints(fit.state, lifted).any() or track.misnamed.any()
            track.doubts = track.doubts + 1 if track.is_doubtful or against else 0
            if track.doubts == 0:
                track.tries, track.is_proven = 0, True

    def _coast(
        self, track: PersonTrack, scene: Scene, start: SeenBody
    ) -> BodyEstimate | None:
        """Return a person nothing is seen of, where they should be; None for the lost."""
        state, visibility = start.state, start.visibility
        track.alternatives.clear()
        track.note_unseen(sighting(visibility).contradicted < CONTRADICTED, self.config)
        if not track.is_shown:
            return None
        hessian = inverse(track.filter.covariance) + prior_curvature(
            state, self.pipeline.fitter.prior, self.config.prior_weight)
        turns = np.arange(3, N_MOVING)
        hessian[turns, turns] += HIDDEN_TURN_RAD**-2.0
        # No energies: depth that shows none of the person does not speak against the body.
        body = BodyFit(
            state.parameters, hessian, visibility, state, visibility.rendered.covered, {}, (),
            disagreement(state, (), (), (), track.unnamed))
        estimate, _ = self.pipeline.estimate(scene, body, track.trust, TRACKED)
        track.joint_state = estimate.joint_state
        return replace(
            estimate, mask=np.zeros_like(estimate.mask), track=track.tag(),
            score=track.trust * float(np.exp(-track.unseen_s)))

    def _body(self, belief: FilterState) -> BodyState:
        return self.pipeline.fitter.coarse.state(belief.parameters)
