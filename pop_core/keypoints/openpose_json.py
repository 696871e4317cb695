"""People as OpenPose writes them: JSON files of BODY_25 keypoints in pixels, and back."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import BODY_25_OF_SHARED
from pop_core.errors import KeypointFileError
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.neck import with_detector_neck, with_smpl_neck
from pop_core.keypoints.people import detection_of
from pop_core.rgbd import RgbdFrame

N_BODY_25 = 25
OTHER_SETS = {54: 'COCO-18', 45: 'MPI-15', 51: 'COCO-17', 405: 'BODY_135'}


class NoKeypointsError(KeypointFileError):
    """No keypoint file was written for this stamp: the frame can be dropped and counted."""


class OpenPoseJsonDetector:
    """People of a folder of files named by the colour stamp, `<stamp_ns>.json`."""

    def __init__(self, folder: Path) -> None:
        """Take an existing folder.

        Raises:
            KeypointFileError: If there is no such folder.
        """
        if not folder.is_dir():
            raise KeypointFileError(f'{folder}: expected a folder of keypoint files, found none')
        self.folder = folder

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people written for the frame's stamp.

        Raises:
            NoKeypointsError: If there is no file of this stamp.
            KeypointFileError: If the file is damaged.
        """
        path = self.folder / f'{frame.stamp_ns}.json'
        if not path.is_file():
            raise NoKeypointsError(f'{path}: expected keypoints of this stamp, found no file')
        return read_openpose_json(path)


class FileDetector:
    """People of one file, whatever frame is asked for."""

    def __init__(self, path: Path) -> None:
        """Read the file at once, so that a damaged one is told before any work.

        Raises:
            KeypointFileError: If the file is missing or damaged.
        """
        self.people = read_openpose_json(path)

    def detect(self, frame: RgbdFrame) -> list[Detection]:  # noqa: ARG002 - the protocol's shape
        """Return the people of the file."""
        return list(self.people)


def read_openpose_json(path: Path) -> list[Detection]:
    """Return the people of one OpenPose file, best first; nobody is an empty list.

    Raises:
        KeypointFileError: If it is not OpenPose JSON of BODY_25 people in pixels.
    """
    document = _load(path)
    people = document.get('people') if isinstance(document, dict) else None
    if not isinstance(people, list):
        raise KeypointFileError(
            f"{path}: expected an object with a list 'people', found {_short(document)}"
        )
    detections = []
    for number, person in enumerate(people):
        rows = _body_25(person, f'{path}: person {number}')
        shared = rows[BODY_25_OF_SHARED]
        if np.any(shared[:, 2] > 0):
            found = detection_of(shared[:, :2], shared[:, 2])
            detections.append(detection_of(with_smpl_neck(found.keypoints_px), found.scores))
    return sorted(detections, key=lambda person: -person.score)


def write_openpose_json(path: Path, detections: Sequence[Detection]) -> None:
    """Write people as OpenPose does; keypoints outside the 15 shared ones are 0, 0, 0."""
    people = []
    for detection in detections:
        rows = np.zeros((N_BODY_25, 3))
        found = detection.scores > 0
        uv = with_detector_neck(detection.keypoints_px)
        shared = np.column_stack([uv, detection.scores])
        rows[BODY_25_OF_SHARED[found]] = shared[found]
        people.append({'person_id': [-1], 'pose_keypoints_2d': rows.ravel().round(4).tolist()})
    path.write_text(json.dumps({'version': 1.3, 'people': people}) + '\n', encoding='utf-8')


def _load(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding='utf-8'), parse_constant=_refuse_constant)
    except OSError as error:
        reason = error.strerror or str(error)
        raise KeypointFileError(f'{path}: expected a keypoint file, found: {reason}') from error
    except (ValueError, RecursionError) as error:
        reason = ' '.join(str(error).split())[:120]
        raise KeypointFileError(f'{path}: expected OpenPose JSON, found: {reason}') from error


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f'{name}, which is not a number')


def _body_25(person: object, where: str) -> Float[np.ndarray, '25 3']:
    """Return the rows (u, v, score) of one person, scores cut to 0..1."""
    values = person.get('pose_keypoints_2d') if isinstance(person, dict) else None
    if not isinstance(values, list):
        raise KeypointFileError(
            f"{where}: expected a list 'pose_keypoints_2d', found {_short(person)}"
        )
    if len(values) != 3 * N_BODY_25:
        name = OTHER_SETS.get(len(values), 'an unknown set')
        raise KeypointFileError(
            f'{where}: expected {3 * N_BODY_25} numbers (BODY_25), found {len(values)} ({name})'
        )
    if not all(isinstance(value, int | float) and abs(value) < 1e6 for value in values):
        bad = next(v for v in values if not isinstance(v, int | float) or not abs(v) < 1e6)
        raise KeypointFileError(f'{where}: expected pixels and scores, found {_short(bad)}')
    rows = np.array(values, dtype=np.float64).reshape(N_BODY_25, 3)
    found = rows[:, 2] > 0
    if np.count_nonzero(found) > 2 and np.abs(rows[found, :2]).max() <= 1.0:
        raise KeypointFileError(
            f'{where}: expected pixels, found only values up to 1: write keypoints at the '
            "input's resolution (--keypoint_scale 0)"
        )
    rows[:, 2] = np.clip(rows[:, 2], 0.0, 1.0)
    return rows


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f'{type(value).__name__} {text[:40]}...'
