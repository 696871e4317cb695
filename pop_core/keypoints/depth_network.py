"""A depth network as a file: what it takes, what it gives, and for which look it was trained."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.body_parts import N_CLASSES
from pop_core.keypoints.canonical_depth import SIDE_MULTIPLE, STRIDE
from pop_core.keypoints.close_view import BEFORE_M, SHOWN_AT_M, NetworkView
from pop_core.keypoints.depth_votes import Cells, read_cells
from pop_core.keypoints.network import Tensor
from pop_core.keypoints.onnx_session import OnnxSession, one_line

EMBEDDED = Path(__file__).parents[1] / 'data' / 'depth_net.onnx'
KIND, FORMAT = 'pop_depth_net', '1'
OUTPUTS = (('parts', N_CLASSES), ('votes', 45), ('log_sigma', 15), ('visible', 15))
EXPECTED = ('a depth network of this package: depth_m (1, 1, ?, ?) float32 -> '
            + ', '.join(f'{name} (1, {channels}, ?, ?)' for name, channels in OUTPUTS))
FOCAL_PX = (40.0, 1000.0)  # no network of this kind looks finer or coarser
SHOWN_M = (1.0, 20.0)  # nearer, what stands before people would be shown behind the camera


class DepthNetwork:
    """A loaded network of this package, whatever it was trained to look at."""

    def __init__(self, session: OnnxSession) -> None:
        """Take a network written by `python -m pop_core.training export`.

        Args:
            session: The loaded file.

        Raises:
            NetworkShapeError: If it is no network of this kind.
        """
        _check_kind(session)
        self.session = session
        self.about = one_line(session.facts.get('about', 'nothing said about its training'))
        self.focal_px = _fact(session, 'focal_px', FOCAL_PX)
        self.is_close = 'shown_at_m' in session.facts
        self._shown_at_m = _fact(session, 'shown_at_m', SHOWN_M) if self.is_close else SHOWN_AT_M
        _check_grid(session, self.run(np.zeros((SIDE_MULTIPLE, SIDE_MULTIPLE), np.float32)))

    def enlarged(self, surface_m: float) -> float:
        """Return how many times as large as it is a surface at a depth [m] should be shown.

        A network of near looks knows people at one size; others have seen near ones as they are.
        """
        scale = surface_m / self._shown_at_m
        return scale if self.is_close else max(scale, 1.0)

    def before_m(self, surface_m: float) -> float:
        """Return how far before a surface at a depth [m] a network is shown what stands there.

        Whoever it is shown as they are stands in a scene as it has learned from whole.
        """
        return BEFORE_M if self.is_close or self.enlarged(surface_m) > 1.0 else np.inf

    def cells(
        self, shown_m: Float32[np.ndarray, 'h w'], view: NetworkView, min_probability: float
    ) -> Cells:
        """Return the cells that show people.

        Args:
            shown_m: What the network is shown [m], 0 where nothing was measured.
            view: What that is.
            min_probability: Least probability of a person.
        """
        return read_cells(self.run(shown_m), shown_m, view, min_probability)

    def run(self, depth_m: Float32[np.ndarray, 'h w']) -> Sequence[Tensor]:
        """Return parts, votes, log sigma and visibility of a depth image [m]."""
        return [output[0] for output in self.session.run(depth_m[None, None])]


def is_depth_net(session: OnnxSession) -> bool:
    """Return whether a network says that it is one of this kind."""
    return KIND in session.facts


def close_path(path: Path) -> Path:
    """Return where the network of near looks lies that belongs to one of whole images."""
    return path.with_name(f'{path.stem}_close{path.suffix}')


def _check_kind(session: OnnxSession) -> None:
    found = session.facts.get(KIND, 'none')
    outputs = tuple((o.name, o.shape[1] if len(o.shape) == 4 else None)
                    for o in session.spec.outputs)
    if found != FORMAT or outputs != OUTPUTS or len(session.spec.inputs) != 1:
        raise NetworkShapeError(
            f'{session.where}: expected {EXPECTED}, format {FORMAT}; found {session.spec}, '
            f'format {found}')


def _check_grid(session: OnnxSession, maps: Sequence[Tensor]) -> None:
    cells = SIDE_MULTIPLE // STRIDE
    found = {maps_of.shape[1:] for maps_of in maps}
    if found != {(cells, cells)}:
        raise NetworkShapeError(
            f'{session.where}: expected a cell for every {STRIDE} pixels, that is {cells}x{cells} '
            f'for an image of {SIDE_MULTIPLE}x{SIDE_MULTIPLE}, found {sorted(found)}')


def _fact(session: OnnxSession, name: str, within: tuple[float, float]) -> float:
    """Return a number that the file tells of itself.

    Raises:
        NetworkShapeError: If it is none, or beyond what makes sense.
    """
    try:
        value = float(session.facts.get(name, 'nan'))
    except ValueError:
        value = float('nan')
    if not within[0] <= value <= within[1]:
        raise NetworkShapeError(
            f'{session.where}: expected {name} of {within[0]} to {within[1]}, '
            f'found {session.facts.get(name)!r}')
    return value
