"""Recordings of people who move, frame by frame, with everything known about them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from pop_core.body.model import BodyModel
from pop_core.keypoints.detection import Detection
from pop_core.synthesis.keypoints import KeypointNoise
from pop_core.synthesis.scenes import SyntheticScene, photograph
from pop_core.synthesis.sequence_keypoints import KeypointStream
from pop_core.synthesis.sequence_kinds import draw_script
from pop_core.synthesis.sequence_names import SequenceKind
from pop_core.synthesis.truth import Background, background_of, render_truth

FIRST_STAMP_NS = 1_700_000_000_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class SequenceFrame:
    """One frame of a recording and its truth.

    Args:
        scene: Frame and people; the place in `scene.people` is a person's id.
        detections: Keypoints of each person as a detector gives them, None where it finds nobody.
        seconds: Time since the first frame.
    """

    scene: SyntheticScene
    detections: tuple[Detection | None, ...]
    seconds: float


@dataclass(frozen=True, slots=True)
class SequenceConfig:
    """How a sequence is recorded.

    Args:
        kind: What happens.
        n_frames: Number of frames.
        rate_hz: Frames per second.
        sensor: Preset of depth noise, '' for none.
        colour: Whether to shade a colour image; black without, and twice as fast.
        noise: How the keypoint detector errs.
        start_ns: Stamp of the first frame [ns].
    """

    kind: SequenceKind = SequenceKind.TABLE
    n_frames: int = 90
    rate_hz: float = 30.0
    sensor: str = 'structured_light'
    colour: bool = True
    noise: KeypointNoise = field(default_factory=KeypointNoise)
    start_ns: int = FIRST_STAMP_NS


def film_sequence(
    model: BodyModel, seed: int, config: SequenceConfig
) -> Iterator[SequenceFrame]:
    """Yield the frames of a sequence: the same ones for a seed, each rendered when asked for.

    Person, clothes and room stay, noise is new in every frame, and keypoint errors last for some
    frames, as those of real detectors do.
    """
    rng = np.random.default_rng([seed, 3])
    script = draw_script(model, config.kind, rng, (config.n_frames - 1) / 2 / config.rate_hz)
    stream = KeypointStream(config.noise, config.rate_hz, np.random.default_rng([seed, 5]))
    background: Background | None = None
    for k in range(config.n_frames):
        seconds = k / config.rate_hz
        layout = script.layout(model, seconds)
        if background is None or script.moving_camera:
            background = background_of(layout)
        truth = render_truth(model, layout, background)
        scene = photograph(
            model, layout, truth, sensor=config.sensor, seed=seed * 100_003 + k,
            stamp_ns=config.start_ns + round(k * 1e9 / config.rate_hz), colour=config.colour)
        yield SequenceFrame(scene, stream.detect(truth.people, layout.camera), seconds)


def synthesise_sequence(
    model: BodyModel, seed: int, n_frames: int, *, rate_hz: float = 15.0,
    progress: Callable[[int], None] | None = None,
) -> list[SyntheticScene]:
    """Return frames of a walk from the left of the image to the right, legs behind a table.

    Args:
        model: Body model.
        seed: Draws person, room, table and noise.
        n_frames: Number of frames.
        rate_hz: Frames per second.
        progress: Called with the number of finished frames.
    """
    scenes = []
    config = SequenceConfig(SequenceKind.TABLE, n_frames, rate_hz)
    for number, frame in enumerate(film_sequence(model, seed, config), start=1):
        scenes.append(frame.scene)
        if progress is not None:
            progress(number)
    return scenes
