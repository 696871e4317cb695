"""What is compared: the pipeline, the winner of retrieval alone, and the mean body in a T-pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, BodyParameters, rest_parameters, shared_points
from pop_core.fitting.initialisation import initial_parameters
from pop_core.geometry.rotation import nearest_rotation, to_rotvec
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.lifting import lift_keypoints
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.retrieve import retrieve
from pop_core.rgbd import RgbdFrame


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """One body that a method found.

    Args:
        parameters: SMPL parameters, camera frame.
        mask: Pixels of the person; None when the method says nothing.
        joint_covariance: Stated covariance of the joints [m^2], or None.
        runners_up: Other hypotheses.
    """

    parameters: BodyParameters
    mask: Bool[np.ndarray, 'h w'] | None = None
    joint_covariance: Float[np.ndarray, '24 3 3'] | None = None
    runners_up: tuple[BodyParameters, ...] = ()


class Method(Protocol):
    """Anything that finds bodies in a frame."""

    def __call__(self, frame: RgbdFrame) -> tuple[list[Guess], dict[str, float]]:
        """Return bodies and the wall time of each step [ms]."""
        ...


class GivenDetections:
    """A keypoint source that returns what it was given last: a scene's own noisy keypoints."""

    def __init__(self) -> None:
        """Start with nobody."""
        self.people: Sequence[Detection] = ()

    def detect(self, frame: RgbdFrame) -> list[Detection]:  # noqa: ARG002 - the protocol's shape
        """Return the given people, best first."""
        return sorted(self.people, key=lambda person: -person.score)


class Pipeline:
    """The whole pipeline."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Take a prepared pipeline."""
        self.pipeline = pipeline

    def __call__(self, frame: RgbdFrame) -> tuple[list[Guess], dict[str, float]]:
        """Return the bodies of a frame and the wall time per step [ms]."""
        result = self.pipeline.process(frame)
        guesses = [
            Guess(b.parameters, b.mask, b.joint_covariance,
                  tuple(other.parameters for other in b.runners_up))
            for b in result.bodies]
        return guesses, dict(result.times_ms)


class RetrievalOnly:
    """Steps 1 to 4: the first candidate of Eq. (1), as it is."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Take the stages of a prepared pipeline."""
        self.pipeline = pipeline

    def __call__(self, frame: RgbdFrame) -> tuple[list[Guess], dict[str, float]]:
        """Return one body per detection with enough lifted joints."""
        guesses = []
        config = self.pipeline.config
        for detection in self.pipeline.detector.detect(frame):
            lifted = lift_keypoints(frame, detection, config.lifting)
            if lifted.lifted.sum() >= config.min_joints:
                best = retrieve(self.pipeline.library, lifted, config.retrieval)[0]
                guesses.append(Guess(initial_parameters(self.pipeline.model, best)))
        return guesses, {}


class MeanBody:
    """The T-pose of the mean body, put onto the lifted joints by Procrustes: knows nothing."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Take detector and settings of a prepared pipeline."""
        self.pipeline = pipeline

    def __call__(self, frame: RgbdFrame) -> tuple[list[Guess], dict[str, float]]:
        """Return one body per detection with enough lifted joints."""
        detector: KeypointDetector = self.pipeline.detector
        config = self.pipeline.config
        guesses = []
        for detection in detector.detect(frame):
            lifted = lift_keypoints(frame, detection, config.lifting)
            known = lifted.lifted
            if known.sum() >= config.min_joints:
                placed = place_mean_body(
                    self.pipeline.model, lifted.positions_camera[known], known)
                guesses.append(Guess(placed))
        return guesses, {}


def place_mean_body(
    model: BodyModel, target: Float[np.ndarray, 'n 3'], known: Bool[np.ndarray, '15']
) -> BodyParameters:
    """Return the mean T-pose rigidly moved onto some of its 15 points (Kabsch 1976).

    Args:
        model: Body model.
        target: Places of the known points, camera frame [m].
        known: Which of the 15 shared points they are.
    """
    rest = rest_parameters(model.n_betas)
    source = attached_positions(shared_points(model), model, rest)[known]
    centred = source - source.mean(axis=0)
    R_camera_body = nearest_rotation((target - target.mean(axis=0)).T @ centred)
    root = model.joint_template[0]
    moved_root = R_camera_body @ (root - source.mean(axis=0)) + target.mean(axis=0)
    return rest.replaced(transl=moved_root - root, global_orient=to_rotvec(R_camera_body))
