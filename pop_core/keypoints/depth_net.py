"""The embedded detector: people from the depth image alone, also in the dark.

Colours are never looked at. A small network says of every 4x4 pixels of a view which body part
they show and where the joints of that person are; cells that agree are one person. The first view
shows the whole image and finds who is where, then each of them is looked at from near.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Float32

from pop_core.errors import NetworkShapeError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.body_parts import N_CLASSES
from pop_core.keypoints.canonical_depth import (
    LARGEST_SIDE,
    CanonicalView,
    canonical_depth,
    canonical_view,
)
from pop_core.keypoints.close_view import FINEST, NetworkView, close_depth, close_view
from pop_core.keypoints.depth_grouping import group_cells, nearest_trunk
from pop_core.keypoints.depth_masks import PixelLabels, label_pixels, no_labels
from pop_core.keypoints.depth_votes import Cells, DepthNetConfig, read_cells
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.joint_surface import joints_with_skin
from pop_core.keypoints.network import Tensor
from pop_core.keypoints.onnx_session import OnnxSession, load_network
from pop_core.keypoints.vote_fusion import VotedPerson, fuse_votes
from pop_core.rgbd import RgbdFrame

EMBEDDED = Path(__file__).parents[1] / 'data' / 'depth_net.onnx'
KIND, FORMAT = 'pop_depth_net', '1'
OUTPUTS = (('parts', N_CLASSES), ('votes', 45), ('log_sigma', 15), ('visible', 15))
EXPECTED = ('a depth network of this package: depth_m (1, 1, ?, ?) float32 -> '
            + ', '.join(f'{name} (1, {channels}, ?, ?)' for name, channels in OUTPUTS))
FEWEST_CELLS = 4
FARTHEST_M = 30.0  # no depth camera sees people there: the image is not in metres
MOST_LOOKS = 32  # an image of nothing but noise must not take seconds
BOX_SCORE = 0.3  # of joints whose pixels a person's box holds: thin limbs may lack in the mask
FOCAL_PX = (40.0, 1000.0)  # no network of this kind looks finer or coarser


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What is computed once per camera: the view of the whole image, and a fine one."""

    camera: Camera
    whole: CanonicalView
    fine: CanonicalView


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One person, the cells that show them, the view that these are of, and a score 0..1."""

    person: VotedPerson
    cells: Cells
    view: NetworkView
    score: float

    @property
    def trunk(self) -> Float[np.ndarray, '3']:
        """Return the middle of the person's trunk [m]."""
        return self.person.trunk


class DepthNetDetector:
    """People found by the depth network, in every camera's depth."""

    def __init__(self, session: OnnxSession, config: DepthNetConfig | None = None) -> None:
        """Take a loaded network.

        Args:
            session: A network written by `python -m pop_core.training export`.
            config: Settings of the decoding.

        Raises:
            NetworkShapeError: If it is no network of this kind.
        """
        self.config = config or DepthNetConfig()
        self.focal_px = _focal(session)
        self._session = session
        self._views: Views | None = None

    @property
    def reason(self) -> str:
        """Return what the network is."""
        return (f'{self._session.where}: people from depth alone '
                f'({self._session.facts.get("about", "nothing said about its training")})')

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, best first."""
        first = self.first_look(frame)
        closer = [self.closer(frame, first, k) for k in range(len(first))]
        people = distinct([look for look in closer if look is not None], self.config)
        labels = no_labels(frame.depth_m.shape)
        rays = self.views(frame.camera).whole.rays
        for index, look in enumerate(people):
            label_pixels(labels, index, look.cells, look.view, frame, rays)
        found = [_detection(look.person, k, labels, frame) for k, look in enumerate(people)]
        return sorted((d for d in found if d is not None), key=lambda d: -d.score)

    def first_look(self, frame: RgbdFrame) -> list[Look]:
        """Return everybody who may be in a frame, the largest first."""
        canonical = self.views(frame.camera).whole
        depth_m, view = canonical_depth(frame.depth_m, canonical), NetworkView(canonical.camera)
        cells = self.cells(depth_m, view)
        if len(cells) < FEWEST_CELLS:
            return []
        member = group_cells(cells, self.config)
        groups = [cells.chosen(member == k) for k in range(member.max() + 1)]
        people = [fuse_votes(group) for group in groups]
        looks = [Look(person, group, view, person.score)
                 for person, group in zip(people, groups, strict=True)
                 if np.isfinite(person.joints).all() and person.surface_m < FARTHEST_M]
        return [look for look in looks
                if look.score >= self.config.min_candidate_score][:MOST_LOOKS]

    def closer(self, frame: RgbdFrame, looks: Sequence[Look], index: int) -> Look | None:
        """Return what a near view says of one of the people; None when it shows nobody there.

        Args:
            frame: What was measured.
            looks: Everybody who may be there: what is nearer to others is theirs.
            index: The one to look at.
        """
        person, fine = looks[index].person, self.views(frame.camera).fine
        view = close_view(self.focal_px, person.joints, person.surface_m, fine)
        cells = self.cells(close_depth(frame.depth_m, fine, view), view)
        trunks = np.array([look.trunk for look in looks])
        own = cells.chosen(nearest_trunk(cells, trunks, self.config.reach_m) == index)
        if len(own) < FEWEST_CELLS:
            return None
        closer = fuse_votes(own)
        if not np.isfinite(closer.joints).all():
            return None
        # What deceives one look seldom deceives both.
        return Look(closer, own, view, math.sqrt(closer.score * looks[index].score))

    def cells(self, shown_m: Float32[np.ndarray, 'h w'], view: NetworkView) -> Cells:
        """Return what the network says of what it is shown [m]."""
        return read_cells(self.run(shown_m), shown_m, view, self.config.min_person_probability)

    def run(self, depth_m: Float32[np.ndarray, 'h w']) -> Sequence[Tensor]:
        """Return parts, votes, log sigma and visibility of a depth image [m]."""
        return [output[0] for output in self._session.run(depth_m[None, None])]

    def views(self, camera: Camera) -> Views:
        """Return the views of a camera; kept while the camera stays the same."""
        if self._views is None or not self._views.camera.sees_like(camera):
            self._views = Views(camera, canonical_view(camera, self.focal_px),
                                canonical_view(
                                    camera, FINEST * self.focal_px, FINEST * LARGEST_SIDE))
        return self._views


def load_depth_net(
    path: Path = EMBEDDED, config: DepthNetConfig | None = None
) -> DepthNetDetector:
    """Return the detector of a file, the embedded one by default.

    Raises:
        NetworkShapeError: If there is no such file or it is no network of this kind.
    """
    return DepthNetDetector(load_network(path), config)


def is_depth_net(session: OnnxSession) -> bool:
    """Return whether a network says that it is one of this kind."""
    return KIND in session.facts


def distinct(looks: Sequence[Look], config: DepthNetConfig) -> list[Look]:
    """Return those who are surely people, each once, best first: of one trunk the best look."""
    kept: list[Look] = []
    for look in sorted(looks, key=lambda look: -look.score):
        apart = all(np.linalg.norm(look.trunk - other.trunk) >= config.trunk_gap_m
                    for other in kept)
        if apart and look.score >= config.min_person_score:
            kept.append(look)
    return kept


def _detection(
    person: VotedPerson, index: int, labels: PixelLabels, frame: RgbdFrame
) -> Detection | None:
    """Return a person in pixels; None when none of its joints or pixels lie in the image."""
    camera, mask = frame.camera, labels.person == index
    joints = joints_with_skin(person, index, labels, frame)
    uv = camera.project(joints)
    inside = (np.nan_to_num(uv, nan=-1.0) >= 0).all(axis=1) & (
        np.nan_to_num(uv, nan=-1.0) <= [camera.width - 1, camera.height - 1]).all(axis=1)
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    if width == 0 or not inside.any():
        return None
    scores = np.where(inside, person.certainty * person.existence, 0.0)
    seen = uv[(scores > BOX_SCORE) & (person.visible > 0.5)]
    corners = np.vstack([[left, top], [left + width - 1, top + height - 1], seen])
    return Detection(
        keypoints_px=np.where(inside[:, None], uv, np.nan),
        scores=scores,
        box_px=np.concatenate([corners.min(axis=0), corners.max(axis=0)]),
        joint_depth_m=np.where(inside, joints[:, 2], np.nan),
        joint_sigma_m=np.where(inside, np.sqrt(2.0) * person.sigma_m, np.nan),
        visible=person.visible, person_mask=mask,
        part_labels=np.where(mask, labels.part, np.int8(-1)))


def _focal(session: OnnxSession) -> float:
    """Return the focal length that a network of this kind was trained for [px].

    Raises:
        NetworkShapeError: If it is of another kind or format.
    """
    found = session.facts.get(KIND, 'none')
    outputs = tuple((o.name, o.shape[1] if len(o.shape) == 4 else None)
                    for o in session.spec.outputs)
    if found != FORMAT or outputs != OUTPUTS or len(session.spec.inputs) != 1:
        raise NetworkShapeError(
            f'{session.where}: expected {EXPECTED}, format {FORMAT}; found {session.spec}, '
            f'format {found}')
    try:
        focal_px = float(session.facts.get('focal_px', 'nan'))
    except ValueError:
        focal_px = float('nan')
    if not FOCAL_PX[0] <= focal_px <= FOCAL_PX[1]:
        raise NetworkShapeError(
            f'{session.where}: expected a focal length of {FOCAL_PX[0]} to {FOCAL_PX[1]} px, '
            f'found {session.facts.get("focal_px")!r}')
    return focal_px
