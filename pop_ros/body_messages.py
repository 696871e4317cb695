"""All messages of one frame's bodies; used by the node and by `pop replay --every-frame`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import PoseArray
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from pop_core.body.model import BodyModel
from pop_core.estimate import BodyEstimate, FrameResult
from pop_core.rendering.overlay import draw_people
from pop_core.rendering.shown_body import shown
from pop_core.rgbd import RgbdFrame, undistort_frame, undistort_mask
from pop_ros import pop_messages, to_messages
from pop_ros.humans import HUMANS, HumansFrame
from pop_ros.image_messages import color_message
from pop_ros.interop import INTEROP_TYPES, interop_message
from pop_ros.interop_person import PersonReader
from pop_ros.node_config import NodeConfig
from pop_ros.people_markers import PeopleMarkers
from pop_ros.person_ids import PersonIds
from pop_ros.tf_messages import tf2_msgs, transforms_message

MESH, JOINTS, CLOUD, BODIES = 'mesh', 'joints', 'cloud', 'bodies'
MESH_ARRAY, OVERLAY, TF = 'mesh_array', 'overlay', 'tf'
# What `pop replay` records; the other outputs are pictures of the same.
RECORDED_TYPES: dict[str, Any] = {MESH: Marker, JOINTS: PoseArray, CLOUD: PointCloud2}
if pop_messages.pop_msgs is not None:
    RECORDED_TYPES[BODIES] = pop_messages.pop_msgs.BodyArray
OUTPUT_TYPES: dict[str, Any] = {**RECORDED_TYPES, MESH_ARRAY: MarkerArray, OVERLAY: Image}
if tf2_msgs is not None:
    OUTPUT_TYPES[TF] = tf2_msgs.TFMessage
OUTPUT_TYPES |= INTEROP_TYPES

# A topic's name without the node's, and a message or its serialised bytes.
Output = tuple[str, Any]


class BodyMessages:
    """Turns results into messages and remembers who was there in the frame before."""

    def __init__(self, model: BodyModel, config: NodeConfig) -> None:
        """Prepare messages of a body model's meshes."""
        self._model, self._config = model, config
        self._ids = PersonIds()
        self._present: set[int] = set()
        self._latest: tuple[RgbdFrame, str] | None = None
        self._markers = PeopleMarkers(model, config.mesh)
        self._reader = PersonReader(model)

    def configure(self, config: NodeConfig) -> None:
        """Take over changed settings; ids stay."""
        self._config = config
        self._markers.configure(config.mesh)

    def reset(self) -> None:
        """Start ids anew; markers of ids that are not given again are removed."""
        self._ids = PersonIds()

    def build(
        self, result: FrameResult, frame: RgbdFrame, frame_id: str,
        wanted: Collection[str] = tuple(RECORDED_TYPES),
    ) -> list[Output]:
        """Return the messages of a frame for the wanted topics.

        A frame without people gives messages only when somebody has just left: removals, and one
        empty set of joints and points. Only the overlay, a picture, comes with every frame.
        """
        return list(self.stream(result, frame, frame_id, wanted))

    def stream(
        self, result: FrameResult, frame: RgbdFrame, frame_id: str, wanted: Collection[str]
    ) -> Iterator[Output]:
        """Yield the messages of `build` as they are made, so that none waits for a slower one."""
        bodies = result.bodies
        ids = self._ids.of(bodies)
        self._latest = frame, frame_id
        self._markers.start_frame(frame.stamp_ns)
        yield from self._people(bodies, ids, wanted)
        if OVERLAY in wanted:
            header = to_messages.make_header(frame.stamp_ns, frame_id)
            yield OVERLAY, self._overlay(result, frame, header)

    def clear(self, wanted: Collection[str] = tuple(RECORDED_TYPES)) -> list[Output]:
        """Return what says that everybody has left, with stamp and frame of the latest image."""
        return [] if self._latest is None else list(self._people((), (), wanted))

    def _people(
        self, bodies: Sequence[BodyEstimate], ids: Sequence[int], wanted: Collection[str]
    ) -> Iterator[Output]:
        assert self._latest is not None
        frame, frame_id = self._latest
        header = to_messages.make_header(frame.stamp_ns, frame_id)
        changed = bool(bodies) or bool(self._present)
        self._present = set(ids)
        makers: dict[str, Callable[[], list[Any]]] = {
            MESH: lambda: self._markers.markers(bodies, ids, header),
            MESH_ARRAY: lambda: self._markers.array(bodies, ids, header),
        }
        if changed:
            makers |= {
                JOINTS: lambda: [to_messages.joints_message(bodies, header)],
                CLOUD: lambda: [to_messages.cloud_message(frame, bodies, ids, header)],
                BODIES: lambda: [pop_messages.bodies_message(bodies, ids, header)],
            }
        if bodies:
            makers[TF] = lambda: [
                transforms_message(bodies, ids, header, self._config.tf.frames)]
        for name, make in makers.items():
            if name in wanted:
                yield from ((name, message) for message in make())
        yield from self._for_others(bodies, ids, wanted, changed=changed)

    def _for_others(
        self, bodies: Sequence[BodyEstimate], ids: Sequence[int], wanted: Collection[str], *,
        changed: bool,
    ) -> list[Output]:
        """Return people in the words of other packages; REP-155 hears of every frame."""
        names = [name for name in INTEROP_TYPES if name in wanted and changed]
        if not names and HUMANS not in wanted:
            return []
        assert self._latest is not None
        frame, frame_id = self._latest
        header = to_messages.make_header(frame.stamp_ns, frame_id)
        people = [self._reader.read(number, body, frame.camera)
                  for number, body in zip(ids, bodies, strict=True)]
        found: list[Output] = [(name, interop_message(name, people, header)) for name in names]
        return found + [(HUMANS, HumansFrame(people, frame, header))] * (HUMANS in wanted)

    def _overlay(self, result: FrameResult, frame: RgbdFrame, header: Header) -> Image:
        # Meshes are drawn as a pinhole sees them.
        seen = undistort_frame(frame)
        people = [replace(shown(body), mask=undistort_mask(body.mask, frame.camera))
                  for body in result.bodies]
        picture = draw_people(seen.rgb, people, self._model.f, seen.camera, seen.depth_m)
        return color_message(picture, header)
