"""Runs the completion network: from depth and keypoints to a belief about all joints."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from pop_core.completion.joint_belief import JointBelief
from pop_core.completion.person_view import FEATURES, VIEW_PX, view_person
from pop_core.errors import NetworkShapeError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.onnx_session import OnnxSession, load_network

EMBEDDED = Path(__file__).parents[1] / 'data' / 'completion_net.onnx'
KIND, FORMAT = 'pop_completion_net', '1'
INPUTS = ((1, VIEW_PX, VIEW_PX), (1, VIEW_PX, VIEW_PX), (1, 15, FEATURES))
OUTPUTS = ((1, 15, 3), (1, 15))
NEAREST_M = 0.1  # no joint is nearer to the camera


class JointCompletion:
    """A loaded completion network."""

    def __init__(self, session: OnnxSession) -> None:
        """Take a network written by `python -m pop_core.training.completion export`.

        Raises:
            NetworkShapeError: If it is no network of this kind.
        """
        shapes = tuple(
            tuple(tensor.shape for tensor in side)
            for side in (session.spec.inputs, session.spec.outputs))
        found = session.facts.get(KIND, 'none')
        if found != FORMAT or shapes != (INPUTS, OUTPUTS):
            raise NetworkShapeError(
                f'{session.where}: expected a completion network of this package, '
                f'{INPUTS} -> {OUTPUTS}, format {FORMAT}; found {session.spec}, format {found}')
        self.session = session

    def expected(
        self, depth_m: Float32[np.ndarray, 'h w'], camera: Camera, detection: Detection
    ) -> JointBelief | None:
        """Return where the joints of a person are, None when no depth was measured at any.

        Args:
            depth_m: Depth [m], NaN where nothing was measured.
            camera: Camera without distortion.
            detection: The person's keypoints.
        """
        view = view_person(depth_m, camera, detection)
        if view is None:
            return None
        places, log_sigma = self.session.run(
            view.relief_m[None], view.measured[None], view.keypoints[None])
        shown = places[0].astype(np.float64)
        shown[:, 2] = np.maximum(shown[:, 2], NEAREST_M - view.depth_m)
        return JointBelief(view.to_camera(shown), np.exp(log_sigma[0].astype(np.float64)))


@lru_cache(maxsize=2)  # pipelines of a process share one
def load_completion(path: Path = EMBEDDED) -> JointCompletion:
    """Return the completion network of a file.

    Raises:
        NetworkShapeError: If there is none or it is no such network.
    """
    return JointCompletion(load_network(path))
