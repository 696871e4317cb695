"""Draw a recording and the bodies found in it: a film and a page with pictures and 3D views."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pop_core import __version__
from pop_core.body.model import BodyModel
from pop_core.errors import PopError
from pop_core.estimate import JointState
from pop_core.rendering.pictures import extent_of, four_panels
from pop_core.rendering.shown_body import ShownBody
from pop_core.rendering.summary_film import SummaryFilm
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_merge import MergedBags
from pop_ros.bag_reader import BagMessage
from pop_ros.bag_topics import RgbdTopics, find_topics
from pop_ros.evenly import Evenly
from pop_ros.from_messages import frame_from_messages
from pop_ros.pairing import FramePairer
from pop_ros.recorded_bodies import RecordedFrame, iterate_bodies, shown_bodies
from pop_ros.recording import Recording
from pop_ros.replay import paired_frames
from pop_ros.report import Picture, Report
from pop_ros.report3d import SceneFrame
from pop_ros.result_folder import write_png

MAX_PICTURES = 24  # of a page: 0.1 MB each
MAX_SCENES = 6  # of a page: 0.7 MB each
PAGE_PX = 1280  # width of its pictures
FILM_HZ = 4.0  # slow enough to look at four panels
LEGEND = (
    'Left to right, top to bottom: colour, depth, the fitted mesh with its skeleton (hollow '
    'joints are hidden from the camera, faint limbs are behind something; the outline is what was '
    'segmented), and the scene from the right and from above with measured points of the people '
    'in black.')
HOW_TO_TURN = (
    'Drag to turn, wheel to come nearer. White joints are seen by the camera, dark ones are '
    'hidden from it.')


class ShowError(PopError):
    """Bodies that cannot be drawn over a recording."""


@dataclass(frozen=True, slots=True)
class ShowRequest:
    """What to draw.

    Args:
        recordings: Bags of the camera, read as one.
        bodies: Bag that `pop replay` made of it.
        out: Folder for `report.html` and the film.
        topics: Colour, depth and CameraInfo topics where the user named them.
        slop_s: Largest difference of stamps of a pair [s].
        film: Name of the film; its suffix is the format.
        notes: What else the page should say, line by line.
        overlays: Whether to write a picture of every frame too.
    """

    recordings: tuple[Path, ...]
    bodies: Path
    out: Path
    topics: tuple[str | None, str | None, str | None] = (None, None, None)
    slop_s: float = 0.5
    film: str = 'film.mp4'
    notes: Sequence[str] = ()
    overlays: bool = False

    @property
    def name(self) -> str:
        """Return the recordings' names."""
        return ' and '.join(path.name for path in self.recordings)


def show_recording(
    request: ShowRequest, model: BodyModel, on_frame: Callable[[int], None] = lambda _n: None
) -> tuple[Path, Path]:
    """Write the film and the page of a recording; return where they are.

    Args:
        request: What to draw.
        model: Body whose meshes were recorded.
        on_frame: Told how many frames are drawn.

    Raises:
        PopError: If a bag cannot be read, or no body of it belongs to the recording.
    """
    request.out.mkdir(parents=True, exist_ok=True)
    film_path, page = request.out / request.film, request.out / 'report.html'
    scenes, pictures = Evenly[SceneFrame](MAX_SCENES), Evenly[Picture](MAX_PICTURES)
    counts, extent = _Counts(), np.zeros((0, 3))
    with SummaryFilm(film_path, FILM_HZ) as film:
        for scene in read_scenes(request, model):
            # The views widen as people walk; they do not jump from frame to frame.
            extent = np.concatenate([extent, extent_of(scene.bodies)])
            picture = four_panels(scene.frame, scene.bodies, model.f, extent)
            film.add(picture)
            if request.overlays:
                _write_overlay(request.out / 'overlays', scene, picture)
            scenes.add(scene)
            pictures.add(Picture.encoded(picture, scene.caption, PAGE_PX))
            counts.add(scene.bodies)
            on_frame(counts.frames)
    if not counts.frames:
        raise ShowError(
            f'{request.name}: expected the recording that {request.bodies} was made of, '
            'found no frame with these stamps')
    _write_page(page, request, model, scenes.chosen(), pictures.chosen(), counts)
    return page, film_path


def _write_overlay(folder: Path, scene: SceneFrame, picture: np.ndarray) -> None:
    folder.mkdir(exist_ok=True)
    write_png(folder / f'{scene.frame.stamp_ns}.png', picture)


@dataclass(slots=True)
class _Counts:
    frames: int = 0
    people: int = 0
    seen: int = 0
    hidden: int = 0

    def add(self, bodies: Sequence[ShownBody]) -> None:
        self.frames += 1
        self.people += len(bodies)
        for body in bodies:
            seen = int((body.joint_state == JointState.VISIBLE).sum())
            self.seen += seen
            self.hidden += len(body.joint_state) - seen


def read_scenes(request: ShowRequest, model: BodyModel) -> Iterator[SceneFrame]:
    """Yield the frames from the first to the last with bodies, those without any among them.

    Raises:
        PopError: If a bag cannot be read, or the bodies are not of this model.
    """
    recorded = iterate_bodies(request.bodies)
    bodies_ns, bodies = next(recorded, (None, RecordedFrame()))
    if bodies_ns is None:
        raise ShowError(f'{request.bodies}: expected recorded bodies, found none')
    first_ns = bodies_ns
    with MergedBags(request.recordings) as bag:
        topics = find_topics(bag, *request.topics)
        for frame in _frames(bag, topics, request.slop_s):
            while bodies_ns is not None and bodies_ns < frame.stamp_ns:
                bodies_ns, bodies = next(recorded, (None, RecordedFrame()))
            if bodies_ns is None:
                return
            if frame.stamp_ns >= first_ns:
                present = bodies if bodies_ns == frame.stamp_ns else RecordedFrame()
                people = _bodies(present, frame, model, request)
                yield SceneFrame(frame, people, _caption(frame, people, first_ns))


def _frames(bag: Recording, topics: RgbdTopics, slop_s: float) -> Iterator[RgbdFrame]:
    pairer: FramePairer[BagMessage] = FramePairer(round(slop_s * 1e9))
    for frame in paired_frames(bag, topics, pairer, lambda: None):
        try:
            yield frame_from_messages(frame.color.read(), frame.depth.read(), frame.info.read())
        except PopError:
            continue  # whoever made the bodies has dropped it and said so


def _bodies(
    recorded: RecordedFrame, frame: RgbdFrame, model: BodyModel, request: ShowRequest
) -> list[ShownBody]:
    for corners in recorded.triangles:
        if len(corners) != model.f.size:
            raise ShowError(
                f'{request.bodies}: expected meshes of {len(model.f)} triangles, found '
                f'{len(corners) // 3}: name the body they were made with (pop show '
                '--body FILE), and record with mesh.detail full')
    return shown_bodies(recorded, frame, model)


def _caption(frame: RgbdFrame, bodies: Sequence[ShownBody], first_ns: int) -> str:
    count = len(bodies)
    people = 'nobody' if not count else f'{count} {"person" if count == 1 else "people"}'
    return f'{(frame.stamp_ns - first_ns) / 1e9:.2f} s: {people}'


def _write_page(
    page: Path,
    request: ShowRequest,
    model: BodyModel,
    scenes: Sequence[SceneFrame],
    pictures: Sequence[Picture],
    counts: _Counts,
) -> None:
    report = Report(
        f'pop: {request.name}',
        f'Frames: {counts.frames}. Bodies: {counts.people}. The camera sees {counts.seen} of '
        f'their {counts.seen + counts.hidden} joints; the others were inferred.')
    report.scenes(scenes, model.f)
    report.text(HOW_TO_TURN)
    report.heading('Frame by frame')
    report.film(pictures)
    report.text(LEGEND)
    if request.notes:
        report.heading('What the replay said')
        report.commands(request.notes)
    report.text(f'Written by pop {__version__} from {request.bodies.name}.')
    report.write(page)
