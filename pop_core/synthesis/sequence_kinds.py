"""What happens in sequences: who does what where, before which furniture (room frame, [m])."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel
from pop_core.body.skinning import vertices
from pop_core.geometry.transform import invert_transform
from pop_core.synthesis.blocks import Block, box, moved, yaw_matrix
from pop_core.synthesis.cameras import CameraRange, draw_camera, look_at
from pop_core.synthesis.layouts import Layout
from pop_core.synthesis.occluders import bare_table, chair_for
from pop_core.synthesis.people import seat_fit
from pop_core.synthesis.poses import ScenePose, draw_pose
from pop_core.synthesis.rooms import draw_clutter, draw_room, varied
from pop_core.synthesis.scenes import ATTEMPTS, SceneError
from pop_core.synthesis.sequence_names import SequenceKind
from pop_core.synthesis.sequence_people import Motion, Performer, draw_look
from pop_core.synthesis.sequence_poses import PoseToPose, Tempo, draw_arm_poses
from pop_core.synthesis.sequence_routes import WALKING_M_S, Loop, Place, Route, TurnAround
from pop_core.synthesis.sequence_walk import Walk

SWING_M, SWING_S = 0.45, 6.0  # of a moving camera: to each side, and time there and back
AIM = np.array([0.0, 0.95, 0.0])
ON_SPOT = np.array([0.0, 0.0, 0.1])
TABLE_M = 0.74  # height
LEFT_TO_RIGHT = np.pi / 2  # heading along +x, to the right of an image


@dataclass(frozen=True, slots=True, eq=False)
class Script:
    """A sequence before it is filmed.

    Args:
        stage: Room, furniture, camera and light; nobody in it.
        performers: People; the place in this tuple is a person's id.
        moving_camera: Whether the camera swings from side to side.
    """

    stage: Layout
    performers: tuple[Performer, ...]
    moving_camera: bool = False

    def layout(self, model: BodyModel, seconds: float) -> Layout:
        """Return everything at a time [s]."""
        actors = tuple(performer.at(model, seconds) for performer in self.performers)
        T_camera_room = self.stage.T_camera_room
        if self.moving_camera:
            eye = invert_transform(T_camera_room)[:3, 3]
            phase = 2 * np.pi * seconds / SWING_S
            aside = np.array([np.sin(phase), 0.3 * np.sin(2 * phase), 0.0])
            T_camera_room = look_at(eye + SWING_M * aside, AIM + 0.25 * SWING_M * aside)
        return replace(self.stage, actors=actors, T_camera_room=T_camera_room)


def draw_script(
    model: BodyModel, kind: SequenceKind, rng: np.random.Generator, middle_s: float = 0.0
) -> Script:
    """Return who does what in a sequence of a kind.

    Args:
        model: Body model.
        kind: What happens.
        rng: Randomness.
        middle_s: Middle of a short sequence, when walkers shall be in the middle of the image [s].

    Raises:
        SceneError: If no chair fits anybody.
    """
    return _SCRIPTS[kind](model, rng, middle_s)


def _table(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """One person walks to and fro behind a table."""
    stage = _stage(rng, _desk(rng, 1.5, 0.75), 2.95)
    # From the edge of the image at the latest, also when the recording is long.
    start_m = -min(middle_s * WALKING_M_S, 1.3)
    route = Loop(np.array([0.0, 0.0, -0.05]), LEFT_TO_RIGHT - 0.12, 2.4, 1.5, start_m)
    return Script(stage, (_walker(model, route, rng),))


def _moving_camera(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """The same, seen by a camera that moves."""
    return replace(_table(model, rng, middle_s), moving_camera=True)


def _crossing(
    model: BodyModel, rng: np.random.Generator, middle_s: float, third: bool = False
) -> Script:
    """Two people walk to and fro behind a table; the nearer one hides the other in passing."""
    stage = _stage(rng, _desk(rng, 1.6, 1.55), 3.35)
    start_m = -min(middle_s * WALKING_M_S, 1.2)
    apart_m = 1.2 if third else 0.95
    near = Loop(np.array([0.0, 0.0, 0.1]), LEFT_TO_RIGHT, 2.2, -1.1, start_m)
    far = Loop(np.array([0.0, 0.0, 0.1 - apart_m]), -LEFT_TO_RIGHT, 2.2, -1.1, start_m)
    people = [_walker(model, near, rng), _walker(model, far, rng)]
    if third:
        betas, outfit = draw_look(model, rng)
        arms = draw_arm_poses(model, draw_pose(model, 'standing', rng), 6, rng)
        spot = Place(np.array([-0.3, 0.0, -0.5]), 0.3)
        people.append(
            Performer(PoseToPose(model, betas, spot, arms, Tempo(0.7, 0.5)), outfit, 'reaching'))
    return Script(stage, tuple(people))


def _three(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """Two cross while a third stands between their ways and moves the arms."""
    return _crossing(model, rng, middle_s, third=True)


def _wall(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """One person passes behind a wall that hides everything for more than a second."""
    wall = [box([1.25, 2.3, 0.12], [0.0, 0.0, 0.9], varied((0.8, 0.79, 0.75), rng))]
    stage = _stage(rng, tuple(wall), 3.4)
    start_m = -min(middle_s * WALKING_M_S, 1.5)
    route = Loop(np.array([0.0, 0.0, 0.0]), LEFT_TO_RIGHT, 2.8, 1.4, start_m)
    return Script(stage, (_walker(model, route, rng),))


def _leaving(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """One person walks out of the image on one side, turns there and comes back."""
    stage = _stage(rng, _desk(rng, 1.2, 0.8), 2.8, half_width_m=4.2)
    start_m = -min(middle_s * WALKING_M_S, 0.6)
    route = Loop(np.array([0.0, 0.0, -0.1]), LEFT_TO_RIGHT, 4.2, 1.4, start_m)
    return Script(stage, (_walker(model, route, rng),))


def _turning(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """One person turns round on the spot behind a table, again and again."""
    stage = _stage(rng, _desk(rng, 1.3, 0.85), 2.8)
    route = TurnAround(ON_SPOT, rng.normal(0, 0.3), rest_s=min(0.8, middle_s))
    return Script(stage, (_walker(model, route, rng),))


def _sitting(model: BodyModel, rng: np.random.Generator, middle_s: float) -> Script:
    """One person sits down behind a table and stands up again."""
    betas, outfit = draw_look(model, rng)
    standing = draw_pose(model, 'standing', rng)
    tempo = Tempo(1.3, min(1.2, middle_s))
    spot = Place(ON_SPOT, rng.normal(0, 0.2))
    for _ in range(ATTEMPTS):
        seated = draw_pose(model, 'seated', rng)
        motion = PoseToPose(model, betas, spot, [standing, seated], tempo)
        chair = _chair(model, motion, spot, tempo, rng)
        if chair is not None:
            break
    else:
        raise SceneError(f'expected a pose that fits a chair, found none in {ATTEMPTS}')
    desk = _desk(rng, 1.3, 1.05)
    return Script(_stage(rng, desk + chair, 2.9), (Performer(motion, outfit, 'sitting'),))


def _arms(model: BodyModel, rng: np.random.Generator, _middle_s: float) -> Script:
    """One person stands behind a counter and moves the arms fast; hanging hands are hidden."""
    poses = draw_arm_poses(model, draw_pose(model, 'standing', rng), 8, rng)
    return _at_desk(model, poses, Tempo(0.45, 0.25), rng, height_m=1.0)


def _still(model: BodyModel, rng: np.random.Generator, _middle_s: float) -> Script:
    """One person stands behind a table without moving at all: whatever moves is the method."""
    return _at_desk(model, [draw_pose(model, 'standing', rng)], Tempo(1.0, 1.0), rng)


_SCRIPTS: dict[SequenceKind, Callable[[BodyModel, np.random.Generator, float], Script]] = {
    SequenceKind.TABLE: _table, SequenceKind.CROSSING: _crossing, SequenceKind.THREE: _three,
    SequenceKind.WALL: _wall, SequenceKind.LEAVING: _leaving, SequenceKind.SITTING: _sitting,
    SequenceKind.TURNING: _turning, SequenceKind.ARMS: _arms,
    SequenceKind.CAMERA: _moving_camera, SequenceKind.STILL: _still,
}


def _at_desk(
    model: BodyModel, poses: list[ScenePose], tempo: Tempo, rng: np.random.Generator,
    height_m: float = TABLE_M,
) -> Script:
    betas, outfit = draw_look(model, rng)
    motion = PoseToPose(model, betas, Place(ON_SPOT, rng.normal(0, 0.3)), poses, tempo)
    stage = _stage(rng, _desk(rng, 1.3, 0.85, height_m), 2.8)
    return Script(stage, (Performer(motion, outfit, poses[-1].kind),))


def _walker(model: BodyModel, route: Route, rng: np.random.Generator) -> Performer:
    betas, outfit = draw_look(model, rng)
    return Performer(Walk(model, betas, route, rng.random()), outfit, 'walking')


def _stage(
    rng: np.random.Generator, furniture: tuple[Block, ...], distance_m: float,
    half_width_m: float = 3.4,
) -> Layout:
    """Return an empty room with furniture, and a camera that looks at its middle."""
    room = replace(draw_room(rng), half_width_m=half_width_m, back_m=2.7)
    ranges = CameraRange(focal=(0.82, 0.86), distance_m=(distance_m, distance_m + 0.1),
                         height_m=(1.35, 1.5), aim_m=0.02, roll_deg=0.5)
    camera, T_camera_room = draw_camera(AIM, ranges, rng)
    lamp = np.array([-1.0, room.height_m - 0.2, 1.8])
    return Layout(
        room, (), furniture + draw_clutter(room, rng, 3), camera, T_camera_room, lamp)


def _desk(
    rng: np.random.Generator, width_m: float, z_m: float, height_m: float = TABLE_M
) -> tuple[Block, ...]:
    return moved(bare_table(width_m, 0.7, height_m, rng), np.array([0.0, 0.0, z_m]), 0.0)


def _chair(
    model: BodyModel, motion: Motion, spot: Place, tempo: Tempo, rng: np.random.Generator
) -> tuple[Block, ...] | None:
    """Return the chair that fits a motion's second pose, or None when no chair would."""
    skin: Float[np.ndarray, 'v 3'] = vertices(model, motion(tempo.move_s + tempo.rest_s))
    fit = seat_fit(model, (skin - spot.p) @ yaw_matrix(spot.yaw_rad))
    return None if fit is None else moved(chair_for(fit, rng), spot.p, spot.yaw_rad)
