"""Capsules that stand for a body's flesh: what may not pass through itself.

A capsule is all that lies within a radius of a segment. Limbs have one along each bone, trunk
sections one from side to side, the head is a ball. Positions and radii are those of the T-pose
[m], body frame, and linear in the betas.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.capsule_kernels import closest_shares
from pop_core.body.joints import JOINT_INDEX, N_JOINTS, PARENTS
from pop_core.body.model import AttachedPoints, BodyModel

TOUCHING_M = 0.03  # pairs nearer than this in the T-pose always touch somewhere: arm and chest
FIRM = 0.8  # of the radius: flesh gives way, and people fold their arms

# Limb capsules run from a joint to its child in the flesh of the first, and of others named.
_LIMBS = (
    ('hip', 'knee'), ('knee', 'ankle'), ('ankle', 'foot'),
    ('shoulder', 'elbow'), ('elbow', 'wrist'), ('wrist', 'hand', 'hand'),
)
_Capsule = tuple[int, Float[np.ndarray, '2 3'], float]


@dataclass(frozen=True, slots=True, eq=False)
class BodyCapsules:
    """The capsules of a model.

    Args:
        ends: First ends of the n capsules, then second ends.
        radius: Firm radius on the mean body [m].
        radius_shapedirs: Its change per unit of each beta [m].
        pairs: Capsules that may not overlap.
    """

    ends: AttachedPoints
    radius: Float[np.ndarray, 'n']
    radius_shapedirs: Float[np.ndarray, 'n b']
    pairs: Int[np.ndarray, 'p 2']


@lru_cache(maxsize=8)
def body_capsules(model: BodyModel) -> BodyCapsules:
    """Measure the capsules of a model.

    Neighbours in the tree and pairs that touch in the T-pose are no pairs.
    """
    carrier, ends, radius = _measured(model, np.zeros(model.n_betas))
    unit = np.eye(model.n_betas)
    steps = [(_measured(model, beta), _measured(model, -beta)) for beta in unit]
    ends_shape = np.stack([(ahead[1] - behind[1]) / 2 for ahead, behind in steps], axis=-1)
    radius_shape = np.stack([(ahead[2] - behind[2]) / 2 for ahead, behind in steps], axis=-1)
    attached = AttachedPoints(np.tile(carrier, 2), ends, ends_shape)
    return BodyCapsules(
        attached, FIRM * radius, FIRM * radius_shape, _pairs(carrier, ends, radius))


def _measured(
    model: BodyModel, betas: Float[np.ndarray, 'b']
) -> tuple[Int[np.ndarray, 'n'], Float[np.ndarray, 'm 3'], Float[np.ndarray, 'n']]:
    """Return carrier joints, ends (first ones, then second ones) and radii in the T-pose."""
    skin = model.v_template + model.shapedirs @ betas
    joints = model.joint_template + model.joint_shapedirs @ betas
    flesh = [skin[model.bone_ids[:, 0] == joint] for joint in range(N_JOINTS)]
    capsules = [*_limb_capsules(joints, flesh), *_core_capsules(joints, flesh)]
    carrier, segments, radii = zip(*capsules, strict=True)
    return np.array(carrier), np.concatenate(np.stack(segments, axis=1)), np.array(radii)


def _limb_capsules(
    joints: Float[np.ndarray, '24 3'], flesh: list[Float[np.ndarray, '_ 3']]
) -> Iterator[_Capsule]:
    for side in ('left', 'right'):
        for start, end, *others in _LIMBS:
            first, last, *rest = (JOINT_INDEX[f'{side}_{name}'] for name in (start, end, *others))
            skin = np.concatenate([flesh[joint] for joint in (first, *rest)])
            segment = joints[[first, last]]
            yield first, segment, _limb_radius(skin, segment)


def _core_capsules(
    joints: Float[np.ndarray, '24 3'], flesh: list[Float[np.ndarray, '_ 3']]
) -> Iterator[_Capsule]:
    for name in ('pelvis', 'spine1', 'spine2', 'spine3', 'head'):
        joint = JOINT_INDEX[name]
        # A bone without flesh of its own, in bodies of others, is a point.
        skin = flesh[joint] if len(flesh[joint]) else joints[[joint]]
        yield joint, *(_ball(skin) if name == 'head' else _trunk_section(skin))


def _limb_radius(skin: Float[np.ndarray, 'v 3'], segment: Float[np.ndarray, '2 3']) -> float:
    if not len(skin):
        return 0.0
    along = (segment[1] - segment[0]) / np.linalg.norm(segment[1] - segment[0])
    return float(np.median(np.linalg.norm(np.cross(skin - segment[0], along), axis=1)))


def _trunk_section(skin: Float[np.ndarray, 'v 3']) -> tuple[Float[np.ndarray, '2 3'], float]:
    """Return ends and radius of a capsule as deep and as wide as a section's skin."""
    back, front = np.percentile(skin[:, 2], [5, 95])
    radius = float(front - back) / 2
    centre = np.array([skin[:, 0].mean(), skin[:, 1].mean(), (front + back) / 2])
    reach = np.percentile(np.abs(skin[:, 0] - centre[0]), 95) - radius
    across = np.array([max(reach, 0.0), 0.0, 0.0])
    return np.stack([centre + across, centre - across]), radius


def _ball(skin: Float[np.ndarray, 'v 3']) -> tuple[Float[np.ndarray, '2 3'], float]:
    centre = skin.mean(axis=0)
    return np.stack([centre, centre]), float(np.linalg.norm(skin - centre, axis=1).mean())


def _pairs(
    carrier: Int[np.ndarray, 'n'], ends: Float[np.ndarray, 'm 3'], radius: Float[np.ndarray, 'n']
) -> Int[np.ndarray, 'p 2']:
    every = np.column_stack(np.triu_indices(len(carrier), 1))
    first, second = every.T
    _, distance = closest_shares(ends.reshape(2, -1, 3), every)
    parent = np.array(PARENTS)[carrier]
    neighbours = (parent[first] == carrier[second]) | (parent[second] == carrier[first])
    apart = distance - radius[first] - radius[second] > TOUCHING_M
    return every[apart & ~neighbours]
