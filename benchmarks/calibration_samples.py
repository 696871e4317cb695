"""Joints with evidence and errors: from single scenes, and from people who are followed."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np

from benchmarks.accuracy_methods import GivenDetections, Guess
from benchmarks.accuracy_records import match
from benchmarks.calibration_fit import Sample, joined
from benchmarks.tracking_metrics import correspond
from benchmarks.tracking_records import TruthRecorder, track_table
from pop_core.body.default_body import default_body
from pop_core.config import PipelineConfig
from pop_core.estimate import BodyEstimate
from pop_core.fitting.body_fit import BodyFit
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.uncertainty import Calibration, JointEvidence, joint_evidence
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.retrieval.default_library import default_library
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.scenes import synthesise_scene
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.tracking.calibration import TRACKED
from pop_core.tracking.tracker import BodyTracker

RATE_HZ = 30.0
EVERY = 4  # frames of a sequence, of which one is kept: neighbours err alike


class Witness(BodyPipeline):
    """A pipeline that keeps the evidence of every body it gives out."""

    def __init__(self) -> None:
        """Prepare the pipeline as it comes, for keypoints that are given."""
        self.given = GivenDetections()
        super().__init__(default_body(), default_library(), self.given, PipelineConfig())
        self._kept: list[tuple[np.ndarray, JointEvidence, Calibration]] = []

    def estimate(
        self, scene: Scene, fit: BodyFit, trust: float, calibration: Calibration = SINGLE_FRAME,
    ) -> tuple[BodyEstimate, float]:
        """Return the result of a fit, and keep what it was told by."""
        estimate, support = super().estimate(scene, fit, trust, calibration)
        evidence = joint_evidence(self.model, fit, estimate.joint_state, calibration)
        self._kept.append((estimate.joints, evidence, calibration))
        return estimate, support

    def forget(self) -> None:
        """Forget the bodies of earlier frames."""
        self._kept.clear()

    def evidence_of(self, body: BodyEstimate, calibration: Calibration) -> JointEvidence | None:
        """Return the evidence of a body, None if it was told by another calibration."""
        for joints, evidence, used in self._kept:
            if joints is body.joints and used is calibration:
                return evidence
        return None


def scene_sample(witness: Witness, seed: int) -> Sample | None:
    """Return the joints of one scene's people, None where nobody was found."""
    scene = synthesise_scene(witness.model, seed, SceneConfig())
    seen = [(p, d) for p, d in zip(scene.people, scene.detections(), strict=True) if d is not None]
    witness.given.people = [detection for _, detection in seen]
    witness.forget()
    bodies = witness.process(scene.frame).bodies
    pairs = match(
        witness.model, [Guess(body.parameters) for body in bodies], [person for person, _ in seen])
    parts = []
    for person, number in pairs.items():
        body, truth = bodies[number], seen[person][0]
        evidence = witness.evidence_of(body, SINGLE_FRAME)
        if evidence is not None:
            parts.append(Sample(evidence, truth.joints - body.joints, truth.joint_state))
    return joined(parts) if parts else None


def sequence_sample(witness: Witness, seed: int, film: SequenceConfig) -> Sample | None:
    """Return joints of people who are followed through a sequence, of every EVERY-th frame."""
    tracker, truth = BodyTracker(witness), TruthRecorder(RATE_HZ)
    rows, found = [], []
    for number, frame in enumerate(film_sequence(witness.model, seed, film)):
        truth.add(frame)
        witness.given.people = [d for d in frame.detections if d is not None]
        witness.forget()
        for body in tracker.process(frame.scene.frame).bodies:
            assert body.track is not None
            rows.append((number, body.track.id, body.joints, body.joint_covariance))
            found.append(
                witness.evidence_of(body, TRACKED) if number % EVERY == 0 else None)
    table = truth.table()
    parts = []
    for row, k in enumerate(correspond(table, track_table(rows, [], []))):
        evidence = found[k] if k >= 0 and table.required[row] else None
        if evidence is not None:
            parts.append(Sample(evidence, table.joints[row] - rows[k][2], table.state[row]))
    return joined(parts) if parts else None


def save_sample(path: Path, sample: Sample) -> None:
    """Write a sample into a file, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {f.name: getattr(sample.evidence, f.name) for f in fields(JointEvidence)}
    temporary = path.with_suffix('.tmp.npz')
    np.savez_compressed(temporary, error_m=sample.error_m, truth=sample.truth, **arrays)
    temporary.replace(path)


def load_sample(path: Path) -> Sample:
    """Read what `save_sample` wrote."""
    with np.load(path) as file:
        evidence = JointEvidence(**{f.name: file[f.name] for f in fields(JointEvidence)})
        return Sample(evidence, file['error_m'], file['truth'])
