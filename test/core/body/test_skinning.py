"""Skinning against an independent slow twin, and Jacobians against central differences."""

import numpy as np
from scipy.spatial.transform import Rotation

from pop_core.body.joints import N_JOINTS, PARENTS
from pop_core.body.kinematics import (
    attached_jacobian,
    attached_positions,
    increment,
    joints,
    joints_jacobian,
    pose_skeleton,
)
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.body.skinning import SkinningSubset, vertices
from pop_core.geometry.rotation import from_rotvec, to_rotvec

STEP = 1e-5


def slow_vertices(model: BodyModel, q: BodyParameters) -> np.ndarray:
    """4x4 matrices, one vertex at a time, as in the SMPL paper."""
    shaped = model.v_template + np.einsum('vcb,b->vc', model.shapedirs, q.betas)
    rest = model.J_regressor @ shaped
    rotvecs = np.vstack([q.global_orient, q.body_pose])
    A = []
    for j in range(N_JOINTS):
        local = np.eye(4)
        local[:3, :3] = Rotation.from_rotvec(rotvecs[j]).as_matrix()
        local[:3, 3] = rest[j] - (rest[PARENTS[j]] if j else 0)
        A.append(local if j == 0 else A[PARENTS[j]] @ local)
    out = np.zeros_like(shaped)
    for v, point in enumerate(shaped):
        for j in range(N_JOINTS):
            at_joint = np.append(point - rest[j], 1.0)
            out[v] += model.weights[v, j] * (A[j] @ at_joint)[:3]
    return q.scale * out + q.transl


def central_differences(model: BodyModel, q: BodyParameters, of: object) -> np.ndarray:
    skeleton = pose_skeleton(model, q)
    columns = []
    for k in range(3 + 72 + model.n_betas + 1):
        step = np.zeros(3 + 72 + model.n_betas + 1)
        step[k] = STEP
        ahead, behind = increment(q, step, skeleton), increment(q, -step, skeleton)
        columns.append((of(ahead) - of(behind)) / (2 * STEP))
    return np.stack(columns, axis=-1)


def test_skinning_agrees_with_the_slow_twin(
    random_model: BodyModel, random_parameters: BodyParameters
) -> None:
    expected = slow_vertices(random_model, random_parameters)
    np.testing.assert_allclose(vertices(random_model, random_parameters), expected, atol=1e-12)


def test_vertex_jacobian_is_the_derivative(
    random_model: BodyModel, random_parameters: BodyParameters
) -> None:
    n = len(random_model.v_template)
    direction = np.random.default_rng(2).normal(size=(n, 3))
    skeleton = pose_skeleton(random_model, random_parameters)
    skin = SkinningSubset(random_model)
    rest = skin.shaped(random_parameters, skeleton)
    J = skin.directional_jacobian(rest, random_parameters, skeleton, np.arange(n), direction)
    numeric = central_differences(
        random_model, random_parameters,
        lambda q: np.einsum('vc,vc->v', vertices(random_model, q), direction))
    np.testing.assert_allclose(J, numeric, atol=1e-8)


def test_landmark_jacobian_is_the_derivative(
    random_model: BodyModel, random_parameters: BodyParameters
) -> None:
    points = shared_points(random_model)
    skeleton = pose_skeleton(random_model, random_parameters)
    J = attached_jacobian(points, random_model, random_parameters, skeleton)
    numeric = central_differences(
        random_model, random_parameters,
        lambda q: attached_positions(points, random_model, q))
    np.testing.assert_allclose(J, numeric, atol=1e-8)


def test_joint_jacobian_is_the_derivative(
    random_model: BodyModel, random_parameters: BodyParameters
) -> None:
    skeleton = pose_skeleton(random_model, random_parameters)
    J = joints_jacobian(random_model, random_parameters, skeleton)
    numeric = central_differences(
        random_model, random_parameters, lambda q: joints(random_model, q))
    np.testing.assert_allclose(J, numeric, atol=1e-8)


def test_rest_pose_is_the_template(random_model: BodyModel) -> None:
    rest = BodyParameters(np.zeros(3), np.zeros(3), np.zeros((23, 3)), np.zeros(10))
    np.testing.assert_allclose(
        vertices(random_model, rest), random_model.v_template, atol=1e-12)


def test_turning_the_root_turns_everything_about_it(
    random_model: BodyModel, random_parameters: BodyParameters
) -> None:
    turn = Rotation.from_rotvec([0.2, -0.5, 0.9])
    orient = (turn * Rotation.from_rotvec(random_parameters.global_orient)).as_rotvec()
    turned = random_parameters.replaced(global_orient=orient)
    root = joints(random_model, random_parameters)[0]
    expected = turn.apply(vertices(random_model, random_parameters) - root) + root
    np.testing.assert_allclose(vertices(random_model, turned), expected, atol=1e-12)


def test_trees_are_shaped_then_posed_and_steps_turn_from_the_left(
    random_model: BodyModel, random_parameters: BodyParameters
) -> None:
    q, skeleton = random_parameters, pose_skeleton(random_model, random_parameters)
    R_local = from_rotvec(np.vstack([q.global_orient, q.body_pose]))
    np.testing.assert_allclose(skeleton.R_local, R_local, atol=1e-12)
    np.testing.assert_allclose(
        skeleton.rest_joints,
        random_model.joint_template + random_model.joint_shapedirs @ q.betas, atol=1e-12)
    step = np.random.default_rng(6).normal(size=86)
    moved = increment(q, step, skeleton)
    expected = to_rotvec(from_rotvec(step[3:75].reshape(24, 3)) @ R_local)
    np.testing.assert_allclose(
        np.vstack([moved.global_orient, moved.body_pose]), expected, atol=1e-9)
