"""From a retrieved pose to the parameters of a body placed in the scene (steps 4 and 5)."""

from __future__ import annotations

import numpy as np

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.geometry.rotation import to_rotvec
from pop_core.retrieval.candidate import PoseCandidate


def initial_parameters(model: BodyModel, candidate: PoseCandidate) -> BodyParameters:
    """Return the mean body in a candidate's pose, scaled and placed by Eq. (1) (step 5).

    The similarity puts the candidate's pelvis at a known point; the root joint of the body goes
    there.
    """
    root = candidate.scale * model.joint_template[0]
    return BodyParameters(
        transl=candidate.joints_camera[0] - root,
        global_orient=to_rotvec(candidate.R_camera_body),
        body_pose=np.asarray(candidate.body_pose, dtype=np.float64),
        betas=np.zeros(model.n_betas),
        scale=float(candidate.scale),
    )
