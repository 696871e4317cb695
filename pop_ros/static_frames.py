"""Fixed transforms between frames: those of /tf_static, or one that the user gives."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pop_core.errors import SettingError
from pop_core.geometry.transform import invert_transform, make_transform

LONGEST_CHAIN = 100  # frames; a longer chain is a loop


class StaticFrames:
    """A tree of frames."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Float[np.ndarray, '4 4']]] = {}

    def add(self, parent: str, child: str, T_parent_child: Float[np.ndarray, '4 4']) -> None:
        """Set where `child` stands in `parent`."""
        self._parents[child.lstrip('/')] = (parent.lstrip('/'), T_parent_child)

    def add_message(self, message: Any) -> list[str]:
        """Take over the transforms of a tf2_msgs/TFMessage; return in words which are none."""
        refused = []
        for transform in message.transforms:
            t, q = transform.transform.translation, transform.transform.rotation
            numbers = [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
            parent, child = transform.header.frame_id, transform.child_frame_id
            if _is_transform(numbers):
                self.add(parent, child, from_translation_quaternion(numbers))
            else:
                refused.append(
                    f'/tf_static: expected a translation and a unit quaternion from {parent!r} '
                    f'to {child!r}, found {numbers}')
        return refused

    def lookup(self, target: str, source: str) -> Float[np.ndarray, '4 4'] | None:
        """Return T_target_source, or None when the tree does not connect the two."""
        target_root, T_root_target = self._to_root(target.lstrip('/'))
        source_root, T_root_source = self._to_root(source.lstrip('/'))
        if target_root != source_root:
            return None
        return invert_transform(T_root_target) @ T_root_source

    def _to_root(self, frame: str) -> tuple[str, Float[np.ndarray, '4 4']]:
        T_root_frame = np.eye(4)
        for _ in range(LONGEST_CHAIN):
            if frame not in self._parents:
                break
            frame, T_parent_child = self._parents[frame]
            T_root_frame = T_parent_child @ T_root_frame
        return frame, T_root_frame


def parse_extrinsics(text: str) -> Float[np.ndarray, '4 4'] | None:
    """Return the transform of 'x y z qx qy qz qw' [m], None for an empty text.

    Raises:
        SettingError: If these are not seven numbers with a quaternion.
    """
    if not text.strip():
        return None
    try:
        numbers = [float(word) for word in text.replace(',', ' ').split()]
    except ValueError:
        numbers = []
    if not _is_transform(numbers):
        raise SettingError(
            "depth.extrinsics: expected 'x y z qx qy qz qw' with a unit quaternion, found "
            f'{text!r}')
    return from_translation_quaternion(numbers)


def _is_transform(numbers: list[float]) -> bool:
    finite = len(numbers) == 7 and bool(np.all(np.isfinite(numbers)))
    return finite and bool(abs(np.linalg.norm(numbers[3:]) - 1) < 0.01)


def from_translation_quaternion(numbers: list[float]) -> Float[np.ndarray, '4 4']:
    """Return the transform of a translation [m] and a quaternion, scalar last."""
    rotation = Rotation.from_quat(numbers[3:]).as_matrix()
    return make_transform(rotation, np.array(numbers[:3]))
