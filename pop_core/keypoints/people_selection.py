"""Which of a network's people are kept: no doubles, nobody without a torso in depth.

Bottom-up networks find some people twice, and people between two others, made of a limb of each.
Depth tells: two torsos do not share one place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import SHARED_MIRROR
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.keypoints.lifting import lift_keypoints
from pop_core.keypoints.people import detection_of
from pop_core.keypoints.skeleton import BONE_M, LIMB_ENDS, TORSO, TREE_PARENT
from pop_core.rgbd import RgbdFrame
from pop_core.settings import setting

MIN_TORSO, MIN_LIFTED = 2, 4
MAX_WRONG = 0.4  # share of keypoints that contradict the others
SAME_PLACE_M = 0.12  # keypoints of one joint seen by two detections of the same person
SMALLEST, LARGEST = 0.35, 1.4  # median bone relative to the default body's


@dataclass(frozen=True, slots=True)
class PeopleConfig:
    """Settings of `select_people`."""

    min_keypoint_score: float = setting(
        0.2, minimum=0.0, maximum=1.0, about='Keypoints of a lower score are dropped.')
    min_person_score: float = setting(
        0.35, minimum=0.0, maximum=1.0,
        about='Smallest mean score of the 15 keypoints, missing ones counting zero.')
    min_keypoints: int = setting(
        5, minimum=3, maximum=15, about='Fewest keypoints that make a person.')
    torso_gap_m: float = setting(
        0.33, unit='m', minimum=0.0, maximum=1.0,
        about='Two torsos nearer to each other than this are the same person.')


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    detection: Detection
    lifted: LiftedJoints
    centre: Float[np.ndarray, '3']


def select_people(
    frame: RgbdFrame, detections: Sequence[Detection], config: PeopleConfig | None = None
) -> list[Detection]:
    """Return the people of a frame, best first, each once.

    Of people in one place the best is kept, and completed by what only the others saw. Somebody
    in conflict with several people, who do not conflict with each other, is made of their limbs.

    Args:
        frame: Colour and depth; lens distortion is fine.
        detections: What a network found.
        config: Settings; None takes the defaults.
    """
    config = config or PeopleConfig()
    people = [person for detection in detections
              if (person := _examined(frame, detection, config)) is not None]
    conflict = _conflicts(people, config.torso_gap_m)
    worth = np.array([p.detection.score for p in people]) / (1.0 + conflict.sum(axis=1))
    kept: list[int] = []
    merged: dict[int, Detection] = {}
    for i in np.argsort(-worth, kind='stable'):
        rivals = [k for k in kept if conflict[i, k]]
        if not rivals:
            kept.append(int(i))
            merged[int(i)] = people[i].detection
        elif len(rivals) == 1:
            same_place_px = SAME_PLACE_M * frame.camera.fx / people[rivals[0]].centre[2]
            merged[rivals[0]] = completed(
                merged[rivals[0]], people[i].detection, same_place_px)
    return sorted(merged.values(), key=lambda detection: -detection.score)


def completed(first: Detection, second: Detection, same_place_px: float) -> Detection:
    """Return the first detection of a person with limbs that only the second one told apart.

    Args:
        first: The better detection.
        second: Another one of the same person.
        same_place_px: Keypoints nearer than this are in one place [px].
    """
    uv, scores = first.keypoints_px.copy(), first.scores.copy()
    for j in LIMB_ENDS:
        other = uv[SHARED_MIRROR[j]]
        if scores[j] > 0 and not _near(uv[j], other, same_place_px):
            continue
        if second.scores[j] > 0 and not _near(second.keypoints_px[j], other, same_place_px):
            uv[j], scores[j] = second.keypoints_px[j], second.scores[j]
    return replace(first, keypoints_px=uv, scores=scores, box_px=detection_of(uv, scores).box_px)


def _near(a: Float[np.ndarray, '2'], b: Float[np.ndarray, '2'], radius_px: float) -> bool:
    return bool(np.hypot(*(a - b)) < radius_px)


def _examined(
    frame: RgbdFrame, detection: Detection, config: PeopleConfig
) -> _Candidate | None:
    """Return a detection with its confident keypoints only, or None when it is no person."""
    scores = np.where(detection.scores >= config.min_keypoint_score, detection.scores, 0.0)
    if np.count_nonzero(scores) < config.min_keypoints or scores.mean() < config.min_person_score:
        return None
    clean = detection_of(detection.keypoints_px, scores)
    clean = replace(detection, keypoints_px=clean.keypoints_px, scores=clean.scores,
                    box_px=clean.box_px)
    lifted = lift_keypoints(frame, clean)
    torso = lifted.positions_camera[TORSO][lifted.lifted[TORSO]]
    if len(torso) < MIN_TORSO or lifted.lifted.sum() < MIN_LIFTED or not _human(lifted):
        return None
    return _Candidate(clean, lifted, np.median(torso, axis=0))


def _human(lifted: LiftedJoints) -> bool:
    """Return whether joints fit together as a body's, of a person's size."""
    wrong = np.count_nonzero(lifted.state == LiftState.OUTLIER)
    position = lifted.positions_camera
    ratio = np.linalg.norm(position - position[TREE_PARENT], axis=1) / BONE_M
    known = np.isfinite(ratio)
    sized = not known.any() or SMALLEST < np.median(ratio[known]) < LARGEST
    return bool(sized and wrong < MAX_WRONG * np.count_nonzero(lifted.scores))


def _conflicts(people: Sequence[_Candidate], gap_m: float) -> Bool[np.ndarray, 'n n']:
    """Return which people cannot both be there: one torso, or mostly the same keypoints."""
    n = len(people)
    conflict = np.zeros((n, n), dtype=bool)
    for i, a in enumerate(people):
        for k in range(i + 1, n):
            b = people[k]
            apart = np.linalg.norm(a.centre - b.centre)
            conflict[i, k] = conflict[k, i] = apart < gap_m or _share_most(a.lifted, b.lifted)
    return conflict


def _share_most(a: LiftedJoints, b: LiftedJoints) -> bool:
    """Return whether most joints that either of them has lie in one place in both."""
    gap = np.linalg.norm(a.positions_camera - b.positions_camera, axis=1)
    both = np.isfinite(gap)
    fewer = min(a.lifted.sum(), b.lifted.sum())
    return bool(np.count_nonzero(gap[both] < SAME_PLACE_M) > 0.5 * fewer)
