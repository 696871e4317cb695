"""Meshes of people as Markers: one per person, removed when the person leaves."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel
from pop_ros.cdr import MarkerTemplate
from pop_ros.node_config import MeshConfig
from pop_ros.to_messages import delete_marker, mesh_marker, triangle_points

MAX_TEMPLATES = 64  # ids never return; templates of people who left are of no use


class MeshMarkers:
    """Writes meshes of one body model from templates, which live as long as the settings."""

    def __init__(self, model: BodyModel, config: MeshConfig) -> None:
        """Prepare markers of a body model's meshes."""
        self._model, self._config = model, config
        self._templates: dict[tuple[int, str], MarkerTemplate] = {}

    def configure(self, config: MeshConfig) -> None:
        """Take over changed settings."""
        self._config = config
        self._templates.clear()

    def build(
        self, meshes: Mapping[int, Float[np.ndarray, 'v 3']], gone: Collection[int],
        stamp_ns: int, frame_id: str,
    ) -> list[Any]:
        """Return removals of people who are gone, then one marker, or its bytes, per mesh.

        Args:
            meshes: Vertices [m] by person.
            gone: People whose markers are to be removed.
            stamp_ns: Stamp of the image [ns].
            frame_id: Frame of the vertices.
        """
        messages: list[Any] = [
            delete_marker(number, stamp_ns, frame_id) for number in sorted(gone)]
        if self._config.detail == 'off':
            return messages
        for number, vertices in meshes.items():
            template = self._template(number, frame_id)
            messages.append(template.message(stamp_ns, self.triangles(vertices)))
        return messages

    def triangles(self, vertices: Float[np.ndarray, 'v 3']) -> Float[np.ndarray, 'n 3']:
        """Return three corner points [m] per triangle, of the mesh or of its reduced form."""
        if self._config.detail == 'reduced':
            return triangle_points(vertices[self._model.fit_vertices], self._model.fit_faces)
        return triangle_points(vertices, self._model.f)

    def _template(self, person_id: int, frame_id: str) -> MarkerTemplate:
        key = (person_id, frame_id)
        if key not in self._templates:
            if len(self._templates) >= MAX_TEMPLATES:
                self._templates.clear()
            marker = mesh_marker(person_id, frame_id, self._config.lifetime_s)
            self._templates[key] = MarkerTemplate(marker)
        return self._templates[key]
