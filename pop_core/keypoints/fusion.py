"""Merge the people that several sources found in one image; each may find whom others miss.

Detections of one person are told by keypoint similarity. Where sources agree on a joint, their
places are averaged by precision; where they do not, the most confident one is believed. Sources
that see colour know limbs to some pixels, those that see depth alone to some centimetres: the
latter have a say about joints that they see and no other names, and whether guessed ones are seen
at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.keypoints.boxes import BoxDetector, TopDownDetector, boxes_of, distinct_boxes
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.keypoint_similarity import (
    common_size_px,
    joint_similarity,
    person_similarities,
)
from pop_core.keypoints.people import detection_of
from pop_core.rgbd import RgbdFrame
from pop_core.settings import setting

NAMED = 0.1  # keypoints of a lower score are hardly ever lifted
SEEN = 0.5


@dataclass(frozen=True, slots=True)
class FusionConfig:
    """Settings of `fuse`."""

    same_person: float = setting(
        0.4, minimum=0.0, maximum=1.0,
        about='Keypoint similarity from which detections of two sources are the same person.')
    same_joint: float = setting(
        0.3, minimum=0.0, maximum=1.0,
        about='Similarity from which two places of a joint agree and are averaged.')
    mirror_gain: float = setting(
        0.2, minimum=0.0, maximum=1.0,
        about='A person is turned around when that raises the similarity by more than this.')


class FusedDetector:
    """Several sources as one: people, boxes, and networks that look into boxes."""

    def __init__(
        self,
        people: Sequence[KeypointDetector],
        boxes: Sequence[BoxDetector] = (),
        top_down: Sequence[TopDownDetector] = (),
        config: FusionConfig | None = None,
    ) -> None:
        """Take the sources.

        Args:
            people: Sources that find people and their joints.
            boxes: Sources that only find where people are.
            top_down: Sources that look into the boxes of all others.
            config: Settings; None takes the defaults.
        """
        self.people = tuple(people)
        self.boxes = tuple(boxes)
        self.top_down = tuple(top_down)
        self.config = config or FusionConfig()

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, each once, best first."""
        found = [source.detect(frame) for source in self.people]
        if self.top_down:
            known = boxes_of(fuse(found, self.config))
            boxes = distinct_boxes(
                [*known, *(box for source in self.boxes for box in source.find_boxes(frame))])
            found += [source.detect_in(frame, boxes) for source in self.top_down]
        return fuse(found, self.config)


def fuse(
    found: Sequence[Sequence[Detection]], config: FusionConfig | None = None
) -> list[Detection]:
    """Return the people that several sources found, each once, best first.

    The order of the sources does not matter. Somebody whom one source found twice is kept once,
    and somebody without a keypoint not at all.

    Args:
        found: People by source.
        config: Settings; None takes the defaults.
    """
    config = config or FusionConfig()
    named = [
        (person, source) for source, group in enumerate(found) for person in group
        if person.scores.any()]
    named.sort(key=lambda item: -item[0].score)
    people, sources = [person for person, _ in named], [source for _, source in named]
    same = person_similarities(people, people)
    turned = [person.with_sides_exchanged() for person in people]
    turned_same = person_similarities(people, turned) - config.mirror_gain
    groups: dict[int, dict[int, Detection]] = {}  # by the best member: a detection per source
    for i, person in enumerate(people):
        leaders = list(groups)
        likeness = np.maximum(same[leaders, i], turned_same[leaders, i])
        if not leaders or likeness.max() < config.same_person:
            groups[i] = {sources[i]: person}
            continue
        leader = leaders[int(likeness.argmax())]
        facing = person if same[leader, i] >= turned_same[leader, i] else turned[i]
        # A second one of the same source is a double, and worse than the one that is there.
        groups[leader].setdefault(sources[i], facing)
    merged = [merge(list(group.values()), config.same_joint) for group in groups.values()]
    return sorted(merged, key=lambda person: -person.score)


def merge(members: Sequence[Detection], same_joint: float) -> Detection:
    """Return one person of several detections of it.

    A score is the inverse of a standard deviation: places that agree are weighted by its square.

    Args:
        members: The detections, the best first.
        same_joint: Similarity from which two places of a joint agree.
    """
    if len(members) == 1:
        return members[0]
    uv = np.stack([member.keypoints_px for member in members])
    scores, named = _confidences(members)
    surest = scores.argmax(axis=0)
    leader = uv[surest, np.arange(uv.shape[1])]
    size_px = common_size_px(members)
    agree = (joint_similarity(uv, leader, size_px) >= same_joint) & (scores > 0)
    weight = np.where(agree, scores**2, 0.0)
    total = weight.sum(axis=0)
    mean = (weight[..., None] * np.nan_to_num(uv)).sum(axis=0) / np.maximum(total, 1e-12)[:, None]
    merged_px = np.where((total > 0)[:, None], mean, np.nan)
    merged = detection_of(merged_px, scores.max(axis=0))
    depth_m, sigma_m = _depths(members, agree)
    best = members[0]
    return replace(
        merged, joint_depth_m=depth_m, joint_sigma_m=sigma_m,
        visible=_visible(members, agree, np.where(named, merged.scores, 0.0)),
        person_mask=next((m.person_mask for m in members if m.person_mask is not None), None),
        # Keypoints in colour tell limbs apart better than parts seen in depth.
        part_labels=None if named.any() else next(
            (m.part_labels for m in members if m.part_labels is not None), None),
        box_px=_around(best.box_px, merged.box_px))


def _confidences(
    members: Sequence[Detection]
) -> tuple[Float[np.ndarray, 'm s'], Bool[np.ndarray, 's']]:
    """Return each source's confidence in each joint, 0 where it has no say, and who is named.

    Named are joints of which a source that sees colour is sure enough. One that sees depth alone
    has no say there; nor, beside the other, about joints that it does not see itself: what poses
    people take tells as much.
    """
    scores = np.stack([member.scores for member in members])
    in_colour = np.array([member.sees_colour for member in members])[:, None]
    named = np.any(in_colour & (scores >= NAMED), axis=0)
    unseen = np.stack([
        np.zeros(len(member.scores), dtype=bool) if member.visible is None
        else member.visible < SEEN for member in members])
    silent = ~in_colour & (named | (unseen & named.any()))
    return np.where(silent, 0.0, scores), named


def _depths(
    members: Sequence[Detection], agree: Bool[np.ndarray, 'm s']
) -> tuple[Float[np.ndarray, 's'] | None, Float[np.ndarray, 's'] | None]:
    """Return depth and standard deviation of joints by the members whose place is believed."""
    total = np.zeros(agree.shape[1])
    weighted = np.zeros(agree.shape[1])
    for member, believed in zip(members, agree, strict=True):
        if member.joint_depth_m is None or member.joint_sigma_m is None:
            continue
        known = believed & np.isfinite(member.joint_depth_m) & (member.joint_sigma_m > 0)
        precision = np.where(known, 1.0 / np.where(known, member.joint_sigma_m, 1.0) ** 2, 0.0)
        total += precision
        weighted += precision * np.where(known, member.joint_depth_m, 0.0)
    if all(member.joint_depth_m is None for member in members):
        return None, None
    known = total > 0
    safe = np.where(known, total, 1.0)
    return np.where(known, weighted / safe, np.nan), np.where(known, safe**-0.5, np.nan)


def _visible(
    members: Sequence[Detection], agree: Bool[np.ndarray, 'm s'], at_least: Float[np.ndarray, 's']
) -> Float[np.ndarray, 's'] | None:
    """Return the mean probability of being seen, by members whose place is believed.

    Args:
        members: Detections of one person.
        agree: Whose places are believed.
        at_least: Confidence of a source that sees colour: it is sure of what it sees.
    """
    known = [(m.visible, rows) for m, rows in zip(members, agree, strict=True)
             if m.visible is not None]
    if not known:
        return None
    said = np.stack([visible for visible, _ in known])
    weight = np.stack([rows for _, rows in known]).astype(np.float64)
    # Where nobody who can say is believed, the most confident one's word is taken.
    weight[0] += weight.sum(axis=0) == 0
    return np.maximum((weight * said).sum(axis=0) / weight.sum(axis=0), at_least)


def _around(a: Float[np.ndarray, '4'], b: Float[np.ndarray, '4']) -> Float[np.ndarray, '4']:
    """Return the box around two boxes."""
    return np.concatenate([np.minimum(a[:2], b[:2]), np.maximum(a[2:], b[2:])])
