"""The people a detector found in a frame: lifted, and fitted from retrieved poses if need be."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from pop_core.estimate import EstimateStatus
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.lifting import lift_keypoints
from pop_core.pipeline import (
    BodyPipeline,
    PersonFit,
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


class Finder:
    """Makes bodies of detections, with the steps of one pipeline."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Use a pipeline's library, model and settings."""
        self.pipeline = pipeline

    def lift(self, frame: RgbdFrame, detections: Sequence[Detection]) -> Found:
        """Return detections with their joints, lifted plainly: known people gate them."""
        lifting = self.pipeline.config.lifting
        return Found(detections, [lift_keypoints(frame, d, lifting) for d in detections])

    def lifted_behind(self, scene: Scene, found: Found, index: int) -> LiftedJoints:
        """Return a person's joints, lifted onto nothing that nearer people explain."""
        detection = found.detections[index]
        if not covers_keypoints(scene.taken, detection):
            return found.lifted[index]
        return lift_keypoints(
            without_depth(scene.frame, scene.taken), detection, self.pipeline.config.lifting)

    def fit(self, scene: Scene, found: Found, index: int) -> PersonFit:
        """Return a person fitted from retrieved poses, as if the frame stood alone."""
        detection = found.detections[index]
        # A pose is retrieved for joints that agree with each other.
        lifted = self.pipeline.lift(scene.frame, detection)
        status = self.pipeline.admit(lifted)
        if status is not EstimateStatus.OK:
            return PersonFit(status)
        return self.pipeline.fit_person(scene, detection, lifted, Stopwatch())
