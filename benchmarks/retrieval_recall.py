"""Whether the right pose is among the answers, and how near the library comes to real motion."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyParameters, shared_points
from pop_core.geometry.rotation import from_rotvec
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.retrieval.default_library import default_library, generate_library
from pop_core.retrieval.importers.clip import upright_tilt
from pop_core.retrieval.pose_library import PoseLibrary, pose_columns, visibility_mask
from pop_core.retrieval.pruning import nearest_distances
from pop_core.retrieval.retrieve import RetrievalConfig, retrieve

HELD_OUT = ('02', '06', '09', '12')  # subjects that the committed prior never saw
HIDDEN = (0.0, 0.3, 0.6)
NEAR_M = 0.10
NOISE_M, SIGMA_M = 0.015, 0.02
SHAPE_SIGMA = 0.7
FACING = from_rotvec(np.array([np.pi, 0.0, 0.0]))


def measure_recall(mocap: Path, frames: int) -> list[dict[str, object]]:
    """Return recall by share of hidden joints, ours beside the paper's rule on the same poses."""
    root, body = held_back(mocap, frames)
    library = recorded_behind_things(default_library())
    methods = {
        'ours, K = 16': RetrievalConfig(candidates=16),
        'ours, K = 6': RetrievalConfig(candidates=6),
        'ours, K = 1': RetrievalConfig(candidates=1),
        "the paper's rule: same visibility, K = 1": RetrievalConfig(
            candidates=1, shortlist=1, same_visibility=True),
    }
    down = np.array([0.0, 1.0, 0.0])
    rows: list[dict[str, object]] = []
    for name, config in methods.items():
        for gravity in (None, down) if 'ours' in name else (None,):
            told = ', gravity known' if gravity is down else ''
            row: dict[str, object] = {'method': name + told}
            for hidden in HIDDEN:
                errors = _errors(library, root, body, hidden, config, gravity)
                row[f'{hidden:.0%} hidden: recall [%]'] = float(100 * np.mean(errors < NEAR_M))
                row[f'{hidden:.0%}: median [mm]'] = float(1e3 * np.median(errors))
            rows.append(row)
    return rows


def measure_coverage(mocap: Path, frames: int) -> list[dict[str, object]]:
    """Return how near held-back poses have a neighbour: prior alone, and with the rules."""
    root, body = held_back(mocap, frames)
    model = default_body()
    whole = default_library()
    libraries = {
        'learned prior alone': generate_library(model, len(whole) // 3, procedural=False),
        'default library, a third': whole.subset(np.arange(0, len(whole), 3)),
        'default library': whole,
    }
    tilt = upright_tilt(root, 'y')
    joints = np.ascontiguousarray(pose_columns(body, tilt, model).transpose(2, 0, 1))
    rows: list[dict[str, object]] = []
    for name, library in libraries.items():
        gap = 1e3 * nearest_distances(joints, np.ascontiguousarray(library.joints))
        rows.append({
            'library': name, 'poses': len(library), 'mean': float(gap.mean()),
            'median': float(np.median(gap)), '90 %': float(np.quantile(gap, 0.9)),
            'largest': float(gap.max()),
        })
    return rows


def held_back(mocap: Path, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Return root (n,3) and body (n,23,3) rotations of frames of held-back subjects."""
    with np.load(mocap) as data:
        subjects = np.array([name.split('_')[0] for name in data['clip_names']])[data['clip']]
        rows = np.flatnonzero(np.isin(subjects, HELD_OUT))
        chosen = np.random.default_rng(0).choice(rows, min(frames, len(rows)), replace=False)
        pose = data['pose'][chosen].astype(np.float64)
    return pose[:, 0], pose[:, 1:]


def hidden_joints(joints: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Return a mask of the joints that a straight edge across the view hides."""
    angle = rng.uniform(0, 2 * np.pi)
    along = joints[:, :2] @ [np.cos(angle), np.sin(angle)]
    hidden = np.zeros(len(joints), dtype=bool)
    hidden[np.argsort(along)[len(joints) - round(share * len(joints)):]] = share > 0
    return hidden


def recorded_behind_things(library: PoseLibrary) -> PoseLibrary:
    """Return the library as recorded by cameras that saw 100, 70 or 40 % of the joints."""
    rng = np.random.default_rng(3)
    masks = np.empty(len(library), dtype=np.uint16)
    joints = np.asarray(library.joints)
    for i in range(len(library)):
        view = joints[i] @ from_rotvec(np.array([0.0, rng.uniform(-np.pi, np.pi), 0.0])).T
        masks[i] = visibility_mask(~hidden_joints(view, rng.choice(HIDDEN), rng))
    return PoseLibrary(library.body_pose, library.tilt, library.columns, masks, library.weights)


def seen_by_camera(
    root: np.ndarray, body: np.ndarray, share: float
) -> Iterator[tuple[LiftedJoints, np.ndarray]]:
    """Yield what a camera lifts of each pose, and all its joints (15,3) in the camera [m]."""
    rng = np.random.default_rng(2)
    model = default_body()
    points = shared_points(model)
    for turn, pose in zip(root, body, strict=True):
        betas = rng.normal(size=model.n_betas) * SHAPE_SIGMA
        upright = attached_positions(
            points, model, BodyParameters(np.zeros(3), turn, pose, betas))
        R = FACING @ from_rotvec(np.array([0.0, rng.uniform(-np.pi, np.pi), 0.0]))
        truth = upright @ R.T + [0.0, 0.0, 3.0]
        seen = truth + rng.normal(0, NOISE_M, truth.shape)
        hidden = hidden_joints(truth, share, rng)
        seen[hidden] = np.nan
        lifted = LiftedJoints(
            seen, np.where(hidden, np.inf, SIGMA_M), np.where(hidden, 1, 0),
            np.full((15, 2), np.nan), np.ones(15))
        yield lifted, truth


def _errors(
    library: PoseLibrary, root: np.ndarray, body: np.ndarray, share: float,
    config: RetrievalConfig, gravity: np.ndarray | None,
) -> np.ndarray:
    """Return the mean joint error of the best answer to each query [m]."""
    errors = []
    for lifted, truth in seen_by_camera(root, body, share):
        answers = retrieve(library, lifted, config, gravity=gravity)
        errors.append(min(
            np.linalg.norm(a.joints_camera - truth, axis=1).mean() for a in answers))
    return np.array(errors)
