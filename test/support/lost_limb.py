"""A person whose arm is elsewhere than it is believed to be."""

import numpy as np
from support.one_person import lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.observation import observe
from pop_core.pipeline import BodyPipeline
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.limb_recovery import LostLimbs
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import WarmStart

NOBODY_RESTS = np.zeros(24, dtype=bool)


def raised(person: BodyParameters, radians: float) -> BodyParameters:
    """Return a person whose left arm hangs differently."""
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1, 2] += radians
    return person.replaced(body_pose=pose)


def lost_limbs(
    pipeline: BodyPipeline, body: BodyModel, seen: BodyParameters, believed: BodyParameters
) -> LostLimbs:
    """Return a fit that began, and stayed, where a person is believed to be."""
    frame, lifted = photograph(body, seen), lift_truth(body, seen)
    observation = observe(frame, lifted, np.zeros(frame.depth_m.shape, dtype=bool))
    belief = first_state(believed, 1e6 * np.eye(pipeline.fitter.coarse.size))
    warm = WarmStart(pipeline.fitter, TrackingConfig().prior_weight)
    fit = warm.fit(belief, observation, 1, detected=False)
    return LostLimbs(belief, fit, observation, lifted, NOBODY_RESTS)
