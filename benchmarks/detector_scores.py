"""Figures of a detector over scenes with truth: PCK in 3D, average precision, parts, time."""

from __future__ import annotations

import time

import numpy as np
from jaxtyping import Bool, Float

from benchmarks.detector_errors import WITHIN_M, JointErrors
from pop_core.body.joints import SHARED
from pop_core.estimate import JointState
from pop_core.keypoints.body_parts import CLASS_OF_LABEL, N_CLASSES
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.truth import PersonTruth

SAME_BOX = 0.5   # intersection over union of boxes around what is seen
SHOWN_M2 = 0.03  # people who show less surface neither have to be found nor are wrong to find


class DetectorScores:
    """Counts over scenes."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.errors: dict[str, list[float]] = {'visible': [], 'hidden': []}
        self.joints = JointErrors()
        self.missed = {'visible': 0, 'hidden': 0}
        self.answers: list[tuple[float, bool]] = []
        self.people = 0
        self.confusion = np.zeros((N_CLASSES, N_CLASSES), dtype=np.int64)
        self.wall_ms: list[float] = []
        self.cpu_ms: list[float] = []

    def add(self, scene: SyntheticScene, detector: KeypointDetector) -> None:
        """Run a detector on a scene and compare with its truth."""
        detector.detect(scene.frame)  # what is computed once per camera is not a frame's time
        wall, cpu = time.perf_counter(), time.process_time()
        found = detector.detect(scene.frame)
        self.wall_ms.append((time.perf_counter() - wall) * 1e3)
        self.cpu_ms.append((time.process_time() - cpu) * 1e3)
        boxes = [_visible_box(person) for person in scene.people]
        shown = [_shown_m2(scene, person) >= SHOWN_M2 for person in scene.people]
        owner = _matched(found, boxes)
        for detection, k in zip(found, owner, strict=True):
            if k is None or shown[k]:
                self.answers.append((detection.score, k is not None))
        self.people += sum(shown)
        for k, person in enumerate(scene.people):
            if shown[k]:
                self._add_person(scene, person, found[owner.index(k)] if k in owner else None)
        self._add_parts(scene, found)

    def figures(self) -> dict[str, float | int]:
        """Return all figures by name."""
        hit = self.confusion.diagonal()
        union = self.confusion.sum(axis=0) + self.confusion.sum(axis=1) - hit
        report: dict[str, float | int] = {
            'people': self.people, 'found': sum(right for _, right in self.answers),
            'extra': sum(not right for _, right in self.answers),
            'ap50': average_precision(self.answers, self.people),
            'part_iou': float((hit / np.maximum(union, 1))[1:].mean()),
            'person_iou': float(self.confusion[1:, 1:].sum() / max(
                self.confusion.sum() - self.confusion[0, 0], 1)),
            'median_wall_ms': float(np.median(self.wall_ms)),
            'median_cpu_ms': float(np.median(self.cpu_ms)),
        }
        for kind, errors in self.errors.items():
            near = float(np.sum(np.array(errors) < WITHIN_M))
            report[f'pck_{kind}'] = near / max(len(errors), 1)
            report[f'pck_{kind}_missed_too'] = near / max(len(errors) + self.missed[kind], 1)
            report[f'median_{kind}_m'] = float(np.median(errors)) if errors else float('nan')
        return report

    def text(self) -> str:
        """Return the figures in lines, each with what is wanted."""
        f = self.figures()
        rows = (
            ('3D PCK at 10 cm, visible joints', f['pck_visible'], '>= 0.95'),
            ('  people that were missed counted', f['pck_visible_missed_too'], ''),
            ('3D PCK at 10 cm, hidden joints', f['pck_hidden'], '>= 0.65'),
            ('  people that were missed counted', f['pck_hidden_missed_too'], ''),
            ('average precision of people (box 0.5)', f['ap50'], '>= 0.93'),
            ('mean IoU of body parts', f['part_iou'], '>= 0.70'),
            ('IoU of people against the rest', f['person_iou'], ''),
            ('median error, visible joints [m]', f['median_visible_m'], ''),
            ('median error, hidden joints [m]', f['median_hidden_m'], ''),
            ('median time of an image, wall [ms]', f['median_wall_ms'], '<= 20'),
            ('median time of an image, processor [ms]', f['median_cpu_ms'], ''),
        )
        lines = [f'{name:42} {value:8.3f}  {wanted}' for name, value, wanted in rows]
        return '\n'.join([*lines, f'{f["found"]} of {f["people"]} people, {f["extra"]} extra'])

    def _add_person(
        self, scene: SyntheticScene, person: PersonTruth, found: Detection | None
    ) -> None:
        inside = person.shared_state != JointState.OUT_OF_IMAGE
        seen = person.shared_state == JointState.VISIBLE
        error = None
        if found is not None:
            points = _points(scene, found)
            self.joints.add(points, person.shared_points, seen, inside)
            error = np.nan_to_num(
                np.linalg.norm(points - person.shared_points, axis=1), nan=np.inf)
        for kind, chosen in (('visible', inside & seen), ('hidden', inside & ~seen)):
            if error is None:
                self.missed[kind] += int(chosen.sum())
            else:
                self.errors[kind] += error[chosen].tolist()

    def _add_parts(self, scene: SyntheticScene, found: list[Detection]) -> None:
        said = np.full(scene.part_labels.shape, -1, dtype=np.int64)
        for detection in found:
            if detection.part_labels is not None:
                said = np.where(detection.part_labels >= 0, detection.part_labels, said)
        measured = np.isfinite(scene.frame.depth_m)
        code = CLASS_OF_LABEL[scene.part_labels[measured]] * N_CLASSES + CLASS_OF_LABEL[
            said[measured]]
        self.confusion += np.bincount(code, minlength=N_CLASSES**2).reshape(N_CLASSES, -1)


def average_precision(answers: list[tuple[float, bool]], wanted: int) -> float:
    """Return the area under precision over recall, precision made monotonous (as COCO).

    Args:
        answers: Score, and whether it is right, of each.
        wanted: How many right answers there are.
    """
    if not answers or not wanted:
        return float('nan') if not wanted else 0.0
    right = np.array([good for _, good in sorted(answers, key=lambda answer: -answer[0])])
    precision = np.cumsum(right) / np.arange(1, len(right) + 1)
    best = np.maximum.accumulate(precision[::-1])[::-1]
    return float((best * right).sum() / wanted)


def _points(scene: SyntheticScene, found: Detection) -> Float[np.ndarray, '15 3']:
    """Return where a detection has each joint, camera frame [m]; NaN where none was found."""
    out = np.full((len(SHARED), 3), np.nan)
    depth_m = found.joint_depth_m
    if depth_m is not None:
        known = np.isfinite(depth_m) & np.isfinite(found.keypoints_px).all(axis=1)
        out[known] = scene.frame.camera.unproject(found.keypoints_px[known], depth_m[known])
    return out


def _visible_box(person: PersonTruth) -> Float[np.ndarray, '4']:
    v, u = np.nonzero(person.mask)
    return np.array([u.min(), v.min(), u.max(), v.max()], float) if len(u) else np.zeros(4)


def _shown_m2(scene: SyntheticScene, person: PersonTruth) -> float:
    """Return the surface of a person that the sensor measured, as seen from the camera [m^2]."""
    depth_m = scene.frame.depth_m[person.mask & np.isfinite(scene.frame.depth_m)]
    return float(((depth_m / scene.frame.camera.fx) ** 2).sum())


def _matched(
    found: list[Detection], boxes: list[Float[np.ndarray, '4']]
) -> list[int | None]:
    """Return the person of each detection, best score first, each person once."""
    free: Bool[np.ndarray, 'n'] = np.ones(len(boxes), dtype=bool)
    owner: list[int | None] = [None] * len(found)
    for i in sorted(range(len(found)), key=lambda i: -found[i].score):
        overlap = [box_iou(found[i].box_px, box) if open_ else 0.0
                   for box, open_ in zip(boxes, free, strict=True)]
        if overlap and max(overlap) >= SAME_BOX:
            k = int(np.argmax(overlap))
            owner[i], free[k] = k, False
    return owner


def box_iou(a: Float[np.ndarray, '4'], b: Float[np.ndarray, '4']) -> float:
    """Return intersection over union of boxes of pixels (left, top, right, bottom)."""
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[2:], b[2:])
    both = float(np.prod(np.maximum(high - low + 1, 0)))
    areas = [float(np.prod(box[2:] - box[:2] + 1)) for box in (a, b)]
    return both / (sum(areas) - both)
