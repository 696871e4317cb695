"""People from heatmaps and part affinity fields (Cao et al. 2017, section 3; 2019).

A field holds, along each limb, the unit vector from its first to its second keypoint. Candidates
of two keypoints belong together as far as the field between them points from one to the other.
Places are columns and rows of the maps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.optimize import linear_sum_assignment

from pop_core.keypoints.personlab_kernels import local_maxima

MIN_PEAK = 0.1
MOST_PEAKS = 60  # of one keypoint, the highest: more people than a frame can hold
SAMPLES = 10
MIN_ALIGNED = 0.05  # dot product with the field
MIN_ALIGNED_SHARE = 0.8


@dataclass(frozen=True, slots=True)
class Limb:
    """A pair of keypoints that a field connects.

    Args:
        first: Keypoint that was grouped before.
        second: The next one; no two limbs end in the same keypoint.
        field: Channel of the field along u; v follows.
    """

    first: int
    second: int
    field: int


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Places where a keypoint may be: columns u, v [cells] and height of the peak."""

    uv: Float[np.ndarray, 'n 2']
    scores: Float[np.ndarray, 'n']


def group_people(
    heat: Float32[np.ndarray, 'k h w'], fields: Float32[np.ndarray, 'c h w'],
    limbs: Sequence[Limb],
) -> list[Float[np.ndarray, 'k 3']]:
    """Return people as u, v [cells], score per keypoint; undetected ones have a score of 0.

    Limbs form trees. A candidate that no limb leads to starts somebody of its own, so that a
    person whose head is out of the image is still found from the hips down.

    Args:
        heat: Score of each keypoint.
        fields: Pairs of maps of the limbs.
        limbs: Each after the one that ends in its first keypoint.
    """
    candidates = [find_peaks(np.nan_to_num(channel).clip(0.0, 1.0)) for channel in heat]
    fields = np.nan_to_num(fields).clip(-1.0, 1.0)  # unit vectors, or less than that
    people: list[Float[np.ndarray, 'k 3']] = []
    owner: dict[tuple[int, int], int] = {}
    for j in _in_order(limbs):
        limb = next((limb for limb in limbs if limb.second == j), None)
        pairs = {} if limb is None else _pairs(candidates, fields, limb)
        for row, score in enumerate(candidates[j].scores):
            person = owner[limb.first, pairs[row]] if limb and row in pairs else len(people)
            if person == len(people):
                people.append(np.zeros((len(heat), 3)))
            people[person][j] = [*candidates[j].uv[row], score]
            owner[j, row] = person
    return people


def find_peaks(heat: Float32[np.ndarray, 'h w']) -> Candidates:
    """Return the highest local maxima of a map, finer than a cell."""
    cells = local_maxima(np.ascontiguousarray(heat[..., None]), MIN_PEAK)[:, :2]
    heights = heat[cells[:, 0], cells[:, 1]]
    best = np.argsort(-heights, kind='stable')[:MOST_PEAKS]
    cells, heights = cells[best], heights[best]
    shift = np.column_stack([_vertex(heat, cells, (0, 1)), _vertex(heat, cells, (1, 0))])
    return Candidates(cells[:, ::-1] + shift, np.minimum(heights, 1.0).astype(np.float64))


def limb_scores(
    a: Candidates, b: Candidates, u_field: Float32[np.ndarray, 'h w'],
    v_field: Float32[np.ndarray, 'h w'],
) -> Float[np.ndarray, 'n m']:
    """Return how far the field points from each of a to each of b; 0 where it does not.

    The line integral of the field along the straight way (Cao et al. 2017, eq. 10), by samples.
    """
    way = b.uv[None] - a.uv[:, None]
    length = np.linalg.norm(way, axis=-1)
    unit = way / np.maximum(length, 1e-6)[..., None]
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
    points = (a.uv[:, None, None] + share * way[:, :, None]).astype(np.float32)
    flat = points.reshape(-1, SAMPLES, 2)
    u, v = (
        cv2.remap(field, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR,
                  borderMode=cv2.BORDER_REPLICATE).reshape(points.shape[:3])
        for field in (u_field, v_field))
    along = u * unit[..., 0, None] + v * unit[..., 1, None]
    aligned = (along > MIN_ALIGNED).mean(axis=-1) >= MIN_ALIGNED_SHARE
    return np.where(aligned & (length > 1e-3), along.mean(axis=-1), 0.0)


def _pairs(
    candidates: Sequence[Candidates], fields: Float32[np.ndarray, 'c h w'], limb: Limb
) -> dict[int, int]:
    """Return which candidate of the limb's first keypoint each of its second one belongs to."""
    a, b = candidates[limb.first], candidates[limb.second]
    if not len(a.scores) or not len(b.scores):
        return {}
    scores = limb_scores(a, b, fields[limb.field], fields[limb.field + 1])
    rows, columns = linear_sum_assignment(-scores)
    return {int(c): int(r) for r, c in zip(rows, columns, strict=True) if scores[r, c] > 0}


def _in_order(limbs: Sequence[Limb]) -> list[int]:
    """Return the keypoints so that each limb's first one comes before its second one."""
    return list(dict.fromkeys(j for limb in limbs for j in (limb.first, limb.second)))


def _vertex(
    heat: Float32[np.ndarray, 'h w'], cells: Int[np.ndarray, 'n 2'], step: tuple[int, int]
) -> Float[np.ndarray, 'n']:
    """Return the vertex of the parabola through the logarithms of three cells [cells].

    It is exact for the Gaussians that such networks are trained to draw.
    """
    h, w = heat.shape
    logs = []
    for way in (-1, 0, 1):
        row = np.clip(cells[:, 0] + way * step[0], 0, h - 1)
        column = np.clip(cells[:, 1] + way * step[1], 0, w - 1)
        logs.append(np.log(np.maximum(heat[row, column], 1e-3).astype(np.float64)))
    bend = logs[0] + logs[2] - 2.0 * logs[1]
    slope = 0.5 * (logs[0] - logs[2])
    return np.clip(np.where(bend < -1e-9, slope / np.minimum(bend, -1e-9), 0.0), -0.5, 0.5)
