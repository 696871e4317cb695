"""The embedded detector: people from the depth image alone, also in the dark.

Colours are never looked at. A small network says of every 4x4 pixels of a canonical view which
body part they show and where the joints of that person are; cells that agree are one person.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, Int8

from pop_core.errors import NetworkShapeError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.body_parts import BACKGROUND, N_CLASSES
from pop_core.keypoints.canonical_depth import (
    STRIDE,
    CanonicalView,
    canonical_depth,
    canonical_view,
)
from pop_core.keypoints.depth_masks import label_pixels
from pop_core.keypoints.depth_votes import (
    Cells,
    DepthNetConfig,
    VotedPerson,
    fuse_votes,
    group_cells,
    read_votes,
)
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.network import Tensor
from pop_core.keypoints.onnx_session import OnnxSession, load_network
from pop_core.rgbd import RgbdFrame

EMBEDDED = Path(__file__).parents[1] / 'data' / 'depth_net.onnx'
KIND, FORMAT = 'pop_depth_net', '1'
OUTPUTS = (('parts', N_CLASSES), ('votes', 45), ('log_sigma', 15), ('visible', 15))
EXPECTED = ('a depth network of this package: depth_m (1, 1, ?, ?) float32 -> '
            + ', '.join(f'{name} (1, {channels}, ?, ?)' for name, channels in OUTPUTS))
FEWEST_CELLS = 4
SUREST = 8  # joints; those that are hidden or out of the image make nobody less real
FOCAL_PX = (40.0, 1000.0)  # no network of this kind looks finer or coarser


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
        self._view: tuple[tuple[object, ...], CanonicalView] | None = None

    @property
    def reason(self) -> str:
        """Return what the network is."""
        return (f'{self._session.where}: people from depth alone '
                f'({self._session.facts.get("about", "nothing said about its training")})')

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, best first."""
        view = self.view(frame.camera)
        depth_m = canonical_depth(frame.depth_m, view)
        return decode(self.run(depth_m), depth_m, view, frame, self.config)

    def run(self, depth_m: Float32[np.ndarray, 'h w']) -> Sequence[Tensor]:
        """Return parts, votes, log sigma and visibility of a canonical depth image [m]."""
        return [output[0] for output in self._session.run(depth_m[None, None])]

    def view(self, camera: Camera) -> CanonicalView:
        """Return the network's view of a camera; kept while the camera stays the same."""
        key = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
               camera.distortion_model, camera.d.tobytes())
        if self._view is None or self._view[0] != key:
            self._view = (key, canonical_view(camera, self.focal_px))
        return self._view[1]


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


def decode(
    outputs: Sequence[Tensor], depth_m: Float32[np.ndarray, 'H W'], view: CanonicalView,
    frame: RgbdFrame, config: DepthNetConfig,
) -> list[Detection]:
    """Return the people that a network's outputs tell of, best first.

    Args:
        outputs: Parts, votes, log sigma and visibility.
        depth_m: The network's input [m].
        view: The camera of that input.
        frame: What was measured.
        config: Settings.
    """
    parts, votes, log_sigma, visible = outputs
    rows, columns = parts.shape[1:]
    nearest = cell_depth(depth_m)
    probability = 1.0 - _softmax(parts)[BACKGROUND]
    shown = (probability > config.min_person_probability) & np.isfinite(nearest)
    row, column = np.nonzero(shown)
    if len(row) < FEWEST_CELLS:
        return []
    z = nearest[row, column].astype(np.float64)
    cells = Cells(
        row, column, z, (z * STRIDE / view.camera.fx) ** 2,
        probability[row, column].astype(np.float64),
        read_votes(votes, row, column, z, view.camera),
        np.exp(log_sigma[:, row, column].T.astype(np.float64)),
        1.0 / (1.0 + np.exp(-visible[:, row, column].T.astype(np.float64))))
    member = group_cells(cells, config)
    people = [fuse_votes(cells.chosen(member == k)) for k in range(member.max() + 1)]
    owner = np.full((rows, columns), -1, dtype=np.int64)
    owner[row, column] = member
    part = 1 + parts[1:].argmax(axis=0)
    pixels = label_pixels(frame.depth_m, view, owner, part, nearest)
    found = [_detection(person, k, pixels, frame.camera) for k, person in enumerate(people)
             if person_score(person) >= config.min_person_score]
    return sorted((d for d in found if d is not None), key=lambda d: -d.score)


def cell_depth(depth_m: Float32[np.ndarray, 'h w']) -> Float32[np.ndarray, 'h4 w4']:
    """Return the nearest depth of each cell [m], +inf where nothing was measured."""
    h, w = depth_m.shape
    filled = np.where(depth_m > 0, depth_m, np.float32(np.inf))
    return filled.reshape(h // STRIDE, STRIDE, w // STRIDE, STRIDE).min(axis=(1, 3))


def person_score(person: VotedPerson) -> float:
    """Return a score 0..1: that there is a person, and that the surer half of joints is right."""
    return person.existence * float(np.sort(person.certainty)[-SUREST:].mean())


def _detection(
    person: VotedPerson, index: int,
    pixels: tuple[Int8[np.ndarray, 'h w'], Int8[np.ndarray, 'h w']], camera: Camera,
) -> Detection | None:
    """Return a person in pixels; None when none of its joints or pixels lie in the image."""
    owner, labels = pixels
    mask = owner == index
    uv = camera.project(person.joints)
    inside = (np.nan_to_num(uv, nan=-1.0) >= 0).all(axis=1) & (
        np.nan_to_num(uv, nan=-1.0) <= [camera.width - 1, camera.height - 1]).all(axis=1)
    left, top, width, height = cv2.boundingRect(mask.view(np.uint8))
    if width == 0 or not inside.any():
        return None
    return Detection(
        keypoints_px=np.where(inside[:, None], uv, np.nan),
        scores=np.where(inside, person.certainty * person.existence, 0.0),
        box_px=np.array([left, top, left + width - 1, top + height - 1], dtype=np.float64),
        joint_depth_m=np.where(inside, person.joints[:, 2], np.nan),
        joint_sigma_m=np.where(inside, np.sqrt(2.0) * person.sigma_m, np.nan),
        visible=person.visible, person_mask=mask,
        part_labels=np.where(mask, labels, np.int8(-1)))


def _softmax(logits: Tensor) -> Tensor:
    shifted = np.exp(logits - logits.max(axis=0, keepdims=True))
    return np.asarray(shifted / shifted.sum(axis=0, keepdims=True))


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
