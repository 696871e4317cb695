"""People of a scene: shape, pose, clothes, their place on floor, seat or bed (room frame, [m])."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.geometry.transform import make_transform, transform_points
from pop_core.synthesis.blocks import Block, depth_inside, moved, yaw_matrix
from pop_core.synthesis.clothes import Outfit, draw_outfit, dressed
from pop_core.synthesis.occluders import SeatFit, bed_for, chair_for, sofa_for, stool_for
from pop_core.synthesis.poses import draw_pose

THICKEST_M = 0.04  # cloth over skin
SINK_M = 0.012      # flesh and cushions give way
CARRIED_M = 0.06     # highest that a lying trunk may be above its bed
TOLERANCE_M = 0.03  # deepest that a body may lie inside what carries it


@dataclass(frozen=True, slots=True, eq=False)
class Actor:
    """One person in the room.

    Args:
        parameters: SMPL parameters, room frame.
        skin: Unclothed vertices, room frame [m].
        surface: Clothed vertices, room frame [m].
        outfit: Clothes.
        seat: What the person sits or lies on; empty when standing.
        kind: Kind of the pose.
    """

    parameters: BodyParameters
    skin: Float[np.ndarray, 'v 3']
    surface: Float[np.ndarray, 'v 3']
    outfit: Outfit
    seat: tuple[Block, ...]
    kind: str


def draw_actor(
    model: BodyModel, kind: str, rng: np.random.Generator, *, child: bool = False,
    bare: bool = False,
) -> Actor:
    """Return a person above the origin, heading along +z, on the floor or on their own seat."""
    betas = np.clip(rng.normal(size=model.n_betas), -2.0, 2.0)
    scale = float(rng.uniform(0.62, 0.85)) if child else 1.0
    outfit = draw_outfit(model, rng, 0.0 if bare else THICKEST_M)
    for _ in range(20):
        pose = draw_pose(model, kind, rng)
        parameters = BodyParameters(np.zeros(3), pose.tilt, pose.body_pose, betas, scale)
        actor = settled(model, pose.kind, parameters, outfit, rng)
        if actor is not None:
            return actor
    return draw_actor(model, 'standing', rng, child=child, bare=bare)


def actor_at(
    actor: Actor, model: BodyModel, position: Float[np.ndarray, '3'], yaw_rad: float
) -> Actor:
    """Return the person, seat included, turned about the vertical and shifted [m]."""
    T_room_actor = make_transform(yaw_matrix(yaw_rad), position)
    return Actor(
        moved_parameters(model, actor.parameters, T_room_actor),
        transform_points(T_room_actor, actor.skin),
        transform_points(T_room_actor, actor.surface),
        actor.outfit, moved(actor.seat, position, yaw_rad), actor.kind,
    )


def moved_parameters(
    model: BodyModel, parameters: BodyParameters, T_a_b: Float[np.ndarray, '4 4']
) -> BodyParameters:
    """Return parameters of frame b expressed in frame a.

    The body turns about its root joint, which stands at scale * J_root(betas) + transl, so the
    translation changes even under a pure rotation.
    """
    root = parameters.scale * (
        model.joint_template[0] + model.joint_shapedirs[0] @ parameters.betas)
    moved_root = transform_points(T_a_b, (root + parameters.transl)[None])[0]
    turned = T_a_b[:3, :3] @ from_rotvec(parameters.global_orient)
    return parameters.replaced(transl=moved_root - root, global_orient=to_rotvec(turned))


def settled(
    model: BodyModel, kind: str, parameters: BodyParameters, outfit: Outfit,
    rng: np.random.Generator,
) -> Actor | None:
    """Return the person resting on something, or None when the pose fits no seat."""
    skin = vertices(model, parameters)
    bed_m = float(rng.uniform(0.35, 0.55)) if kind == 'lying' and rng.random() < 0.6 else 0.0
    lift = np.array([-skin[:, 0].mean(), bed_m - skin[:, 1].min() - SINK_M * (bed_m > 0),
                     -skin[:, 2].mean()])
    parameters = parameters.replaced(transl=parameters.transl + lift)
    skin = skin + lift
    if kind == 'lying' and not _carried(model, skin, bed_m):
        return None
    seat: list[Block] = []
    if bed_m > 0:
        seat = bed_for(skin.min(axis=0), skin.max(axis=0), bed_m, rng)
    if kind == 'seated':
        fit = seat_fit(model, skin)
        if fit is None:
            return None
        makers = (chair_for, sofa_for, stool_for)
        seat = makers[rng.integers(3)](fit, rng)
    if seat and max(depth_inside(block, skin).max() for block in seat) > TOLERANCE_M:
        return None
    return Actor(parameters, skin, dressed(skin, model.f, outfit), outfit, tuple(seat), kind)


def seat_fit(model: BodyModel, skin: Float[np.ndarray, 'v 3']) -> SeatFit | None:
    """Return the seat that a sitter's thighs, back and shins leave room for, or None.

    Args:
        model: Body model.
        skin: Posed vertices heading along +z, feet on the floor [m].
    """
    bone = model.weights.argmax(axis=1)
    hips = skin[np.isin(bone, _indices('pelvis', 'left_hip', 'right_hip'))]
    shins = skin[np.isin(bone, _indices(
        'left_knee', 'right_knee', 'left_ankle', 'right_ankle', 'left_foot', 'right_foot'))]
    trunk = skin[np.isin(bone, _indices('pelvis', 'spine1', 'spine2', 'spine3'))]
    front = float(min(shins[:, 2].min(), hips[:, 2].max())) - 0.01
    back = float(trunk[:, 2].min()) - 0.01
    on_seat = hips[hips[:, 2] < front, 1]
    height = float(on_seat.min(initial=np.inf)) + SINK_M
    if not (0.25 < height < 0.75 and front - back > 0.28):
        return None
    buttocks = skin[bone == JOINT_INDEX['pelvis']]
    half_width = float(np.abs(hips[hips[:, 2] < buttocks[:, 2].max(), 0]).max()) + 0.02
    return SeatFit(height, back, front, min(half_width, 0.35))


def _carried(model: BodyModel, skin: Float[np.ndarray, 'v 3'], level_m: float) -> bool:
    """Return whether pelvis and chest of somebody who lies rest on what is below."""
    bone = model.weights.argmax(axis=1)
    lowest = [skin[bone == JOINT_INDEX[name], 1].min() for name in ('pelvis', 'spine3')]
    return bool(max(lowest) < level_m + CARRIED_M)


def _indices(*names: str) -> list[int]:
    return [JOINT_INDEX[name] for name in names]
