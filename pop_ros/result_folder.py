"""Write what the pipeline found in one frame: `person_K.npz`, `result.json` and `overlay.png`.

Positions are in the camera frame [m], rotations are rotation vectors [rad], shapes are SMPL's.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from pop_core.body.model import BodyModel, rest_parameters
from pop_core.body.model_digest import model_digest
from pop_core.body.skinning import vertices
from pop_core.estimate import (
    BodyEstimate,
    EstimateStatus,
    FrameResult,
    JointState,
    RunnerUp,
)
from pop_core.geometry.camera import Camera
from pop_core.rendering.pictures import result_picture
from pop_core.rgbd import RgbdFrame
from pop_ros.camera_file import camera_json


def write_results(
    folder: str | Path, frame: RgbdFrame, result: FrameResult, model: BodyModel
) -> None:
    """Write all files of one frame; `result.json` comes last and so marks a whole folder.

    Raises:
        OSError: If the folder cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for stale in [folder / 'result.json', *folder.glob('person_*.npz')]:
        stale.unlink(missing_ok=True)
    for index, body in enumerate(result.bodies):
        np.savez_compressed(folder / f'person_{index}.npz', **person_arrays(body, model))
    write_png(folder / 'overlay.png', result_picture(frame, result, model.f))
    content = json.dumps(result_json(result, model, frame.camera), indent=2)
    (folder / 'result.json').write_text(content + '\n', encoding='utf-8')


def person_arrays(body: BodyEstimate, model: BodyModel) -> dict[str, Any]:
    """Return the arrays of a person's file by name."""
    parameters = body.parameters
    tpose = rest_parameters(len(parameters.betas)).replaced(
        betas=parameters.betas, scale=parameters.scale)
    return {
        'joints': body.joints,
        'vertices': body.vertices.astype(np.float32),
        'global_orient': parameters.global_orient,
        'body_pose': parameters.body_pose,
        'transl': parameters.transl,
        'betas': parameters.betas,
        'scale': np.float64(parameters.scale),
        'joint_state': body.joint_state.astype(np.int64),
        'joint_covariance': body.joint_covariance,
        'mask': body.mask,
        'tpose_vertices': vertices(model, tpose).astype(np.float32),
        'faces': model.f.astype(np.int32),
        'score': np.float64(body.score),
        'joint_rotations': body.joint_rotations,
        **runner_up_arrays(body.runners_up, len(parameters.betas)),
        **_track_arrays(body),
    }


def runner_up_arrays(runners_up: Sequence[RunnerUp], n_betas: int) -> dict[str, Any]:
    """Return the other hypotheses of a person, cheapest first, one row each."""
    every = [other.parameters for other in runners_up]
    shapes = {
        'transl': (3,), 'global_orient': (3,), 'body_pose': (23, 3), 'betas': (n_betas,),
        'scale': ()}
    arrays = {
        f'runners_up_{name}':
            np.array([getattr(p, name) for p in every]).reshape(len(every), *shape)
        for name, shape in shapes.items()}
    return arrays | {
        'runners_up_excess_cost': np.array([other.excess_cost for other in runners_up]),
        'runners_up_finished': np.array([other.finished for other in runners_up], dtype=bool)}


def result_json(result: FrameResult, model: BodyModel, camera: Camera) -> dict[str, Any]:
    """Return what is worth reading of a result without loading arrays."""
    return {
        'body': {'name': model.name, 'digest': model_digest(model)},
        'camera': camera_json(camera),
        'status': status_sentence(result),
        'people': [_person_json(index, body) for index, body in enumerate(result.bodies)],
        'detections': [status.value for status in result.statuses],
        'times_ms': {name: round(float(ms), 3) for name, ms in result.times_ms.items()},
    }


def status_sentence(result: FrameResult) -> str:
    """Return what became of a frame, and of every detection that was not fitted."""
    n = len(result.bodies)
    fitted = 'nobody found' if n == 0 else f'{n} {"person" if n == 1 else "people"} fitted'
    dropped = Counter(s.value for s in result.statuses if s is not EstimateStatus.OK)
    return '; '.join([fitted, *(f'{count} not fitted: {why}' for why, count in dropped.items())])


def write_png(path: str | Path, pixels: np.ndarray) -> None:
    """Write an RGB picture, or an image of one channel of 8 or 16 bits.

    Raises:
        OSError: If the file cannot be written.
    """
    image = pixels if pixels.ndim == 2 else cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
    done, content = cv2.imencode('.png', image)
    if not done:
        raise OSError(f'{path}: the picture could not be encoded')
    Path(path).write_bytes(content.tobytes())


def _person_json(index: int, body: BodyEstimate) -> dict[str, Any]:
    states = Counter(JointState(int(state)).name.lower() for state in body.joint_state)
    tracked = {} if body.track is None else {
        'track': {'id': body.track.id, 'state': body.track.state.name.lower()}}
    return tracked | {
        'file': f'person_{index}.npz',
        'score': round(float(body.score), 4),
        'pelvis_m': np.round(body.joints[0], 4).tolist(),
        'joints_by_state': dict(states),
        'pixels': int(body.mask.sum()),
        'energies': {name: float(value) for name, value in body.energies.items()},
        'runners_up': [
            {'excess_cost': round(other.excess_cost, 4), 'finished': other.finished}
            for other in body.runners_up],
    }


def _track_arrays(body: BodyEstimate) -> dict[str, Any]:
    """Return who a followed person is; nothing of frames that stand alone."""
    if body.track is None:
        return {}
    return {
        'track_id': np.int64(body.track.id), 'track_state': np.int64(body.track.state),
        'joint_unseen_s': body.track.joint_unseen_s}
