"""Runs the completion network: from depth and keypoints to a belief about all joints."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from pop_core.completion.person_view import FEATURES, VIEW_PX, view_person
from pop_core.errors import NetworkShapeError
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.onnx_session import OnnxSession, load_network
from pop_core.keypoints.upright import points_turned_back, upright_frame, upright_pixels
from pop_core.rgbd import RgbdFrame

EMBEDDED = Path(__file__).parents[1] / 'data' / 'completion_net.onnx'
KIND, FORMAT = 'pop_completion_net', '1'
INPUTS = ((1, VIEW_PX, VIEW_PX), (1, VIEW_PX, VIEW_PX), (1, 15, FEATURES))
OUTPUTS = ((1, 15, 3), (1, 15))
NEAREST_M = 0.1  # no joint is nearer to the camera
SIGMA_M = (0.01, 2.0)  # nothing is surer or vaguer


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
        kinds = {tensor.dtype for tensor in (*session.spec.inputs, *session.spec.outputs)}
        if found != FORMAT or shapes != (INPUTS, OUTPUTS) or kinds != {'float32'}:
            raise NetworkShapeError(
                f'{session.where}: expected a completion network of this package, '
                f'{INPUTS} -> {OUTPUTS} in float32, format {FORMAT}; found {session.spec}, '
                f'format {found}')
        self.session = session

    def expected(
        self, frame: RgbdFrame, detection: Detection,
        taken: Bool[np.ndarray, 'h w'] | None = None,
    ) -> JointBelief | None:
        """Return where the joints of a person are, None when no depth was measured at any.

        Args:
            frame: The frame without lens distortion.
            detection: The person's keypoints.
            taken: Pixels of others, who do not tell how far this person is.

        Raises:
            NetworkShapeError: If the network fails, or says what is no number.
        """
        camera, upright = frame.camera, upright_frame(frame)
        turned = replace(detection, keypoints_px=upright_pixels(detection.keypoints_px, camera))
        others = None if taken is None else np.rot90(taken, camera.quarter_turns)
        view = view_person(upright.depth_m, upright.camera, turned, others)
        if view is None:
            return None
        places, log_sigma = (
            said[0].astype(np.float64) for said in self.session.run(
                view.relief_m[None], view.measured[None], view.keypoints[None]))
        if not (np.isfinite(places).all() and np.isfinite(log_sigma).all()):
            raise NetworkShapeError(f'{self.session.where}: expected numbers, found nan or inf')
        places[:, 2] = np.maximum(places[:, 2], NEAREST_M - view.depth_m)
        return JointBelief(
            points_turned_back(view.to_camera(places), camera),
            np.clip(np.exp(log_sigma), *SIGMA_M))


@lru_cache(maxsize=2)  # pipelines of a process share one
def load_completion(path: Path = EMBEDDED) -> JointCompletion:
    """Return the completion network of a file.

    Raises:
        NetworkShapeError: If there is none or it is no such network.
    """
    return JointCompletion(load_network(path))
