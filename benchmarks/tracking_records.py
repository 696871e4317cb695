"""Truth and results of a sequence as tables: one row per person and frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.estimate import JointState
from pop_core.synthesis.sequence import SequenceFrame

FEWEST_VISIBLE = 5  # shared points without which nobody is blamed for not finding a person


@dataclass(frozen=True, slots=True, eq=False)
class TruthTable:
    """Who was where.

    Args:
        frame: Number of the frame.
        id: Person.
        joints: Joints, camera frame [m].
        state: A JointState per joint.
        unseen_s: Time since the camera last saw each joint; 0 while it does, +inf before.
        required: Whether enough is seen of the person that they must be found.
        n_frames: Frames of the sequence.
        rate_hz: Frames per second.
    """

    frame: Int[np.ndarray, 'n']
    id: Int[np.ndarray, 'n']
    joints: Float[np.ndarray, 'n 24 3']
    state: Int[np.ndarray, 'n 24']
    unseen_s: Float[np.ndarray, 'n 24']
    required: Bool[np.ndarray, 'n']
    n_frames: int
    rate_hz: float


@dataclass(frozen=True, slots=True, eq=False)
class TrackTable:
    """Whom a method put where.

    Args:
        frame: Number of the frame.
        id: Number that the method gave the person.
        joints: Joints, camera frame [m].
        covariance: Their stated covariance [m^2].
        wall_ms: Wall time of each frame.
        cpu_ms: Processor time of each frame, all threads.
    """

    frame: Int[np.ndarray, 'n']
    id: Int[np.ndarray, 'n']
    joints: Float[np.ndarray, 'n 24 3']
    covariance: Float[np.ndarray, 'n 24 3 3']
    wall_ms: Float[np.ndarray, 'f']
    cpu_ms: Float[np.ndarray, 'f']


class TruthRecorder:
    """Collects the truth of a sequence frame by frame."""

    def __init__(self, rate_hz: float) -> None:
        """Start an empty table."""
        self._rate_hz = rate_hz
        self._seen: dict[int, Float[np.ndarray, '24']] = {}
        self._rows: list[tuple[int, int, np.ndarray, np.ndarray, np.ndarray, bool]] = []
        self._n_frames = 0

    def add(self, frame: SequenceFrame) -> None:
        """Take the truth of the next frame."""
        for number, person in enumerate(frame.scene.people):
            seen = self._seen.setdefault(number, np.full(24, -np.inf))
            seen[person.joint_state == JointState.VISIBLE] = frame.seconds
            enough = (person.shared_state == JointState.VISIBLE).sum() >= FEWEST_VISIBLE
            self._rows.append((
                self._n_frames, number, person.joints, person.joint_state, frame.seconds - seen,
                bool(enough)))
        self._n_frames += 1

    def table(self) -> TruthTable:
        """Return what was collected."""
        frame, number, joints, state, unseen_s, required = zip(*self._rows, strict=True)
        return TruthTable(
            np.array(frame), np.array(number), np.array(joints), np.array(state),
            np.array(unseen_s), np.array(required), self._n_frames, self._rate_hz)


def track_table(
    rows: Iterable[tuple[int, int, np.ndarray, np.ndarray]], wall_ms: list[float],
    cpu_ms: list[float],
) -> TrackTable:
    """Return rows of (frame, id, joints, covariance) as a table."""
    listed = list(rows)
    frame, number = (np.array([row[k] for row in listed], dtype=np.int64) for k in (0, 1))
    return TrackTable(
        frame, number,
        np.array([row[2] for row in listed]).reshape(-1, 24, 3),
        np.array([row[3] for row in listed]).reshape(-1, 24, 3, 3),
        np.array(wall_ms), np.array(cpu_ms))


def save_tables(path: Path, truth: TruthTable, tracks: dict[str, TrackTable]) -> None:
    """Write a sequence's truth and the results of every method into one file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays = {f'truth/{f.name}': getattr(truth, f.name) for f in fields(truth)}
    for name, table in tracks.items():
        arrays |= {f'{name}/{f.name}': getattr(table, f.name) for f in fields(table)}
    temporary = path.with_suffix('.tmp.npz')
    np.savez_compressed(temporary, **arrays)
    temporary.replace(path)  # an interrupted run leaves no half a file


def load_tables(path: Path, names: Iterable[str]) -> tuple[TruthTable, dict[str, TrackTable]]:
    """Read what `save_tables` wrote."""
    with np.load(path) as file:
        truth = {f.name: file[f'truth/{f.name}'] for f in fields(TruthTable)}
        tracks = {
            name: TrackTable(**{f.name: file[f'{name}/{f.name}'] for f in fields(TrackTable)})
            for name in names}
    truth['n_frames'], truth['rate_hz'] = int(truth['n_frames']), float(truth['rate_hz'])
    return TruthTable(**truth), tracks
