"""Views of people with errors of keypoints, drawn once and packed into files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, Int8

from pop_core.body.default_body import default_body
from pop_core.completion.person_view import FEATURES, RELIEF_M, VIEW_PX, PersonView, view_person
from pop_core.estimate import JointState
from pop_core.synthesis.coarse_body import coarse_body
from pop_core.synthesis.keypoints import KeypointNoise, noisy_detection
from pop_core.synthesis.training_scenes import TrainingPerson, TrainingScene, TrainingScenes
from pop_core.training.scene_writer import load_motions
from pop_core.training.shards import DAMAGED, ShardError

FILE_VIEWS = 4096
VIEWS_PER_PERSON = 2  # detections of one person in one scene differ
FEWEST_VISIBLE, NEAREST_M, FARTHEST_M = 3, 0.2, 3.0
USUAL_SHARE = 0.5  # of detections that err as those of the accuracy benchmark do
STEPS = 126  # relative depth is kept in so many steps on either side of the person's
UNMEASURED, OUTSIDE = -128, -127


@dataclass(frozen=True, slots=True, eq=False)
class PackedViews:
    """Views, stacked, and where the joints are.

    Args:
        relief: Relative depth in steps of RELIEF_M / STEPS; UNMEASURED or OUTSIDE elsewhere.
        keypoints: As `PersonView.keypoints`.
        places: The 15 shared points [m], as the view has them.
        state: A JointState per point.
    """

    relief: Int8[np.ndarray, 'n h w']
    keypoints: Float32[np.ndarray, 'n 15 f']
    places: Float32[np.ndarray, 'n 15 3']
    state: Int8[np.ndarray, 'n 15']

    def __len__(self) -> int:
        """Return the number of views."""
        return len(self.relief)


def write_views(
    folder: Path, count: int, *, seed: int, workers: int = 1, mocap: Path | None = None,
    per_file: int = FILE_VIEWS,
) -> Iterator[int]:
    """Write at least `count` views and yield how many are done after every file.

    Args:
        folder: Where `<seed>_<number>.npz` are written; what is there already is kept.
        count: Number of views, rounded up to whole files.
        seed: Decides every view, whatever the number of workers.
        workers: Processes.
        mocap: File of captured poses to draw from as well.
        per_file: Views in a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    jobs = [(folder / f'{seed:04d}_{k:05d}.npz', seed * 100_000 + k, per_file, mocap)
            for k in range(-(-count // per_file))]
    todo = [job for job in jobs if not job[0].exists()]
    done = (len(jobs) - len(todo)) * per_file
    with get_context('spawn').Pool(workers) as pool:
        for _ in pool.imap_unordered(_write, todo):
            done += per_file
            yield done


def load_views(path: Path) -> PackedViews:
    """Return the views of a file.

    Raises:
        ShardError: If it holds none.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {field.name: file[field.name] for field in fields(PackedViews)}
    except DAMAGED as error:
        raise ShardError(f'{path}: expected packed views, found: {error}') from None
    n = len(arrays['state'])
    found = {name: array.shape for name, array in arrays.items()}
    if found != {'relief': (n, VIEW_PX, VIEW_PX), 'keypoints': (n, 15, FEATURES),
                 'places': (n, 15, 3), 'state': (n, 15)}:
        raise ShardError(f'{path}: expected packed views, found arrays of {found}')
    return PackedViews(**arrays)


def draw_views(
    scenes: Iterator[TrainingScene], rng: np.random.Generator
) -> Iterator[tuple[PersonView, TrainingPerson]]:
    """Yield views of the people of scenes, each with keypoints that err, as far as there are any.

    Args:
        scenes: Where people come from.
        rng: Decides the errors.
    """
    for scene in scenes:
        for person in scene.people:
            for _ in range(VIEWS_PER_PERSON):
                detection = noisy_detection(
                    person.shared_points, person.shared_state, scene.camera, rng,
                    draw_noise(rng))
                if detection is None or not _is_near(person):
                    continue
                view = view_person(scene.depth_m, scene.camera, detection)
                if view is not None and np.abs(places_of(view, person)).max() < FARTHEST_M:
                    yield view, person


def draw_noise(rng: np.random.Generator) -> KeypointNoise:
    """Return how some detector errs: half of them like a good one in colour, others worse."""
    if rng.random() < USUAL_SHARE:
        return KeypointNoise()
    low_px = rng.uniform(2.0, 4.0)
    return KeypointNoise(
        sigma_px=(low_px, low_px + rng.uniform(0.0, 4.0)), missing=rng.uniform(0.0, 0.15),
        outliers=rng.uniform(0.0, 0.06), swaps=rng.uniform(0.0, 0.05),
        hidden_by_self=rng.uniform(0.2, 0.9), hidden_by_scene=rng.uniform(0.0, 0.5),
        guess_factor=rng.uniform(2.0, 4.0))


def pack(views: Sequence[tuple[PersonView, TrainingPerson]]) -> PackedViews:
    """Return views and truth, stacked."""
    relief = np.array([view.relief_m for view, _ in views])
    measured = np.array([view.measured for view, _ in views])
    coded = np.round(relief * (STEPS / RELIEF_M)).astype(np.int8)
    coded = np.select([measured < 0, measured == 0], [OUTSIDE, UNMEASURED], coded)
    return PackedViews(
        coded.astype(np.int8), np.array([view.keypoints for view, _ in views]),
        np.array([places_of(*one) for one in views], dtype=np.float32),
        np.array([person.shared_state for _, person in views], dtype=np.int8))


def places_of(view: PersonView, person: TrainingPerson) -> Float[np.ndarray, '15 3']:
    """Return a person's joints [m] as a view has them."""
    return view.from_camera(person.shared_points)


def _is_near(person: TrainingPerson) -> bool:
    """Return whether enough is seen of a person, all of whom is before the camera."""
    seen = np.count_nonzero(person.shared_state == JointState.VISIBLE)
    return bool(seen >= FEWEST_VISIBLE and person.shared_points[:, 2].min() > NEAREST_M)


def _write(job: tuple[Path, int, int, Path | None]) -> None:
    path, seed, per_file, mocap = job
    motions = load_motions(mocap) if mocap is not None else ()
    scenes = TrainingScenes(coarse_body(default_body()), seed, motions=motions)
    drawn = draw_views(iter(scenes.draw, None), np.random.default_rng([seed, 13]))
    packed = pack([next(drawn) for _ in range(per_file)])
    part = path.with_suffix('.part')
    with part.open('wb') as file:
        np.savez(file, **{
            field.name: getattr(packed, field.name) for field in fields(PackedViews)})
    part.replace(path)
