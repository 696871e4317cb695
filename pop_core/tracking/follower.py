"""Following one tracked person into a frame: predict, fit, judge, update."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pop_core.body.joints import N_SHARED
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
from pop_core.tracking.late_limbs import LateLimbs, LimbQuestion, with_found_limbs
from pop_core.tracking.limb_recovery import LimbRecovery, LostLimbs
from pop_core.tracking.limb_rest import LimbRests
from pop_core.tracking.limbs import contradicted_joints
from pop_core.tracking.liveliness import followed_trail, liveliness
from pop_core.tracking.motion import N_MOVING
from pop_core.tracking.rivals import costs, follow_alternatives, lead, with_limbs_of
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
FOLLOWED_SIGMA_M = 0.1  # of joints where they were last: a floor holds them up
HIDDEN_TURN_RAD = 0.5  # people hidden for a while come out much as they went in


class Follower:
    """Follows people with the terms of one pipeline."""

    def __init__(
        self, pipeline: BodyPipeline, config: TrackingConfig, late_limbs: LateLimbs
    ) -> None:
        """Use a pipeline's model, fitter and settings, and whoever looks for lost limbs."""
        self.pipeline, self.config, self.late_limbs = pipeline, config, late_limbs
        self.warm = WarmStart(pipeline.fitter, config.prior_weight)
        self.recovery = LimbRecovery(self.warm, config.steps)

    def predict(self, track: PersonTrack, now_ns: int) -> None:
        """Move a track's beliefs to the time of a frame."""
        track.gap_s = (now_ns - track.now_ns) * 1e-9
        track.now_ns = now_ns
        body = self._body(track.filter)
        track.landmarks, joints = body.landmarks, body.joints
        track.trail = followed_trail(
            joints if track.trail is None else track.trail, joints, track.gap_s)
        track.left_m = float(np.linalg.norm(joints - track.trail, axis=1).max())
        lively = liveliness(joints, track.trail, track.joint_state)
        track.filter = predict(track.filter, self.pipeline.model, track.gap_s, lively)
        track.filter = self._with_late_limbs(track)
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
        assert track.landmarks is not None
        scene = scene.with_ground_of(track.landmarks, np.full(N_SHARED, FOLLOWED_SIGMA_M))
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
        self._forget_limbs(track)
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
        track.rivals_beaten = 0
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
            best = follow_alternatives(
                self.warm, track, fit, observation, self.config, detected=detected)
            if best is not fit:
                self.late_limbs.forget(track.id)
            return best
        return fit

    def _better(
        self, track: PersonTrack, fit: WarmFit, rival: FreshFit, observation: Observation
    ) -> WarmFit:
        """Return the better of what was followed and what was found anew."""
        assert rival.person.body is not None
        seen, was_doubted = rival.person.body.evidence, track.doubts > 0
        if not has_outgrown_evidence(track, seen):
            # What was compared for new evidence only puts off nothing that doubts ask for.
            track.restarted_ns, track.doubts = track.now_ns, 0
        track.evidence = track.evidence | seen
        belief = self._found_anew(track, rival, observation.lifted)
        other = self.warm.fit(belief, observation, self.config.steps, detected=True)
        ours, theirs = costs(self.warm.fitter, [fit, other], observation)
        margin = lead(track, rival.stamp_ns)
        if theirs >= ours - margin:
            track.tries += track.tries > 0
            track.rivals_beaten += was_doubted
            return self._with_limbs_of(track, fit, other, observation, margin)
        track.restarted_ns, track.doubts = track.now_ns, 0
        track.tries += 1
        track.rivals_beaten = 0
        track.filter, track.depth_level = belief, None
        self._forget_limbs(track)
        track.alternatives.clear()
        return self._with_limbs_of(track, other, fit, observation, margin)

    def _with_limbs_of(
        self, track: PersonTrack, best: WarmFit, other: WarmFit, observation: Observation,
        lead_needed: float,
    ) -> WarmFit:
        """Return a body with what limbs another one has right, between frames far apart."""
        if lead_needed > 0.0:  # of a fast camera: whoever is better is so in every limb
            return best
        mixed = with_limbs_of(self.warm, track, best, other, observation, self.config.steps)
        if mixed is not best:
            self.late_limbs.forget(track.id)
        return mixed

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
        resting = track.limb_rests.resting(track.now_ns)
        lost = LostLimbs(track.filter, fit, observation, lifted, resting)
        if not self.late_limbs.waits:
            if lost.any_awake:
                self.late_limbs.ask(track.id, LimbQuestion.of(lost, self.config))
            return fit
        self.late_limbs.forget(track.id)
        recovery = self.recovery.recover(lost)
        track.limb_rests.note(recovery.tried, track.now_ns)
        track.filter = recovery.belief
        return recovery.fit or fit

    def _forget_limbs(self, track: PersonTrack) -> None:
        """Forget what was looked for in another body."""
        track.limb_rests = LimbRests()
        self.late_limbs.forget(track.id)

    def _with_late_limbs(self, track: PersonTrack) -> FilterState:
        """Return a belief with the limbs that were found since the last frame."""
        answer = self.late_limbs.take(track.id)
        if answer is None:
            return track.filter
        track.limb_rests.note(answer.tried, track.now_ns)
        return with_found_limbs(track.filter, answer)

    def _accept(
        self, track: PersonTrack, scene: Scene, fit: WarmFit, lifted: LiftedJoints | None
    ) -> BodyEstimate | None:
        """Update a track by a fit and return the person."""
        track.filter = updated(track.filter, fit)
        if lifted is not None:
            track.unnamed = unnamed_joints(fit.state, lifted)
        body = fit.as_body_fit(
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
