"""The library that comes with the package: generated on first use, then read from the cache."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.model import BodyModel
from pop_core.errors import LibraryFileError
from pop_core.retrieval.generation import draw_poses
from pop_core.retrieval.library_file import load_library, save_library
from pop_core.retrieval.pose_library import PoseLibrary, build_library, pose_columns
from pop_core.retrieval.pose_prior import load_pose_prior
from pop_core.retrieval.procedural.families import DrawnPoses
from pop_core.retrieval.pruning import PoseThinner

Progress = Callable[[int, int], None]
GENERATION = 1  # raise it when the rules change, and old caches are not used any more
DEFAULT_SIZE = 150_000
SPACING_M = 0.035
SEED = 7
SAMPLE_BATCHES = 12


def default_library(progress: Progress | None = None, size: int = DEFAULT_SIZE) -> PoseLibrary:
    """Return the default library, generating it on first use.

    The file lies in `$XDG_CACHE_HOME/pop` (or `~/.cache/pop`); its name carries what it was made
    from, and a damaged one is made again.

    Args:
        progress: Called with poses done and poses wanted while generating.
        size: Number of poses.
    """
    model = default_body()
    path = default_library_path(size)
    try:
        if path.exists():
            return load_library(path, verify=True)
    except LibraryFileError:
        path.unlink()
    library = generate_library(model, size, progress=progress)
    try:
        save_library(library, path, {'origin': 'generated: pose prior and procedural families'})
    except OSError:
        return library  # no room or no right to write: the next start generates it again
    return load_library(path)


def default_library_path(size: int = DEFAULT_SIZE) -> Path:
    """Return where the default library is cached."""
    return cache_folder() / f'poses_{size}_{fingerprint(default_body())}.poplib'


def generate_library(
    model: BodyModel,
    size: int,
    seed: int = SEED,
    spacing_m: float = SPACING_M,
    progress: Progress | None = None,
    *,
    procedural: bool = True,
) -> PoseLibrary:
    """Return diverse poses at least `spacing_m` apart, decided by the seed.

    Args:
        model: Body that the joints are those of.
        size: Number of poses.
        seed: Decides every pose.
        spacing_m: Smallest mean joint distance of two poses [m].
        progress: Called with poses done and poses wanted.
        procedural: False takes poses from the learned prior alone.
    """
    rng = np.random.default_rng(seed)
    drawn = draw_poses(model, load_pose_prior().motion_part(), rng, procedural=procedural)
    first = [next(drawn) for _ in range(SAMPLE_BATCHES)]
    thinner = PoseThinner(np.concatenate([_joints(b, model) for b in first]), spacing_m, size)
    poses: list[np.ndarray] = []
    tilts: list[np.ndarray] = []
    while not thinner.full:
        batch = first.pop() if first else next(drawn)
        rows = thinner.accept(_joints(batch, model))
        poses.append(batch.body_pose[rows])
        tilts.append(batch.tilt[rows])
        if progress is not None:
            progress(thinner.count, size)
    return build_library(np.concatenate(poses), model, np.concatenate(tilts))


def cache_folder() -> Path:
    """Return the folder of generated files."""
    home = os.environ.get('XDG_CACHE_HOME')
    return (Path(home) if home else Path.home() / '.cache') / 'pop'


def fingerprint(model: BodyModel) -> str:
    """Return a short text that changes with everything the default library is made from."""
    prior = load_pose_prior().motion_part()
    parts = (
        model.joint_template.round(5), model.v_template[model.nose_vertex].round(5),
        prior.means.round(5), prior.weights.round(5),
    )
    digest = hashlib.sha256(f'{GENERATION} {SPACING_M} {SEED}'.encode())
    for part in parts:
        digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()[:12]


def _joints(batch: DrawnPoses, model: BodyModel) -> np.ndarray:
    columns = pose_columns(batch.body_pose, batch.tilt, model)
    return np.ascontiguousarray(columns.transpose(2, 0, 1))
