"""People as OpenPose writes them: JSON files of keypoints in pixels; BODY_25 is written back.

Sets are told apart by their number of keypoints: BODY_25 and COCO-18 are OpenPose's own, others
write COCO-17, Halpe-26 and COCO-WholeBody-133 into its format.
"""

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
from pop_core.keypoints.keypoint_sets import BODY_25, OF_FILES, KeypointSet
from pop_core.keypoints.neck import with_detector_neck
from pop_core.keypoints.people import detections_of
from pop_core.rgbd import RgbdFrame

OTHER_SETS = {15: 'MPI-15', 135: 'BODY_135'}
KNOWN = ', '.join(f'{count} ({known.name})' for count, known in sorted(OF_FILES.items()))
Rows = tuple[KeypointSet, Float[np.ndarray, 'k 3']]


class NoKeypointsError(KeypointFileError):
    """No keypoint file was written for this stamp: the frame can be dropped and counted."""


class OpenPoseJsonDetector:
    """People of a folder of files named by the colour stamp, `<stamp_ns>.json`."""

    def __init__(self, folder: str | Path) -> None:
        """Take an existing folder.

        Raises:
            KeypointFileError: If there is no such folder.
        """
        folder = Path(folder)
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

    def __init__(self, path: str | Path) -> None:
        """Read the file at once, so that a damaged one is told before any work.

        Raises:
            KeypointFileError: If the file is missing or damaged.
        """
        self.people = read_openpose_json(path)

    def detect(self, frame: RgbdFrame) -> list[Detection]:  # noqa: ARG002 - the protocol's shape
        """Return the people of the file."""
        return list(self.people)


def read_openpose_json(path: str | Path) -> list[Detection]:
    """Return the people of one OpenPose file, best first; nobody is an empty list.

    Raises:
        KeypointFileError: If it is not OpenPose JSON of people in pixels, of a set we know.
    """
    path = Path(path)
    document = _load(path)
    people = document.get('people') if isinstance(document, dict) else None
    if not isinstance(people, list):
        raise KeypointFileError(
            f"{path}: expected an object with a list 'people', found {_short(document)}"
        )
    detections: list[Detection] = []
    for number, person in enumerate(people):
        keypoints, rows = _rows(person, f'{path}: person {number}')
        detections += detections_of(keypoints, [(rows[:, :2], rows[:, 2])])
    return sorted(detections, key=lambda person: -person.score)


def write_openpose_json(path: str | Path, detections: Sequence[Detection]) -> None:
    """Write people as OpenPose does; keypoints outside the 15 shared ones are 0, 0, 0."""
    people = []
    for detection in detections:
        rows = np.zeros((len(BODY_25), 3))
        found = detection.scores > 0
        uv = with_detector_neck(detection.keypoints_px)
        shared = np.column_stack([uv, detection.scores])
        rows[BODY_25_OF_SHARED[found]] = shared[found]
        people.append({'person_id': [-1], 'pose_keypoints_2d': rows.ravel().round(4).tolist()})
    Path(path).write_text(json.dumps({'version': 1.3, 'people': people}) + '\n', encoding='utf-8')


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


def _rows(person: object, where: str) -> Rows:
    """Return which keypoints one person has, and their rows (u, v, score)."""
    values = person.get('pose_keypoints_2d') if isinstance(person, dict) else None
    if not isinstance(values, list):
        raise KeypointFileError(
            f"{where}: expected a list 'pose_keypoints_2d', found {_short(person)}"
        )
    count, left = divmod(len(values), 3)
    if left or count not in OF_FILES:
        name = 'an unknown set' if left else OTHER_SETS.get(count, 'an unknown set')
        raise KeypointFileError(
            f'{where}: expected three numbers for each of {KNOWN} keypoints, found '
            f'{len(values)} numbers ({name})')
    if not all(isinstance(value, int | float) and abs(value) < 1e6 for value in values):
        bad = next(v for v in values if not isinstance(v, int | float) or not abs(v) < 1e6)
        raise KeypointFileError(f'{where}: expected pixels and scores, found {_short(bad)}')
    rows = np.array(values, dtype=np.float64).reshape(count, 3)
    found = rows[:, 2] > 0
    if np.count_nonzero(found) > 2 and np.abs(rows[found, :2]).max() <= 1.0:
        raise KeypointFileError(
            f'{where}: expected pixels, found only values up to 1: write keypoints at the '
            "input's resolution (--keypoint_scale 0)"
        )
    return OF_FILES[count], rows


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f'{type(value).__name__} {text[:40]}...'
