"""Read back what the node published: people by stamp, from a bag of `pop replay`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import N_JOINTS
from pop_core.body.model import BodyModel
from pop_core.fitting.joint_state import fitted_joint_states
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rendering.shown_body import ShownBody
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_reader import BagReader
from pop_ros.from_messages import stamp_ns
from pop_ros.ros1_conversion import read_marker
from pop_ros.to_messages import CLOUD_TYPE

MESH, JOINTS, CLOUD = '/pop/mesh', '/pop/joints', '/pop/cloud'
ADD = 0  # visualization_msgs/Marker


@dataclass(slots=True, eq=False)
class RecordedFrame:
    """What was published with one stamp.

    Args:
        triangles: Corner points of each person's mesh [m], in the order of the messages.
        ids: Person of each mesh.
        joints: The 24 joints of each person [m].
        cloud: Points of all people.
    """

    triangles: list[Float[np.ndarray, 'n 3']] = field(default_factory=list)
    ids: list[int] = field(default_factory=list)
    joints: Float[np.ndarray, 'p 24 3'] = field(
        default_factory=lambda: np.zeros((0, N_JOINTS, 3)))
    cloud: np.ndarray = field(default_factory=lambda: np.zeros(0, CLOUD_TYPE))


def read_bodies(bag: Path) -> dict[int, RecordedFrame]:
    """Return the recorded people of a bag by stamp [ns].

    Raises:
        BagError: If there is no such bag.
    """
    return dict(iterate_bodies(bag))


def iterate_bodies(bag: Path) -> Iterator[tuple[int, RecordedFrame]]:
    """Yield the recorded people of a bag, frame by frame with their stamps [ns].

    Raises:
        BagError: If there is no such bag.
    """
    frame, current_ns = RecordedFrame(), None
    with BagReader(bag) as reader:
        for message in reader.messages([MESH, JOINTS, CLOUD]):
            content, corners = (
                read_marker(message.data) if message.topic == MESH else (message.read(), None))
            stamp = stamp_ns(content.header)
            if current_ns is not None and stamp != current_ns:
                yield current_ns, frame
                frame = RecordedFrame()
            current_ns = stamp
            _add(frame, message.topic, content, corners)
    if current_ns is not None:
        yield current_ns, frame


def shown_bodies(
    recorded: RecordedFrame, frame: RgbdFrame, model: BodyModel
) -> list[ShownBody]:
    """Return recorded people ready to draw; joint states follow from geometry.

    Args:
        recorded: What was published for this frame.
        frame: The frame itself.
        model: Body whose mesh was published.
    """
    bodies = []
    for corners, person, joints in zip(
        recorded.triangles, recorded.ids, recorded.joints, strict=False
    ):
        vertices = mesh_vertices(corners, model.f)
        rendered = render_depth(vertices, model.f, frame.camera)
        state = fitted_joint_states(model, joints, rendered, frame.depth_m, frame.camera)
        points = recorded.cloud[recorded.cloud['person'] == person]
        mask = cloud_mask(points, frame.camera)
        bodies.append(ShownBody(vertices, joints, state, mask, person))
    return bodies


def mesh_vertices(
    corners: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3']
) -> Float[np.ndarray, 'v 3']:
    """Return the vertices of a mesh published as the corners of all its triangles."""
    vertices = np.zeros((int(f.max()) + 1, 3))
    vertices[f.ravel()] = corners
    return vertices


def cloud_mask(points: np.ndarray, camera: Camera) -> Bool[np.ndarray, 'h w']:
    """Return the pixels that published points of one person come from."""
    xyz = np.column_stack([points[name] for name in 'xyz']).astype(np.float64)
    u, v = np.rint(camera.project(xyz)).astype(int).T
    mask = np.zeros((camera.height, camera.width), dtype=bool)
    mask[np.clip(v, 0, camera.height - 1), np.clip(u, 0, camera.width - 1)] = True
    return mask


def _add(
    frame: RecordedFrame, topic: str, content: Any, corners: Float[np.ndarray, 'n 3'] | None
) -> None:
    if topic == CLOUD:
        frame.cloud = np.frombuffer(bytes(content.data), CLOUD_TYPE)
    elif topic == JOINTS:
        places = [(p.position.x, p.position.y, p.position.z) for p in content.poses]
        frame.joints = np.array(places, dtype=np.float64).reshape(-1, N_JOINTS, 3)
    elif content.action == ADD and corners is not None:
        frame.triangles.append(corners)
        frame.ids.append(int(content.id))
