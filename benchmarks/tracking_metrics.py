"""Are people found, and do they keep their numbers? CLEAR MOT and IDF1 on pelvis positions.

CLEAR MOT: Bernardin and Stiefelhagen 2008. IDF1: Ristani et al. 2016. People of whom the camera
sees too little to be found are nobody's fault: missing them costs nothing, and a body put where
they are is no false one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import linear_sum_assignment

from benchmarks.tracking_records import TrackTable, TruthTable

GATE_M = 0.5  # a pelvis farther from the true one is somebody else's
SETTLE_S = 0.5  # at the start of a sequence, before steadiness is judged
FORBIDDEN = 1e6


@dataclass(frozen=True, slots=True)
class MotScores:
    """Counts of one sequence; add them up before dividing.

    Args:
        required: People who had to be found, over all frames.
        misses: Of these not found.
        extra: Bodies where nobody is.
        switches: Times that a person's number changed.
        id_matches: Most rows that one number per person explains.
        bodies: Bodies given out, without those of people who need not be found.
        frames: Frames.
    """

    required: int = 0
    misses: int = 0
    extra: int = 0
    switches: int = 0
    id_matches: int = 0
    bodies: int = 0
    frames: int = 0

    def __add__(self, other: MotScores) -> MotScores:
        """Return the counts of both."""
        return MotScores(*(
            getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))

    @property
    def mota(self) -> float:
        """Return 1 - (misses + extra bodies + switches) / required."""
        return 1.0 - (self.misses + self.extra + self.switches) / max(self.required, 1)

    @property
    def idf1(self) -> float:
        """Return the F1 score of rows explained by one number per person."""
        return 2.0 * self.id_matches / max(self.required + self.bodies, 1)

    @property
    def switches_per_1000(self) -> float:
        """Return changes of numbers per 1,000 frames."""
        return 1000.0 * self.switches / max(self.frames, 1)


def correspond(truth: TruthTable, tracks: TrackTable) -> Int[np.ndarray, 'n']:
    """Return the row of `tracks` that is each row of `truth`, -1 where none is.

    A number that was a person's in an earlier frame stays it while it is near enough; the others
    are matched by the least sum of distances.
    """
    rows = np.full(len(truth.id), -1)
    latest: dict[int, int] = {}
    for k in range(truth.n_frames):
        t, h = np.flatnonzero(truth.frame == k), np.flatnonzero(tracks.frame == k)
        distance = np.linalg.norm(
            truth.joints[t, None, 0] - tracks.joints[None, h, 0], axis=2)
        known = np.array([latest.get(int(person), -1) for person in truth.id[t]], dtype=np.int64)
        kept = _one_to_one((known[:, None] == tracks.id[h]) & (distance <= GATE_M))
        free = ~(kept.any(axis=1)[:, None] | kept.any(axis=0)) & (distance <= GATE_M)
        a, b = linear_sum_assignment(np.where(free, distance, FORBIDDEN))
        kept[a[free[a, b]], b[free[a, b]]] = True
        for person, body in np.argwhere(kept):
            rows[t[person]] = h[body]
            latest[int(truth.id[t[person]])] = int(tracks.id[h[body]])
    return rows


def _one_to_one(pairs: Bool[np.ndarray, 'p b']) -> Bool[np.ndarray, 'p b']:
    """Return pairs of which each body belongs to one person, the first that claims it."""
    return pairs & (np.cumsum(pairs, axis=0) == 1)


def mot_scores(
    truth: TruthTable, tracks: TrackTable, rows: Int[np.ndarray, 'n']
) -> MotScores:
    """Return the counts of a sequence, given which row is whose."""
    matched = rows >= 0
    ignored = np.zeros(len(tracks.id), dtype=bool)
    ignored[rows[matched & ~truth.required]] = True
    taken = np.zeros(len(tracks.id), dtype=bool)
    taken[rows[matched]] = True
    switches = 0
    for person in np.unique(truth.id):
        own = matched & truth.required & (truth.id == person)
        numbers = tracks.id[rows[own]]
        switches += int((numbers[1:] != numbers[:-1]).sum())
    return MotScores(
        required=int(truth.required.sum()), misses=int((truth.required & ~matched).sum()),
        extra=int((~taken).sum()), switches=switches,
        id_matches=_id_matches(truth, tracks, ignored), bodies=int((~ignored).sum()),
        frames=truth.n_frames)


def _id_matches(
    truth: TruthTable, tracks: TrackTable, ignored: Bool[np.ndarray, 'm']
) -> int:
    """Return the most rows explained when every person has one number and the reverse."""
    people, numbers = np.unique(truth.id), np.unique(tracks.id)
    overlap = np.zeros((len(people), len(numbers)))
    for i in np.flatnonzero(truth.required):
        for j in np.flatnonzero((tracks.frame == truth.frame[i]) & ~ignored):
            if np.linalg.norm(truth.joints[i, 0] - tracks.joints[j, 0]) <= GATE_M:
                overlap[np.searchsorted(people, truth.id[i]),
                        np.searchsorted(numbers, tracks.id[j])] += 1
    a, b = linear_sum_assignment(-overlap)
    return int(overlap[a, b].sum())


def static_std_m(
    truth: TruthTable, tracks: TrackTable, rows: Int[np.ndarray, 'n']
) -> Float[np.ndarray, '24']:
    """Return how much each joint of somebody who stands still wanders: std of its position [m].

    The root of the summed variance of x, y and z, about its own mean: jitter, not error.
    """
    settled = (rows >= 0) & (truth.frame >= SETTLE_S * truth.rate_hz)
    p = tracks.joints[rows[settled]]
    return np.sqrt(p.var(axis=0).sum(axis=-1)) if len(p) else np.full(24, np.nan)


def acceleration_errors(
    truth: TruthTable, tracks: TrackTable, rows: Int[np.ndarray, 'n']
) -> Float[np.ndarray, 'n']:
    """Return |estimated - true acceleration| [m/s^2] of joints in three frames in a row.

    Second differences, as in Kanazawa et al. 2019.
    """
    out = [np.zeros(0)]
    for person in np.unique(truth.id):
        own = np.flatnonzero((truth.id == person) & (rows >= 0))
        error = tracks.joints[rows[own]] - truth.joints[own]
        frame = truth.frame[own]
        in_a_row = (frame[2:] - frame[:-2]) == 2
        second = (error[2:] - 2 * error[1:-1] + error[:-2]) * truth.rate_hz**2
        out.append(np.linalg.norm(second[in_a_row], axis=2).ravel())
    return np.concatenate(out)
