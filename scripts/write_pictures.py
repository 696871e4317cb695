"""Draw the pictures of the docs: `python -m scripts.write_pictures FOLDER`."""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from pop_core.body.default_body import default_body
from pop_core.rendering.pictures import result_panels
from pop_core.rendering.shown_body import shown
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.sources import make_pipeline
from pop_ros.warm_up import OnePerson

WIDTH, HEIGHT, GAP = 420, 315, 6
WALK_SEED = 8  # a table that one can look below, so that some of the legs is seen
FRAMES, SHOWN = 16, 10


def walk_picture(scene: SyntheticScene) -> np.ndarray:
    """Return colour, fit and views of a synthetic frame in a row."""
    detection = next(d for d in scene.detections() if d is not None)
    pipeline = make_pipeline(OnePerson(detection))
    bodies = [shown(body) for body in pipeline.process(scene.frame).bodies]
    colour, _, fit, views = result_panels(scene.frame, bodies, pipeline.model.f)
    small = [
        cv2.resize(panel, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
        for panel in (colour, fit, views)]
    gap = np.full((HEIGHT, GAP, 3), 255, dtype=np.uint8)
    return np.concatenate([small[0], gap, small[1], gap, small[2]], axis=1)


def main(folder: Path) -> None:
    """Write all pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    scene = synthesise_sequence(default_body(), WALK_SEED, FRAMES, rate_hz=10.0)[SHOWN]
    picture = cv2.cvtColor(walk_picture(scene), cv2.COLOR_RGB2BGR)
    cv2.imwrite(str(folder / 'walk.jpg'), picture, [cv2.IMWRITE_JPEG_QUALITY, 88])


if __name__ == '__main__':
    main(Path(sys.argv[1]))
