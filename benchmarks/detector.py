"""The depth detector alone: joints in 3D, people, parts and time; then real frames.

    python -m benchmarks detector --scenes 200 --out pictures

Synthetic scenes are drawn by `synthesise_scene` at 640x480 with fine meshes: another renderer,
sensor size and seeds than the training's. Real frames are read where they are there.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import cv2
from rich.progress import track

from benchmarks.arguments import positive
from benchmarks.detector_pictures import draw_detections
from benchmarks.detector_real import REAL, real_frames
from benchmarks.detector_scores import DetectorScores
from pop_core.body.default_body import default_body
from pop_core.keypoints.depth_network import EMBEDDED
from pop_core.keypoints.detection import KeypointDetector
from pop_core.synthesis.scene_config import training_config
from pop_core.synthesis.scenes import synthesise_scene
from pop_ros.sources import make_detector

FIRST_SEED = 900_000  # far from the seeds of tests, other benchmarks and training
SIZE = (640, 480)


def run(argv: list[str]) -> int:
    """Measure, print figures, write JSON and pictures when asked to."""
    options = parse(argv)
    if options.keypoints == 'depth' and not EMBEDDED.is_file():
        print('detector: no embedded network yet; give one with --keypoints FILE.onnx')
        return 2
    detector = make_detector(options.keypoints)
    report: dict[str, float | int] = {}
    if options.scenes:
        scores = measure(detector, range(options.seed, options.seed + options.scenes))
        report |= scores.figures()
        print(f'{scores.text()}\n\n{scores.joints.text()}\n')
    report |= measure_real(detector, options.real, options.out)
    if options.json is not None:
        options.json.write_text(json.dumps(report, indent=1) + '\n', encoding='utf-8')
    return 0


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        prog='python -m benchmarks detector', description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--scenes', type=positive, default=100, help='number of synthetic scenes')
    parser.add_argument('--seed', type=int, default=FIRST_SEED, help='seed of the first')
    parser.add_argument(
        '--keypoints', default='depth', help="'depth', the embedded network, or a source as in "
        '`pop fit`')
    parser.add_argument('--real', type=Path, default=REAL, help='folder of real frames')
    parser.add_argument('--out', type=Path, help='folder for pictures of the real frames')
    parser.add_argument('--json', type=Path, help='file to write all figures into')
    return parser.parse_args(argv)


def measure(detector: KeypointDetector, seeds: range) -> DetectorScores:
    """Return the scores over synthetic scenes."""
    model, config, scores = default_body(), training_config(*SIZE), DetectorScores()
    detector.detect(synthesise_scene(model, seeds[0], config).frame)  # loading is nobody's time
    for seed in track(seeds, 'scenes'):
        scores.add(synthesise_scene(model, seed, config), detector)
    return scores


def measure_real(
    detector: KeypointDetector, folder: Path, out: Path | None
) -> dict[str, float | int]:
    """Print how many people are found in real frames beside how many are there."""
    report: dict[str, float | int] = {}
    for name, frame, there in real_frames(folder):
        found = detector.detect(frame)
        report[f'found_{name}'] = len(found)
        scores = ', '.join(f'{person.score:.2f}' for person in found)
        print(f'{name:24} {len(found)} found, {there}; scores {scores}')
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            picture = draw_detections(frame, found)
            cv2.imwrite(str(out / f'{name}.png'), picture[..., ::-1])
    if not report:
        print(f'no real frames in {folder}')
    return report
