"""The embedded detector: people from the depth image alone, also in the dark.

Colours are never looked at. A small network says of every 4x4 pixels of a view which body part
they show and where the joints of that person are; cells that agree are one person. The first view
shows the whole image and finds who is where, then each of them is looked at from near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, Float32

from pop_core.errors import NetworkShapeError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth import (
    LARGEST_SIDE,
    CanonicalView,
    canonical_depth,
    canonical_view,
)
from pop_core.keypoints.close_view import FINEST, NetworkView, close_depth, close_view
from pop_core.keypoints.depth_grouping import group_cells, nearest_trunk
from pop_core.keypoints.depth_masks import PixelLabels, label_pixels, no_labels
from pop_core.keypoints.depth_network import EMBEDDED, DepthNetwork, close_path
from pop_core.keypoints.depth_votes import Cells, DepthNetConfig
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.joint_surface import joints_with_skin
from pop_core.keypoints.onnx_session import OnnxSession, load_network
from pop_core.keypoints.upright import detect_upright
from pop_core.keypoints.vote_fusion import VotedPerson, fuse_votes
from pop_core.rgbd import RgbdFrame

FEWEST_CELLS = 4
FARTHEST_M = 30.0  # no depth camera sees people there: the image is not in metres
MOST_LOOKS = 32  # an image of nothing but noise must not take seconds
NEAR_SHARE = 0.9  # of the near look in the logarithm of a person's score
BOX_SCORE = 0.3  # of joints whose pixels a person's box holds: thin limbs may lack in the mask


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """What is computed once per camera.

    Args:
        camera: The camera.
        whole: View of the whole image.
        fine: A finer one, to read near looks from.
        rays: (x/z, y/z) of each measured pixel.
    """

    camera: Camera
    whole: CanonicalView
    fine: CanonicalView
    rays: Float32[np.ndarray, 'h w 2']


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

    def __init__(
        self, network: DepthNetwork, config: DepthNetConfig | None = None,
        close: DepthNetwork | None = None,
    ) -> None:
        """Take loaded networks.

        Args:
            network: Finds people in whole images.
            config: Settings of the decoding.
            close: Looks at each of them from near; without, the first one does.

        Raises:
            NetworkShapeError: If one was trained for the other's look.
        """
        if network.is_close:
            raise _other_look(network, 'whole images')
        if close is not None and not close.is_close:
            raise _other_look(close, 'near looks')
        self.config = config or DepthNetConfig()
        self._network, self._close = network, close or network
        self._views: Views | None = None

    @property
    def reason(self) -> str:
        """Return what the networks are."""
        each = dict.fromkeys((self._network, self._close))
        return 'people from depth alone: ' + ', '.join(
            f'{network.session.where} ({network.about})' for network in each)

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, best first."""
        return detect_upright(self._detect, frame)

    def _detect(self, frame: RgbdFrame) -> list[Detection]:
        first = self.first_look(frame)
        closer = [self.closer(frame, first, k) for k in range(len(first))]
        people = distinct([look for look in closer if look is not None], self.config)
        labels = no_labels(frame.depth_m.shape)
        rays = self.views(frame.camera).rays
        for index, look in enumerate(people):
            label_pixels(labels, index, look.cells, look.view, frame, rays)
        found = [_detection(look.person, k, labels, frame) for k, look in enumerate(people)]
        return sorted((d for d in found if d is not None), key=lambda d: -d.score)

    def first_look(self, frame: RgbdFrame) -> list[Look]:
        """Return everybody who may be in a frame, the largest first."""
        canonical = self.views(frame.camera).whole
        depth_m, view = canonical_depth(frame.depth_m, canonical), NetworkView(canonical.camera)
        cells = self._network.cells(depth_m, view, self.config.min_person_probability)
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
        network = self._close
        view = close_view(
            network.focal_px, network.enlarged(person.surface_m), person.joints, person.surface_m,
            fine, network.before_m(person.surface_m))
        cells = network.cells(
            close_depth(frame.depth_m, fine, view), view, self.config.min_person_probability)
        trunks = np.array([look.trunk for look in looks])
        own = cells.chosen(nearest_trunk(cells, trunks, self.config.reach_m) == index)
        if len(own) < FEWEST_CELLS:
            return None
        closer = fuse_votes(own.joined(looks[index].cells), shown=own)
        # Near looks know better, but what deceives one look seldom deceives both.
        score = closer.score ** NEAR_SHARE * looks[index].score ** (1.0 - NEAR_SHARE)
        if not np.isfinite([score, *closer.sigma_m, *closer.joints.ravel()]).all():
            return None
        return Look(closer, own, view, score)

    def views(self, camera: Camera) -> Views:
        """Return the views of a camera; kept while the camera stays the same."""
        if self._views is None or not self._views.camera.sees_like(camera):
            fine_px, rays = FINEST * self._close.focal_px, camera.ray_grid()
            self._views = Views(
                camera, canonical_view(camera, rays, self._network.focal_px),
                canonical_view(camera, rays, fine_px, FINEST * LARGEST_SIDE),
                rays.astype(np.float32))
        return self._views


def load_depth_net(path: Path = EMBEDDED) -> DepthNetDetector:
    """Return the detector of a file, the embedded one by default.

    A network of near looks is taken where it lies beside: NET_close.onnx for NET.onnx.

    Raises:
        NetworkShapeError: If there is no such file or it is no network of this kind.
    """
    return depth_net_of(load_network(path), path)


def depth_net_of(session: OnnxSession, path: Path) -> DepthNetDetector:
    """Return the detector of a loaded file, with the network of near looks that lies beside it.

    Raises:
        NetworkShapeError: If one of them is no network of this kind.
    """
    beside = close_path(path)
    close = DepthNetwork(load_network(beside)) if beside.is_file() else None
    return DepthNetDetector(DepthNetwork(session), close=close)


def _other_look(network: DepthNetwork, wanted: str) -> NetworkShapeError:
    return NetworkShapeError(
        f'{network.session.where}: expected a network of {wanted}, found one trained for another '
        'look (docs/training.md)')


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
        part_labels=np.where(mask, labels.part, np.int8(-1)), sees_colour=False)
