"""A tracker, what it sees, and the clock: one person before a wall, or behind a board."""

from dataclasses import replace

import numpy as np
from support.one_person import photograph

from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.estimate import BodyEstimate
from pop_core.keypoints.detection import Detection
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.background import Background
from pop_core.tracking.tracker import BodyTracker
from pop_core.tracking.tracking_config import TrackingConfig

RATE_HZ = 15.0
BOARD_M = 1.5  # something in front of everything


class Scripted:
    """A keypoint source that knows the truth and counts how often it is asked."""

    def __init__(self, body: BodyModel) -> None:
        self.body, self.people, self.asked = body, [], 0

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        self.asked += 1
        return [self.detection(frame, person) for person in self.people]

    def detection(self, frame: RgbdFrame, person: BodyParameters) -> Detection:
        points = attached_positions(shared_points(self.body), self.body, person)
        uv = frame.camera.project(points)
        box = np.concatenate([uv.min(axis=0), uv.max(axis=0)])
        return Detection(uv, np.full(15, 0.9), box)


class Stage:
    """A tracker, what it sees, and the clock."""

    def __init__(
        self, body: BodyModel, config: TrackingConfig | None = None,
        finding: Background | None = None, lookout: Background | None = None,
        searching: Background | None = None,
    ) -> None:
        self.body, self.source = body, Scripted(body)
        pipeline = BodyPipeline(body, default_library(), self.source)
        self.tracker = BodyTracker(pipeline, config, finding, lookout, searching)
        self.stamp_ns, self.statuses = 1_000_000_000, ()

    def show(
        self, *people: BodyParameters, hidden: bool = False, times: int = 1, skipped: int = 0,
    ) -> list[BodyEstimate]:
        """Show people, an empty room, or a board before it; the last frame's bodies."""
        for _ in range(times):
            self.stamp_ns += round(1e9 / RATE_HZ)
            frame = self.frame(*people, hidden=hidden)
            self.source.people = [] if hidden else list(people)
            result = self.tracker.process(frame, skipped)
            bodies, self.statuses = list(result.bodies), result.statuses
        return bodies

    def count_fits(self) -> list[int]:
        """Return a list that grows with every fit from retrieved poses."""
        fits: list[int] = []
        fitter = self.tracker.pipeline.fitter
        fit = fitter.fit
        fitter.fit = lambda *args: fits.append(1) or fit(*args)
        return fits

    def frame(self, *people: BodyParameters, hidden: bool) -> RgbdFrame:
        frame = photograph(self.body, *people)
        if hidden:
            frame = replace(frame, depth_m=np.full_like(frame.depth_m, BOARD_M))
        return replace(frame, stamp_ns=self.stamp_ns)


def only(bodies: list[BodyEstimate]) -> BodyEstimate:
    assert len(bodies) == 1
    assert bodies[0].track is not None
    return bodies[0]
