"""The people a detector found in a frame: lifted, and fitted from retrieved poses if need be."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.model import BodyParameters
from pop_core.estimate import BodyEstimate, EstimateStatus
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.lifting import LiftingConfig, lift_keypoints
from pop_core.pipeline import (
    BodyPipeline,
    Scene,
    covers_keypoints,
    nearest_first,
    without_depth,
)
from pop_core.rgbd import RgbdFrame
from pop_core.stopwatch import Stopwatch


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The people a detector found in a frame.

    Args:
        detections: One per person; none in frames without a look.
        lifted: Their joints in 3D.
    """

    detections: Sequence[Detection] = ()
    lifted: Sequence[LiftedJoints] = ()

    def nearest_first(self, known: Collection[int]) -> list[int]:
        """Return the indices of people who are not among the known, nearest first."""
        order = nearest_first([joints.distance_m for joints in self.lifted], self.detections)
        return [int(index) for index in order if int(index) not in known]


def found_people(
    frame: RgbdFrame, detections: Sequence[Detection], config: LiftingConfig
) -> Found:
    """Return detections with their joints, lifted plainly: known people gate them."""
    return Found(detections, [lift_keypoints(frame, d, config) for d in detections])


class Finder:
    """Makes bodies of detections, with the steps of one pipeline."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Use a pipeline's library, model and settings."""
        self.pipeline = pipeline

    def lifted_behind(self, scene: Scene, found: Found, index: int) -> LiftedJoints:
        """Return a person's joints, lifted onto nothing that nearer people explain."""
        detection = found.detections[index]
        if not covers_keypoints(scene.taken, detection):
            return found.lifted[index]
        return lift_keypoints(
            without_depth(scene.frame, scene.taken), detection, self.pipeline.config.lifting)


@dataclass(frozen=True, slots=True, eq=False)
class FoundBody:
    """A body fitted from retrieved poses, as far as a tracker needs it.

    Args:
        parameters: The fit.
        hessian: J'WJ of the fit.
        runners_up: Other explanations that were fitted to the end.
        evidence: Shared joints that were surely seen.
    """

    parameters: BodyParameters
    hessian: Float[np.ndarray, 'x x']
    runners_up: tuple[BodyParameters, ...]
    evidence: Bool[np.ndarray, 's']


@dataclass(frozen=True, slots=True, eq=False)
class FoundPerson:
    """What became of a detection that was fitted as if its frame stood alone.

    Args:
        status: Why there is no body, or that there is one.
        estimate: The person as users get them.
        body: The same as the tracker goes on with it.
    """

    status: EstimateStatus
    estimate: BodyEstimate | None = None
    body: FoundBody | None = None


def find_person(pipeline: BodyPipeline, scene: Scene, detection: Detection) -> FoundPerson:
    """Return a person fitted from retrieved poses, as if the frame stood alone."""
    # A pose is retrieved for joints that agree with each other.
    lifted = pipeline.lift(scene.frame, detection)
    status = pipeline.admit(lifted)
    if status is not EstimateStatus.OK:
        return FoundPerson(status)
    person = pipeline.fit_person(scene, detection, lifted, Stopwatch())
    if person.fit is None:
        return FoundPerson(person.status, person.estimate)
    fit = person.fit
    return FoundPerson(
        person.status, person.estimate,
        FoundBody(
            fit.parameters, fit.hessian,
            tuple(other.parameters for other in fit.runners_up if other.finished), lifted.sure))
