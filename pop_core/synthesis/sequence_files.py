"""The truth of a recording as files beside it: truth.npz, masks, keypoints as OpenPose writes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from pop_core.geometry.transform import invert_transform, make_transform
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.synthesis.sequence import SequenceFrame
from pop_core.synthesis.truth import PersonTruth

# The room has y up and z toward the camera; the map of REP 105 has z up.
T_MAP_ROOM = make_transform(
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), np.zeros(3))


class SequenceFolder:
    """Writes what is known of a recording, frame by frame.

    `truth.npz` has one row per person and frame (`frame`, `id`, joints, states, SMPL parameters)
    and, per frame, `stamp_ns` and `T_map_camera`. `masks/STAMP.png` holds id + 1 where a person
    is seen. `keypoints/STAMP.json` is what a detector would say.
    """

    def __init__(self, folder: Path) -> None:
        """Make the folders."""
        self.masks, self.keypoints = folder / 'masks', folder / 'keypoints'
        self.truth = folder / 'truth.npz'
        for path in (self.masks, self.keypoints):
            path.mkdir(parents=True, exist_ok=True)
        self._rows: list[tuple[int, int, PersonTruth]] = []
        self._stamp_ns: list[int] = []
        self._T_map_camera: list[Float[np.ndarray, '4 4']] = []

    def add(self, frame: SequenceFrame) -> None:
        """Write masks and keypoints of a frame; keep the rest for `close`."""
        stamp_ns = frame.scene.frame.stamp_ns
        number = len(self._stamp_ns)
        self._stamp_ns.append(stamp_ns)
        self._T_map_camera.append(T_map_camera(frame))
        self._rows += [(number, k, person) for k, person in enumerate(frame.scene.people)]
        cv2.imwrite(str(self.masks / f'{stamp_ns}.png'), label_image(frame))
        found = [d for d in frame.detections if d is not None]
        write_openpose_json(self.keypoints / f'{stamp_ns}.json', found)

    def close(self) -> None:
        """Write the truth of all frames."""
        people = [person for _, _, person in self._rows]
        np.savez_compressed(
            self.truth,
            frame=np.array([row[0] for row in self._rows]),
            id=np.array([row[1] for row in self._rows]),
            stamp_ns=np.array(self._stamp_ns), T_map_camera=np.array(self._T_map_camera),
            joints=np.array([p.joints for p in people]),
            shared_points=np.array([p.shared_points for p in people]),
            joint_state=np.array([p.joint_state for p in people]),
            shared_state=np.array([p.shared_state for p in people]),
            transl=np.array([p.parameters.transl for p in people]),
            global_orient=np.array([p.parameters.global_orient for p in people]),
            body_pose=np.array([p.parameters.body_pose for p in people]),
            betas=np.array([p.parameters.betas for p in people]),
            scale=np.array([p.parameters.scale for p in people]))


def T_map_camera(frame: SequenceFrame) -> Float[np.ndarray, '4 4']:  # noqa: N802 - a transform
    """Return where the camera is, in a map with z up."""
    return T_MAP_ROOM @ invert_transform(frame.scene.T_camera_room)


def label_image(frame: SequenceFrame) -> UInt8[np.ndarray, 'h w']:
    """Return id + 1 where a person is seen, 0 elsewhere."""
    labels = np.zeros(frame.scene.frame.depth_m.shape, dtype=np.uint8)
    for number, person in enumerate(frame.scene.people):
        labels[person.mask] = number + 1
    return labels
