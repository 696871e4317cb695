"""Where hair grows: top and back of the head, on any model with SMPL's joints."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel


def hair_share(model: BodyModel) -> Float[np.ndarray, 'v']:
    """Return 1 where hair grows, fading to 0 toward face and neck; 0 without a head."""
    on_head = model.weights[:, JOINT_INDEX['head']] > 0.6
    if not on_head.any():
        return np.zeros(len(on_head))
    head = model.v_template[on_head]
    low = head.min(axis=0)
    extent = np.maximum(head.max(axis=0) - low, 1e-6)
    height = (model.v_template[:, 1] - low[1]) / extent[1]
    front = (model.v_template[:, 2] - low[2]) / extent[2]
    share = np.clip((height - 0.35 - 0.42 * np.clip(front - 0.3, 0.0, 0.65) / 0.65) * 8, 0.0, 1.0)
    return np.where(on_head, share, 0.0)
