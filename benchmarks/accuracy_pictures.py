"""Pictures of a run: cumulative curves of Eq. 8 and error heat maps, as Fig. 4 and 5 of the paper.

A heat map shows the measured points of a person, white on the fitted body to black at 3 cm.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from benchmarks import metrics
from benchmarks.accuracy_methods import GivenDetections, Guess, Method
from benchmarks.accuracy_records import CURVE_M, Record, match, observed_points
from pop_core.body.model import BodyModel
from pop_core.body.skinning import vertices
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rendering.text import captioned
from pop_core.synthesis.scenes import SyntheticScene, synthesise_scene
from pop_core.synthesis.truth import PersonTruth

BLACK_M = 0.03
HEAT_SCENES = 6
CURVE_SIZE = (640, 480)


def draw_pictures(
    folder: Path, records: Sequence[Record], model: BodyModel, method: Method,
    detector: GivenDetections,
) -> None:
    """Write curves of all people, and heat maps of the best, median and worst fits."""
    folder.mkdir(parents=True, exist_ok=True)
    found = [record for record in records if 'curve' in record]
    if not found:
        return
    cv2.imwrite(str(folder / 'p2p_curves.png'), curves_picture(found)[..., ::-1])
    ranked = sorted(found, key=lambda record: record['err_pose'])
    chosen = np.linspace(0, len(ranked) - 1, min(HEAT_SCENES, len(ranked))).astype(int)
    seeds = list(dict.fromkeys(int(ranked[k]['seed']) for k in chosen))
    for seed in seeds:
        scene = synthesise_scene(model, seed)
        detector.people = [d for d in scene.detections() if d is not None]
        guesses, _ = method(scene.frame)
        picture = scene_picture(model, scene, guesses)
        cv2.imwrite(str(folder / f'fit_{seed}.png'), picture[..., ::-1])


def curves_picture(records: Sequence[Record]) -> UInt8[np.ndarray, 'h w 3']:
    """Return one curve per person (grey), their mean (blue) and the truth bodies' (green)."""
    width, height = CURVE_SIZE
    canvas = np.full((height, width, 3), 255, dtype=np.uint8)
    for centimetres in range(0, 11, 2):
        x = _curve_pixels(np.array([centimetres / 100]), np.zeros(1))[0, 0]
        cv2.line(canvas, (int(x), 20), (int(x), height - 40), (225, 225, 225), 1)
        _write(canvas, f'{centimetres} cm', (int(x) - 14, height - 20))
    for percent in range(0, 101, 20):
        y = _curve_pixels(np.zeros(1), np.array([percent / 100]))[0, 1]
        cv2.line(canvas, (50, int(y)), (width - 20, int(y)), (225, 225, 225), 1)
        _write(canvas, f'{percent} %', (8, int(y) + 4))
    for record in records:
        _draw_curve(canvas, record['curve'], (190, 190, 190), 1)
    _draw_curve(canvas, np.mean([r['curve'] for r in records], axis=0), (30, 80, 220), 2)
    _draw_curve(canvas, np.mean([r['curve_truth'] for r in records], axis=0), (20, 150, 60), 2)
    _write(canvas, 'points within a distance of the fitted vertices: blue mean of fits,', (60, 14))
    _write(canvas, 'green mean of the truth bodies', (330, height - 50))
    return canvas


def scene_picture(
    model: BodyModel, scene: SyntheticScene, guesses: Sequence[Guess]
) -> UInt8[np.ndarray, 'h w 3']:
    """Return colour, fits over colour (true outlines in green) and error heat maps, captioned."""
    overlay = scene.frame.rgb.copy()
    for person in scene.people:
        outline, _ = cv2.findContours(
            person.amodal_mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(overlay, outline, -1, (60, 220, 60), 1)
    heat = (scene.frame.rgb * 0.35).astype(np.uint8)
    pairs = match(model, guesses, scene.people)
    for guess in guesses:
        covered = render_depth(vertices(model, guess.parameters), model.f, scene.frame.camera)
        tint = 0.5 * overlay + np.array([20, 60, 127])
        overlay = np.where(covered.covered[..., None], tint, overlay).astype(np.uint8)
    for k, g in pairs.items():
        _draw_heat(heat, model, scene, scene.people[k], guesses[g])
    _draw_scale(heat)
    return np.hstack([
        captioned(scene.frame.rgb, 'colour'), captioned(overlay, 'fits, and true outlines'),
        captioned(heat, 'measured points, by their distance from the fit')])


def _draw_heat(
    heat: UInt8[np.ndarray, 'h w 3'], model: BodyModel, scene: SyntheticScene,
    person: PersonTruth, guess: Guess,
) -> None:
    points = observed_points(scene, person)
    if len(points) == 0:
        return
    distance = metrics.distance_to_surface(points, vertices(model, guess.parameters), model.f)
    shade = (255 * (1 - np.clip(distance / BLACK_M, 0, 1))).astype(int)
    for (u, v), value in zip(scene.frame.camera.project(points), shade, strict=True):
        colour = (int(value), int(value), int(value))
        cv2.rectangle(heat, (int(u) - 1, int(v) - 1), (int(u) + 1, int(v) + 1), colour, -1)


def _draw_scale(heat: UInt8[np.ndarray, 'h w 3']) -> None:
    """Draw a bar of the shades into the lower left corner, with millimetres below."""
    top, left, width = heat.shape[0] - 34, 8, 150
    heat[top - 6:, : left + width + 62] = 30
    shades = np.linspace(255, 0, width).astype(np.uint8)
    heat[top: top + 10, left: left + width] = shades[None, :, None]
    for share, more in ((0.0, ''), (0.5, ''), (1.0, ' mm or more')):
        cv2.putText(
            heat, f'{1000 * share * BLACK_M:.0f}{more}', (left + int(share * width) - 4, top + 26),
            cv2.FONT_HERSHEY_SIMPLEX, 0.38, (235, 235, 235), 1, cv2.LINE_AA)


def _draw_curve(
    canvas: UInt8[np.ndarray, 'h w 3'], shares: Sequence[float] | Float[np.ndarray, 'n'],
    colour: tuple[int, int, int], width: int,
) -> None:
    pixels = _curve_pixels(CURVE_M, np.asarray(shares, dtype=np.float64))
    cv2.polylines(canvas, [pixels.astype(np.int32)], False, colour, width, cv2.LINE_AA)


def _curve_pixels(
    distance_m: Float[np.ndarray, 'n'], share: Float[np.ndarray, 'n']
) -> Float[np.ndarray, 'n 2']:
    width, height = CURVE_SIZE
    return np.column_stack([
        50 + distance_m / CURVE_M[-1] * (width - 70), height - 40 - share * (height - 60)])


def _write(canvas: UInt8[np.ndarray, 'h w 3'], text: str, where: tuple[int, int]) -> None:
    cv2.putText(canvas, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.38, (60, 60, 60), 1, cv2.LINE_AA)
