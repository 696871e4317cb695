"""Lifted joints that contradict each other: bones too long, too short, two limbs in one place."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import SHARED_INDEX, SHARED_MIRROR
from pop_core.keypoints.lifted_joints import LiftState
from pop_core.keypoints.skeleton import BONE_M, HIPS, LIMB_ENDS, TREE_PARENT

SLACK_M = 0.12  # keypoint and depth errors of both ends
SHORTEST = 0.4  # of a limb's bone, relative to the mean: shorter ones are noise at best
ONE_PLACE_M = 0.06  # left and right limbs nearer than this are one limb seen twice
GUESSED_NOSE_SCORE, FROM_BEHIND = 0.5, -0.3
# Limbs far below what a detector usually says of this person are guesses: it does not see them.
USUAL_PERCENTILE, GUESSED_SHARE = 75, 0.6
FEWEST_SURE = 5


def without_broken_bones(
    position: Float[np.ndarray, 's 3'],
    scores: Float[np.ndarray, 's'],
    state: Int[np.ndarray, 's'],
    size: float,
) -> Int[np.ndarray, 's']:
    """Return states in which no two visible neighbours are farther apart than a bone is long.

    Of a broken bone's ends, the one with the larger share of broken bones is wrong, then the less
    certain one.

    Args:
        position: Joints, camera frame [m].
        scores: Confidence of each keypoint.
        state: A LiftState per joint.
        size: Longest bones relative to the mean bones of the default body.
    """
    state = state.copy()
    too_long = _bone_lengths(position) > BONE_M * size + SLACK_M
    while True:
        bones = _both_visible(state)
        if not np.any(too_long & bones):
            return state
        blame = _ends(too_long & bones) / np.maximum(_ends(bones), 1)
        state[np.argmax(np.where(blame > 0, 2.0 * blame - scores, -np.inf))] = LiftState.OUTLIER


def without_hidden_limbs(
    position: Float[np.ndarray, 's 3'],
    scores: Float[np.ndarray, 's'],
    state: Int[np.ndarray, 's'],
    size: float,
) -> Int[np.ndarray, 's']:
    """Return states in which limbs that the body itself hides are not lifted onto it.

    A guessed keypoint of a hidden limb shows the skin in front: its bone comes out far too short,
    or it falls onto the other side's limb. The less certain end of the two is the hidden one.

    Args:
        position: Joints, camera frame [m].
        scores: Confidence of each keypoint.
        state: A LiftState per joint.
        size: Size of the person relative to the default body.
    """
    state = state.copy()
    too_short = _bone_lengths(position) < SHORTEST * BONE_M * size
    for j in LIMB_ENDS:
        mirrored = SHARED_MIRROR[j]
        both = state[j] == state[mirrored] == LiftState.VISIBLE
        apart = np.linalg.norm(position[j] - position[mirrored])
        if both and apart < ONE_PLACE_M * size:
            state[j if scores[j] < scores[mirrored] else mirrored] = LiftState.OCCLUDED
        parent = TREE_PARENT[j]
        if too_short[j] and state[j] == state[parent] == LiftState.VISIBLE:
            # A thigh hardly ever points away from a camera that sees its knee.
            thigh = parent in HIPS
            guessed = parent in LIMB_ENDS and scores[parent] < scores[j]
            state[parent if thigh or guessed else j] = LiftState.OCCLUDED
    return state


def with_guessed_limbs(
    scores: Float[np.ndarray, 's'], state: Int[np.ndarray, 's']
) -> Int[np.ndarray, 's']:
    """Return states in which limbs that a detector does not really see are called guessed.

    What the camera sees at the pixel of a guess is mostly what hides the joint: the direction is
    right, the depth is another's. Scores are compared with each other, since detectors differ in
    what they call sure. Where too few joints remain, guesses count as seen.

    Args:
        scores: Confidence of each keypoint; 0 where there is none.
        state: A LiftState per joint.
    """
    if not (scores > 0).any():
        return state
    usual = np.percentile(scores[scores > 0], USUAL_PERCENTILE)
    guessed = np.zeros(len(scores), dtype=bool)
    guessed[LIMB_ENDS] = scores[LIMB_ENDS] < GUESSED_SHARE * usual
    guessed &= state == LiftState.VISIBLE
    if (state == LiftState.VISIBLE).sum() - guessed.sum() < FEWEST_SURE:
        return state
    return np.where(guessed, int(LiftState.GUESSED), state)


def without_guessed_nose(
    scores: Float[np.ndarray, 's'], state: Int[np.ndarray, 's'], facing_share: float | None
) -> Int[np.ndarray, 's']:
    """Return states in which a nose nobody can see, since the person turns away, is hidden."""
    nose = SHARED_INDEX['head']
    state = state.copy()
    turned_away = facing_share is not None and facing_share < FROM_BEHIND
    if turned_away and state[nose] == LiftState.VISIBLE and scores[nose] < GUESSED_NOSE_SCORE:
        state[nose] = LiftState.OCCLUDED
    return state


def _ends(bones: Bool[np.ndarray, 's']) -> Int[np.ndarray, 's']:
    """Return how many of some bones, each named by its outer joint, end at each joint."""
    outer = np.flatnonzero(bones)
    return np.bincount(np.concatenate([outer, TREE_PARENT[outer]]), minlength=len(bones))


def _bone_lengths(position: Float[np.ndarray, 's 3']) -> Float[np.ndarray, 's']:
    """Return the distance of each joint to its parent [m]; meaningless for the root."""
    return np.linalg.norm(position - position[TREE_PARENT], axis=1)


def _both_visible(state: Int[np.ndarray, 's']) -> Bool[np.ndarray, 's']:
    visible = state == LiftState.VISIBLE
    return visible & visible[TREE_PARENT] & (TREE_PARENT >= 0)
