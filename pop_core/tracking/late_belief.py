"""What belongs to a frame of some time ago, moved on to the present one: fits take their time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pop_core.fitting.body_state import FitBody
from pop_core.geometry.camera import Camera
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.tracking.body_filter import FilterState, predict

FASTEST_M_S = 1.5  # nobody who walks goes on faster: the rest of a long step was an error


def moved_on(
    belief: FilterState, body: FitBody, late_s: float, lifted: LiftedJoints | None
) -> FilterState:
    """Return a belief of a frame of `late_s` ago [s] at the present time.

    Args:
        belief: The belief.
        body: The body it is of.
        late_s: Time since the frame; 0 changes nothing.
        lifted: The person's joints of the present frame, if they were detected in it.
    """
    if late_s <= 0.0:
        return belief
    moved = predict(belief, body.model, late_s)
    return moved if lifted is None else caught_up(moved, body, late_s, lifted)


def caught_up(
    predicted: FilterState, body: FitBody, late_s: float, lifted: LiftedJoints
) -> FilterState:
    """Return a predicted belief after the step that keypoints have taken meanwhile.

    Who walks has left the place where a slow fit found them; the step is the median over joints,
    some of which were lifted onto something else.
    """
    rows = lifted.lifted
    if not rows.any():
        return predicted
    points = body.state(predicted.parameters).landmarks[rows]
    step = np.median(lifted.positions_camera[rows] - points, axis=0)
    velocity = predicted.velocity.copy()
    velocity[:3] += np.clip(step / late_s, -FASTEST_M_S, FASTEST_M_S)
    parameters = predicted.parameters.replaced(transl=predicted.parameters.transl + step)
    return replace(predicted, velocity=velocity, parameters=parameters)


def carried(
    lifted: LiftedJoints, there: Float[np.ndarray, 's 3'], here: Float[np.ndarray, 's 3'],
    camera: Camera,
) -> LiftedJoints:
    """Return joints that were lifted in an earlier frame, moved as far as their body has.

    Args:
        lifted: The joints.
        there: Shared points of the body in that frame [m].
        here: The same by now [m].
        camera: Camera of both, without distortion.
    """
    across_px = camera.project(here) - camera.project(there)
    return replace(
        lifted, positions_camera=lifted.positions_camera + (here - there),
        keypoints_px=lifted.keypoints_px + across_px)
