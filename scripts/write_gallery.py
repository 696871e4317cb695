"""Draw the pictures of docs/gallery.md: `python -m scripts.write_gallery FOLDER`.

All scenes are synthetic. The picture of the 3D view needs Debian's chromium.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from pop_core.body.default_body import default_body
from pop_core.fitting.fit_trace import TracedSteps
from pop_core.keypoints.detection import Detection
from pop_core.pipeline import BodyPipeline
from pop_core.rendering.heat_map import heat_map
from pop_core.rendering.pictures import extent_of, result_panels
from pop_core.rendering.shown_body import ShownBody, shown
from pop_core.rendering.summary_film import SummaryFilm
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.scenes import SyntheticScene, synthesise_scene
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.fit_pictures import energy_chart, measured_surfaces
from pop_ros.report import Report
from pop_ros.report3d import SceneFrame
from pop_ros.sources import make_pipeline
from scripts.write_pictures import WALK_SEED

WALK_FRAMES, RATE_HZ = 12, 8.0
CROWD_SEED = 6
JPEG_QUALITY = 78
CROP = slice(24, 690)  # the page without its margins


class SceneKeypoints:
    """What a detector says about the scene that is set."""

    scene: SyntheticScene

    def detect(self, frame: RgbdFrame) -> list[Detection]:  # noqa: ARG002 - the scene knows
        """Return the detections of the scene."""
        return [found for found in self.scene.detections() if found is not None]


def write_walk(folder: Path, pipeline: BodyPipeline, source: SceneKeypoints) -> None:
    """Write the film of a walk and the 3D view of its middle."""
    scenes = synthesise_sequence(default_body(), WALK_SEED, WALK_FRAMES, rate_hz=RATE_HZ)
    fitted: list[tuple[SyntheticScene, list[ShownBody]]] = []
    for scene in scenes:
        source.scene = scene
        bodies = [shown(body) for body in pipeline.process(scene.frame).bodies]
        fitted.append((scene, bodies))
    extent = np.concatenate([extent_of(bodies) for _, bodies in fitted])
    with SummaryFilm(folder / 'walk.webp', RATE_HZ, width=680) as film:
        for scene, bodies in fitted:
            _, _, fit, views = result_panels(scene.frame, bodies, pipeline.model.f, extent)
            film.add(np.concatenate([fit, views], axis=1))
    scene, bodies = fitted[WALK_FRAMES // 2]
    write_view(folder / 'view3d.jpg', SceneFrame(scene.frame, bodies, ''), pipeline.model.f)


def write_view(path: Path, scene: SceneFrame, f: np.ndarray) -> None:
    """Write what a browser shows of a frame in 3D."""
    chromium = shutil.which('chromium')
    if chromium is None:
        print(f'{path}: left as it was, there is no chromium')
        return
    with tempfile.TemporaryDirectory() as work:
        report = Report('', '')
        report.scenes([scene], f)
        page, picture = Path(work) / 'page.html', Path(work) / 'page.png'
        report.write(page)
        subprocess.run(
            [chromium, '--headless=new', '--no-sandbox', '--use-gl=angle',
             '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--hide-scrollbars',
             '--virtual-time-budget=4000', '--window-size=960,760', f'--screenshot={picture}',
             page.as_uri()], check=True, capture_output=True, timeout=120)
        write_jpeg(path, cv2.imread(str(picture))[CROP][..., ::-1], width=860)


def write_crowd(folder: Path, pipeline: BodyPipeline, source: SceneKeypoints) -> None:
    """Write errors and energies of a scene with several people."""
    steps = TracedSteps(pipeline.fitter.steps)
    pipeline.fitter.steps = steps
    source.scene = scene = synthesise_scene(default_body(), CROWD_SEED)
    result = pipeline.process(scene.frame)
    people = measured_surfaces(
        result, np.array([p.joints for p in scene.people]),
        np.array([p.vertices for p in scene.people], dtype=np.float64))
    picture = heat_map(scene.frame.rgb, people, pipeline.model.f, scene.frame.camera)
    write_jpeg(folder / 'errors.jpg', picture, width=960)
    chart = energy_chart(steps.take_traces()[0])
    cv2.imwrite(str(folder / 'energies.png'), chart[..., ::-1])


def write_jpeg(path: Path, rgb: np.ndarray, width: int | None = None) -> None:
    """Write a picture, scaled down to a width [px] if given."""
    if width is not None:
        height = round(rgb.shape[0] * width / rgb.shape[1])
        rgb = cv2.resize(rgb, (width, height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(path), rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])


def main(folder: Path) -> None:
    """Write all pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    source = SceneKeypoints()
    pipeline = make_pipeline(source)
    write_walk(folder, pipeline, source)
    write_crowd(folder, pipeline, source)


if __name__ == '__main__':
    main(Path(sys.argv[1]))
