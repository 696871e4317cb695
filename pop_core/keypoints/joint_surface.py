"""The depth of joints that the camera sees, told twice: by votes, and by the skin before them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.keypoints.body_parts import CLASS_OF_LABEL
from pop_core.keypoints.depth_masks import PixelLabels
from pop_core.keypoints.skin_offsets import skin_to_joint_m
from pop_core.keypoints.vote_fusion import BORDERING, VotedPerson
from pop_core.rgbd import RgbdFrame

# Of a seen joint's depth: votes err, and so does the skin of a pixel that errs (0.75 is worse).
SURFACE_SHARE = 0.5


def joints_with_skin(
    person: VotedPerson, index: int, labels: PixelLabels, frame: RgbdFrame
) -> Float[np.ndarray, '15 3']:
    """Return a person's joints [m], moved along their rays toward where the skin says.

    Only pixels of the person count, and of parts that end at the joint: an arm before the trunk
    says nothing of the hip. The probability that the joint is seen weighs what they say.

    Args:
        person: Joints that cells voted for.
        index: Number of the person in the labels.
        labels: Whose each pixel is, and which part.
        frame: What was measured.
    """
    depth_m = frame.depth_m
    uv = np.nan_to_num(frame.camera.project(person.joints), nan=-1.0)
    h, w = depth_m.shape
    inside = ((uv >= 0) & (uv <= [w - 1, h - 1])).all(axis=1)
    u, v = np.rint(np.where(inside[:, None], uv, 0.0)).astype(np.int64).T
    part = CLASS_OF_LABEL[labels.part[v, u]]
    own = inside & (labels.person[v, u] == index) & (
        BORDERING[np.arange(len(part)), part] > 0)
    skin_m, _ = skin_to_joint_m(None)
    z = person.joints[:, 2]
    gap = np.where(own, depth_m[v, u] + skin_m - z, 0.0)
    return np.asarray(person.joints * (1.0 + SURFACE_SHARE * person.visible * gap / z)[:, None])
