"""What draws people in rviz: a Marker per mesh, and a MarkerArray of meshes, bones and ids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from pop_core.body.model import BodyModel
from pop_core.estimate import BodyEstimate
from pop_ros.cdr_array import ArrayWriter
from pop_ros.from_messages import stamp_ns
from pop_ros.mesh_markers import MeshMarkers
from pop_ros.node_config import MeshConfig
from pop_ros.rate_limit import RateLimit
from pop_ros.skeleton_markers import skeleton_markers, skeleton_removals
from pop_ros.to_messages import delete_marker, mesh_marker

Meshes = Mapping[int, Float[np.ndarray, 'v 3']]


class PeopleMarkers:
    """Remembers what rviz shows, so that whatever must go is removed."""

    def __init__(self, model: BodyModel, config: MeshConfig) -> None:
        """Prepare markers of a body model's meshes."""
        self._config = config
        self._meshes = MeshMarkers(model, config)
        self._array = ArrayWriter()
        self._limit = RateLimit()
        self._is_due = True
        self._shown: set[int] = set()
        self._shown_in_array: set[int] = set()
        self._skeletons: set[int] = set()

    def configure(self, config: MeshConfig) -> None:
        """Take over changed settings."""
        self._config = config
        self._meshes.configure(config)

    def start_frame(self, stamp_ns: int) -> None:
        """Decide whether the meshes of an image stamped so [ns] are due (`mesh.max_rate_hz`)."""
        self._is_due = self._limit.admit(stamp_ns, self._config.max_rate_hz)

    def markers(
        self, bodies: Sequence[BodyEstimate], ids: Sequence[int], header: Header
    ) -> list[Any]:
        """Return removals of meshes that must go, and the meshes that are due."""
        meshes = self._due(bodies, ids)
        gone = self._gone(self._shown, ids)
        self._shown = (self._shown - gone) | set(meshes)
        return self._meshes.build(meshes, gone, stamp_ns(header), header.frame_id)

    def array(
        self, bodies: Sequence[BodyEstimate], ids: Sequence[int], header: Header
    ) -> list[Any]:
        """Return one array of removals, meshes, bones and ids; none where there is nothing."""
        meshes = self._due(bodies, ids)
        gone = self._gone(self._shown_in_array, ids)
        small = [
            delete_marker(number, stamp_ns(header), header.frame_id) for number in sorted(gone)]
        small += skeleton_removals(self._skeletons - set(ids), header)
        small += skeleton_markers(bodies, ids, header)
        self._shown_in_array = (self._shown_in_array - gone) | set(meshes)
        self._skeletons = set(ids)
        large = [(self._plain(number, header), self._meshes.triangles(vertices))
                 for number, vertices in meshes.items()]
        return [self._array.message(small, large)] if small or large else []

    def _due(self, bodies: Sequence[BodyEstimate], ids: Sequence[int]) -> Meshes:
        if self._config.detail == 'off' or not self._is_due:
            return {}
        return {number: body.vertices for number, body in zip(ids, bodies, strict=True)}

    def _gone(self, shown: set[int], ids: Sequence[int]) -> set[int]:
        return set(shown) if self._config.detail == 'off' else shown - set(ids)

    def _plain(self, number: int, header: Header) -> Marker:
        marker = mesh_marker(number, header.frame_id, self._config.lifetime_s)
        marker.header = header
        return marker
