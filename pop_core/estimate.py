"""The result for one person of one frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.model import BodyParameters


class JointState(IntEnum):
    """How much of a joint the camera sees, from geometry."""

    VISIBLE = 0
    SELF_OCCLUDED = 1
    SCENE_OCCLUDED = 2
    OUT_OF_IMAGE = 3
    UNKNOWN = 4


class EstimateStatus(Enum):
    """What became of one detected person; a bad frame is data, not an exception."""

    OK = 'fitted'
    WAITING = 'being fitted, or waiting to be: shown in a later frame'
    TOO_FEW_JOINTS = (
        'fewer lifted joints than min_joints: move closer or check the depth registration'
    )
    TOO_FAR = 'beyond max_range_m'
    OUTSIDE = 'outside the region of interest (region.*)'
    TOO_MANY = 'one more than max_people, which takes the nearest'
    NO_SUPPORT = 'the fitted body does not explain the depth of its pixels: probably no person'
    NO_SKELETON = (
        'no human pose comes near the lifted joints: the keypoints are not those of one person'
    )


class TrackState(IntEnum):
    """Where a tracked person is in the life of their track."""

    NEW = 0  # seen too few times to be sure of
    TRACKED = 1  # seen in this frame
    PREDICTED = 2  # hidden in this frame; where they should be by now
    LOST = 3  # hidden for long, or not where they should be: waits to be found again


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Which person of a sequence a body is, and how fresh the evidence for it.

    Args:
        id: Number of the person; never given to a second one.
        state: Where the person is in the life of the track.
        age_s: Time since the person was first seen [s].
        unseen_s: Time since any of the person was last seen [s].
        joint_unseen_s: Time since each joint was last seen [s]; its track's age if it never was.
    """

    id: int
    state: TrackState
    age_s: float
    unseen_s: float
    joint_unseen_s: Float[np.ndarray, '24']


@dataclass(frozen=True, slots=True, eq=False)
class RunnerUp:
    """Another explanation of a person: a hypothesis that did not win.

    Args:
        parameters: SMPL parameters in the camera frame, where its fit ended.
        excess_cost: What it costs beyond the winner, both before the winner's polish: E_depth on
            the same pixels, keypoints and priors. Never negative among the finished, 0 of those
            who are followed.
        finished: Whether it was fitted to the end; others were left behind after the joints or
            the first surface steps, and are as far off as their pose.
    """

    parameters: BodyParameters
    excess_cost: float
    finished: bool


@dataclass(frozen=True, slots=True, eq=False)
class BodyEstimate:
    """One fitted person.

    Args:
        parameters: SMPL parameters in the camera frame.
        vertices: Mesh [m], camera frame.
        joints: The 24 joints [m], camera frame.
        joint_rotations: Orientation of each joint's frame in the camera frame.
        joint_state: A JointState per joint.
        joint_covariance: Covariance of each joint's position [m^2].
        mask: Pixels of the frame that show this person: the paper's H, and holes in its depth.
        score: Confidence 0..1 that this is a person fitted right.
        energies: Final energies by name.
        runners_up: The other hypotheses, cheapest first; of people who are followed those that are
            followed beside them, which cost about the same.
        track: Which person of a sequence this is; None where each frame stands alone.
    """

    parameters: BodyParameters
    vertices: Float[np.ndarray, 'v 3']
    joints: Float[np.ndarray, '24 3']
    joint_rotations: Float[np.ndarray, '24 3 3']
    joint_state: Int[np.ndarray, '24']
    joint_covariance: Float[np.ndarray, '24 3 3']
    mask: Bool[np.ndarray, 'h w']
    score: float
    energies: Mapping[str, float] = field(default_factory=dict)
    runners_up: tuple[RunnerUp, ...] = ()
    track: Track | None = None


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """Everything the pipeline has to say about one frame.

    Args:
        bodies: Fitted people, nearest first.
        statuses: One status per detection, in the detector's order; none in frames of a
            sequence that were followed without asking the detector.
        times_ms: Wall time per step [ms]; of a look for people that was made beside the following,
            in the frame that hears of it, so that the sum may exceed the frame's time.
    """

    bodies: tuple[BodyEstimate, ...]
    statuses: tuple[EstimateStatus, ...]
    times_ms: Mapping[str, float]
