"""Angles of REP-155's human turn its links to where the fitted body's limbs point.

The twin is the chain of joints of the public model (axes of human_description), walked joint by
joint.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.estimates import estimate

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joint_rotations, joints
from pop_core.body.model import rest_parameters
from pop_ros.interop_hri_joints import STRAIGHT_RAD, joint_angles, link_frames

DOWN = np.array([0.0, 0.0, -1.0])
MINUS_Y = (0, -1, 0)


def chain(angles: dict[str, float], *steps: tuple[str, tuple[float, float, float]]) -> Rotation:
    turn = Rotation.identity()
    for name, axis in steps:
        turn = turn * Rotation.from_rotvec(angles[name] * np.array(axis, float))
    return turn


def torso(angles: dict[str, float]) -> Rotation:
    return chain(angles, ('waist', (0, 1, 0)))


def limbs(angles: dict[str, float]) -> dict[str, np.ndarray]:
    """Return the direction of each limb in the body's frame, by the joints of its ends."""
    found = {}
    for side, word, sign in (('l', 'left', 1), ('r', 'right', -1)):
        arm = torso(angles) * chain(
            angles, (f'{side}_y_shoulder', (0, 0, -sign)), (f'{side}_p_shoulder', (sign, 0, 0)),
            (f'{side}_r_shoulder', (0, 0, sign)))
        leg = chain(angles, (f'{side}_y_hip', (0, 0, -1)), (f'{side}_p_hip', (sign, 0, 0)),
                    (f'{side}_r_hip', MINUS_Y))
        for upper, top, middle, end in (
                (arm, 'shoulder', 'elbow', 'wrist'), (leg, 'hip', 'knee', 'ankle')):
            hinge = chain(angles, (f'{side}_{middle}', MINUS_Y))
            found[f'{word}_{top}', f'{word}_{middle}'] = upper.apply(DOWN)
            found[f'{word}_{middle}', f'{word}_{end}'] = (upper * hinge).apply(DOWN)
    return found


@pytest.mark.parametrize('seed', range(8))
def test_every_limb_and_the_head_point_where_the_fitted_ones_do(seed: int) -> None:
    body = estimate(default_body(), seed)
    angles = joint_angles(body.joints, body.joint_rotations)
    frames = link_frames(body.joints, body.joint_rotations)
    R_body = frames['body'][1]
    for (start, end), direction in limbs(angles).items():
        bone = body.joints[JOINT_INDEX[end]] - body.joints[JOINT_INDEX[start]]
        # About which axis a straight limb bends nobody can tell: its own bend is the error.
        bend = abs(angles.get(f'{start[0]}_{start.split("_")[1]}', 1.0))
        atol = bend if bend < STRAIGHT_RAD else 1e-9
        np.testing.assert_allclose(
            R_body @ direction, bone / np.linalg.norm(bone), atol=atol, err_msg=f'{start} {end}')
    head = torso(angles) * chain(
        angles, ('r_head', (1, 0, 0)), ('y_head', (0, 0, 1)), ('p_head', MINUS_Y))
    np.testing.assert_allclose(R_body @ head.as_matrix(), frames['head'][1], atol=1e-9)
    assert angles['l_elbow'] >= 0 >= angles['l_knee']
    assert min(angles['l_p_shoulder'], angles['r_p_shoulder']) >= 0


def test_a_standing_person_has_x_forward_z_up_and_both_arms_lifted_alike_in_a_t_pose() -> None:
    model = default_body()
    pose = rest_parameters(model.n_betas)
    at, turn = joints(model, pose), joint_rotations(model, pose)
    place, R_body = link_frames(at, turn)['body']
    # SMPL's T-pose: y up, facing +z.
    np.testing.assert_allclose(R_body, [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-12)
    hips = at[[JOINT_INDEX['left_hip'], JOINT_INDEX['right_hip']]]
    np.testing.assert_allclose(place, hips.mean(axis=0))
    angles = joint_angles(at, turn)
    assert abs(angles['l_p_shoulder'] - angles['r_p_shoulder']) < 0.02
    assert 1.2 < angles['l_p_shoulder'] < 1.9
    assert max(abs(angles[name]) for name in ('waist', 'y_head', 'l_r_hip', 'r_knee')) < 0.3


def test_links_of_hanging_and_spread_arms_run_along_minus_z() -> None:
    body = estimate(default_body(), 2)
    frames = link_frames(body.joints, body.joint_rotations)
    for side in 'lr':
        for link, following in (('shoulder', 'elbow'), ('hip', 'knee'), ('knee', 'ankle')):
            place, R = frames[f'{side}_{link}']
            bone = frames[f'{side}_{following}'][0] - place
            # Bones of a person at rest are not perfectly straight.
            assert (R @ DOWN) @ bone > 0.97 * np.linalg.norm(bone)
