"""Draw what other tools are told of a person: `python -m scripts.write_interop_picture FOLDER`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.joints import COCO_17_NAMES
from pop_core.rendering.overlay import draw_mask_contour
from pop_core.rendering.palette import INK, PAPER, person_color
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.interop_hri_joints import link_frames
from pop_ros.interop_person import Person, PersonReader
from pop_ros.interop_zed import BODY_38, CORNERS
from pop_ros.sources import make_pipeline
from pop_ros.warm_up import OnePerson

SEED, FRAMES, SHOWN = 0, 16, 8  # the scene of docs/pictures/walk.jpg
SCALE, MARGIN_PX, GAP_PX = 2, 24, 8
AXIS_M, AXES = 0.11, ((230, 70, 60), (70, 190, 80), (70, 120, 240))
COCO_BONES = (
    (0, 1), (0, 2), (1, 3), (2, 4), (5, 6), (5, 7), (7, 9), (6, 8), (8, 10), (5, 11), (6, 12),
    (11, 12), (11, 13), (13, 15), (12, 14), (14, 16))
BODY_38_BONES = (
    (0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (5, 7), (6, 8), (7, 9), (3, 10), (3, 11),
    (10, 12), (11, 13), (12, 14), (13, 15), (14, 16), (15, 17), (0, 18), (0, 19), (18, 20),
    (19, 21), (20, 22), (21, 23), (22, 24), (23, 25), (22, 28), (23, 29))
BOX_EDGES = [(k, (k + 1) % 4) for k in range(4)]
BOX_EDGES += [(a + 4, b + 4) for a, b in BOX_EDGES] + [(k, k + 4) for k in range(4)]


class Panel:
    """An enlarged copy of the image that is drawn on in the image's own pixels."""

    def __init__(self, frame: RgbdFrame, title: str) -> None:
        """Enlarge a dimmed image, so that what is drawn stands out."""
        dimmed = (0.55 * frame.rgb + 60).astype(np.uint8)
        self.picture = cv2.resize(dimmed, None, fx=SCALE, fy=SCALE)
        self._title = title

    def line(self, a: np.ndarray, b: np.ndarray, color: tuple[int, int, int]) -> None:
        """Draw a line between two pixels of the image."""
        for shade, width in ((INK, 5), (color, 3)):
            cv2.line(self.picture, _at(a), _at(b), shade, width, cv2.LINE_AA)

    def dot(self, uv: np.ndarray) -> None:
        """Draw a point."""
        cv2.circle(self.picture, _at(uv), 6, INK, -1, cv2.LINE_AA)
        cv2.circle(self.picture, _at(uv), 4, PAPER, -1, cv2.LINE_AA)

    def skeleton(
        self, person: Person, names: Sequence[str], bones: Sequence[tuple[int, int]]
    ) -> None:
        """Draw the bones and points of a set of keypoints."""
        uv = {k: person.uv[person.rows([name])[0]] for k, name in enumerate(names) if name}
        for a, b in bones:
            self.line(uv[a], uv[b], person_color(1))
        for point in uv.values():
            self.dot(point)

    def finish(self, crop: tuple[slice, slice]) -> np.ndarray:
        """Return the part around the person with its title."""
        part = np.ascontiguousarray(self.picture[crop])
        cv2.putText(
            part, self._title, (12, 28), cv2.FONT_HERSHEY_SIMPLEX, 0.7, INK, 2, cv2.LINE_AA)
        return part


def yolo_panel(frame: RgbdFrame, person: Person) -> Panel:
    """Return COCO's keypoints, the box in the image and the outline of the visible part."""
    panel = Panel(frame, 'yolo_msgs')
    mask = cv2.resize(person.body.mask.astype(np.uint8), None, fx=SCALE, fy=SCALE) > 0
    draw_mask_contour(panel.picture, mask, person_color(2))
    left, top, right, bottom = person.box_px
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    for k in range(4):
        panel.line(corners[k], corners[(k + 1) % 4], PAPER)
    panel.skeleton(person, COCO_17_NAMES, COCO_BONES)
    return panel


def zed_panel(frame: RgbdFrame, person: Person) -> Panel:
    """Return BODY_38 and the box in space."""
    panel = Panel(frame, 'zed_msgs: BODY_38')
    corners = frame.camera.project(np.array([person.box_m[ends, range(3)] for ends in CORNERS]))
    for a, b in BOX_EDGES:
        panel.line(corners[a], corners[b], PAPER)
    panel.skeleton(person, BODY_38, BODY_38_BONES)
    return panel


def humans_panel(frame: RgbdFrame, person: Person) -> Panel:
    """Return REP-155's frames as axes: x red, y green, z blue."""
    panel = Panel(frame, 'REP-155: frames')
    for place, R in link_frames(person.body.joints, person.body.joint_rotations).values():
        ends = frame.camera.project(np.vstack([place, place + AXIS_M * R.T]))
        for end, color in zip(ends[1:], AXES, strict=True):
            panel.line(ends[0], end, color)
        panel.dot(ends[0])
    return panel


def _at(uv: np.ndarray) -> tuple[int, int]:
    # Pixel centres are integers: so are those of the enlarged image.
    u, v = np.rint((uv + 0.5) * SCALE - 0.5).astype(int)
    return int(u), int(v)


def main(folder: Path) -> None:
    """Write interop.jpg."""
    scene = synthesise_sequence(default_body(), SEED, FRAMES, rate_hz=10.0)[SHOWN]
    detection = next(d for d in scene.detections() if d is not None)
    body, = make_pipeline(OnePerson(detection)).process(scene.frame).bodies
    person = PersonReader(default_body()).read(0, body, scene.frame.camera)
    low = np.maximum(person.box_px[:2] - MARGIN_PX, 0).astype(int) * SCALE
    high = (person.box_px[2:] + MARGIN_PX).astype(int) * SCALE
    crop = slice(low[1], high[1]), slice(low[0], high[0])
    parts = [make(scene.frame, person).finish(crop)
             for make in (yolo_panel, zed_panel, humans_panel)]
    gap = np.full((len(parts[0]), GAP_PX, 3), 255, np.uint8)
    row = np.concatenate([parts[0], gap, parts[1], gap, parts[2]], axis=1)
    cv2.imwrite(str(folder / 'interop.jpg'), row[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 86])


if __name__ == '__main__':
    main(Path(sys.argv[1]))
