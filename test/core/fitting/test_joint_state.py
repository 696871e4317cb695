import numpy as np
from support.one_person import CAMERA, photograph

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.estimate import JointState
from pop_core.fitting.joint_state import fitted_joint_states
from pop_core.rendering.depth_renderer import render_depth


def states(body: BodyModel, person: BodyParameters, depth_m: np.ndarray) -> np.ndarray:
    rendered = render_depth(vertices(body, person), body.f, CAMERA)
    return fitted_joint_states(body, joints(body, person), rendered, depth_m, CAMERA)


def test_everything_in_front_view_is_visible(body: BodyModel, person: BodyParameters) -> None:
    state = states(body, person, photograph(body, person).depth_m)
    assert (state == JointState.VISIBLE).mean() > 0.9


def test_a_counter_hides_what_lies_behind_it(body: BodyModel, person: BodyParameters) -> None:
    depth = photograph(body, person).depth_m.copy()
    depth[150:] = 1.5
    state = states(body, person, depth)
    below = CAMERA.project(joints(body, person))[:, 1] > 152
    inside = state != JointState.OUT_OF_IMAGE
    assert (state[below & inside] == JointState.SCENE_OCCLUDED).all()
    assert state[JOINT_INDEX['head']] == JointState.VISIBLE


def test_a_person_from_the_side_hides_the_far_arm(
    body: BodyModel, person: BodyParameters
) -> None:
    turn = np.array([np.pi / np.sqrt(2), 0.0, np.pi / np.sqrt(2)])  # facing sideways
    aside = person.replaced(global_orient=turn)
    state = states(body, aside, photograph(body, aside).depth_m)
    p = joints(body, aside)
    sides = [JOINT_INDEX['left_elbow'], JOINT_INDEX['right_elbow']]
    far, near = sorted(sides, key=lambda j: -p[j, 2])
    assert state[near] == JointState.VISIBLE
    assert state[far] == JointState.SELF_OCCLUDED


def test_missing_depth_is_unknown_and_outside_is_outside(
    body: BodyModel, person: BodyParameters
) -> None:
    nothing = np.full((CAMERA.height, CAMERA.width), np.nan, dtype=np.float32)
    assert set(states(body, person, nothing)) <= {JointState.UNKNOWN, JointState.OUT_OF_IMAGE}
    gone = person.replaced(transl=person.transl + [9.0, 0.0, 0.0])
    assert (states(body, gone, nothing) == JointState.OUT_OF_IMAGE).all()
