"""The answers of `pop library query`: a table, and a picture when asked for."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from pop_core.body.default_body import default_body
from pop_core.body.joints import N_SHARED, SHARED_INDEX
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.contact_sheet import contact_sheet
from pop_core.retrieval.pose_library import PoseLibrary
from pop_core.retrieval.retrieve import RetrievalConfig, retrieve

SIGMA_M = 0.02
DISTANCE_M = 3.0
FACING_CAMERA = np.array([np.pi, 0.0, 0.0])


def lifted_from_pose(library: PoseLibrary, row: int, hidden: Sequence[str]) -> LiftedJoints:
    """Return the joints of a library pose as a camera three metres away would lift them.

    Raises:
        LibraryFileError: If the library has no such row.
    """
    if row >= len(library):
        raise LibraryFileError(f'--pose: expected 0 to {len(library) - 1}, found {row}')
    upright = np.asarray(library.joints[row], dtype=np.float64)
    return lifted_from(upright @ from_rotvec(FACING_CAMERA).T + [0, 0, DISTANCE_M], hidden)


def lifted_from_file(path: Path, hidden: Sequence[str]) -> LiftedJoints:
    """Return the joints of a JSON file.

    Raises:
        LibraryFileError: If it does not hold 15 rows of three numbers or null.
    """
    try:
        rows = json.loads(path.read_text(encoding='utf-8'))
        points = np.array(
            [[np.nan] * 3 if row is None else [float(x) for x in row] for row in rows])
    except (OSError, ValueError, TypeError) as error:
        raise LibraryFileError(f'{path}: expected 15 rows of numbers, found {error}') from error
    if points.shape != (N_SHARED, 3):
        raise LibraryFileError(f'{path}: expected 15 rows [x, y, z], found {points.shape}')
    return lifted_from(points, hidden)


def lifted_from(points: np.ndarray, hidden: Sequence[str]) -> LiftedJoints:
    """Return points as lifted joints, some hidden by name.

    Raises:
        LibraryFileError: If a name is none of the 15 shared joints.
    """
    unknown = [name for name in hidden if name not in SHARED_INDEX]
    if unknown:
        raise LibraryFileError(f'--hide: expected names of {list(SHARED_INDEX)}, found {unknown}')
    points = points.astype(np.float64)
    points[[SHARED_INDEX[name] for name in hidden]] = np.nan
    seen = np.isfinite(points).all(axis=1)
    return LiftedJoints(
        points, np.where(seen, SIGMA_M, np.inf),
        np.where(seen, int(LiftState.VISIBLE), int(LiftState.MISSING)),
        np.full((N_SHARED, 2), np.nan), seen.astype(np.float64))


def answer(
    library: PoseLibrary, lifted: LiftedJoints, config: RetrievalConfig, out: Path | None
) -> None:
    """Print the answers and write their picture."""
    retrieve(library, lifted, config)  # the first call compiles
    start = time.perf_counter()
    found = retrieve(library, lifted, config)
    took_ms = 1e3 * (time.perf_counter() - start)
    if not found:
        raise LibraryFileError(
            f'expected at least three joints with a position, found {int(lifted.lifted.sum())}')
    console = Console()
    console.print(_table(found))
    console.print(f'{len(library):,} poses searched in {took_ms:.1f} ms')
    if out is not None:
        _draw(library, found, out)
        console.print(f'{out}: the answers in order')


def _table(found: Sequence[PoseCandidate]) -> Table:
    table = Table('row', 'residual [mm]', 'scale', 'belief')
    for candidate in found:
        table.add_row(
            str(candidate.index), f'{1e3 * candidate.residual_m:.1f}', f'{candidate.scale:.3f}',
            f'{candidate.weight:.2f}')
    return table


def _draw(library: PoseLibrary, found: Sequence[PoseCandidate], out: Path) -> None:
    import cv2

    picture = contact_sheet(
        library, [c.index for c in found], default_body(), columns=min(len(found), 8),
        tile_px=240)
    if not cv2.imwrite(str(out), picture[:, :, ::-1]):
        raise LibraryFileError(f'{out}: expected a PNG file in a folder that exists')
