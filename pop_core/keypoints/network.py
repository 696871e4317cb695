"""What an ONNX network takes and gives, and the protocols of decoders that understand it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Shaped, UInt8

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.detection import Detection

Tensor = Shaped[np.ndarray, '...']
# One pass of the network: the outputs of one input, in the network's order.
Run = Callable[[Tensor], Sequence[Tensor]]


@dataclass(frozen=True, slots=True)
class TensorSpec:
    """Name, shape and element type of one input or output; unknown sizes are None."""

    name: str
    shape: tuple[int | None, ...]
    dtype: str

    def __str__(self) -> str:
        """Return such as `heatmaps (1, 31, 41, 17) uint8`."""
        shape = ', '.join('?' if size is None else str(size) for size in self.shape)
        return f'{self.name} ({shape}) {self.dtype}'


def check_grid(name: str, maps: Sequence[Tensor]) -> None:
    """Check that maps (..., y, x) lie on one grid of two by two cells at least.

    Args:
        name: Whose maps they are.
        maps: Outputs, rows and columns last.

    Raises:
        NetworkShapeError: If they do not.
    """
    grids = {array.shape[-2:] for array in maps}
    if len(grids) > 1 or min(min(grid) for grid in grids) < 2:
        raise NetworkShapeError(
            f'{name}: expected maps of one grid of at least 2 x 2 cells, found {sorted(grids)}')


@dataclass(frozen=True, slots=True)
class NetworkSpec:
    """Inputs and outputs of a network."""

    inputs: tuple[TensorSpec, ...]
    outputs: tuple[TensorSpec, ...]

    def __str__(self) -> str:
        """Return inputs -> outputs."""
        sides = (', '.join(map(str, side)) for side in (self.inputs, self.outputs))
        return ' -> '.join(sides)


@runtime_checkable
class NetworkDecoder(Protocol):
    """Understands one family of networks: prepares its input, reads its outputs."""

    name: ClassVar[str]
    expects: ClassVar[str]

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep what is needed of a spec that fits."""
        ...

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether this family's inputs and outputs look like that."""
        ...


@runtime_checkable
class PeopleDecoder(NetworkDecoder, Protocol):
    """Finds people in a whole image."""

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the people of an image; `run` computes the outputs of one input, in order."""
        ...


@runtime_checkable
class TopDownDecoder(NetworkDecoder, Protocol):
    """Finds the joints of the one person inside a box that somebody else found."""

    def detect_in(
        self, rgb: UInt8[np.ndarray, 'h w 3'], boxes: Sequence[PersonBox], run: Run
    ) -> list[Detection]:
        """Return one person for every box in which one is seen."""
        ...


@runtime_checkable
class OnePersonDecoder(PeopleDecoder, TopDownDecoder, Protocol):
    """Finds the one person of a whole image as well as that of a box."""


@runtime_checkable
class BoxDecoder(NetworkDecoder, Protocol):
    """Finds where people are, without their joints."""

    def find_boxes(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[PersonBox]:
        """Return a box around every person, best first."""
        ...
