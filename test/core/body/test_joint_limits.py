import numpy as np

from pop_core.body.joint_limits import (
    BODY_MIRROR,
    LOWER,
    TWIST_AXES,
    UPPER,
    limit_excess,
    mirrored_pose,
    pose_coordinates,
)
from pop_core.body.joints import JOINT_INDEX
from pop_core.geometry.swing_twist import from_swing_twist


def pose_with(name: str, rotvec: list[float]) -> np.ndarray:
    pose = np.zeros((23, 3))
    pose[JOINT_INDEX[name] - 1] = rotvec
    return pose


def excess(pose: np.ndarray) -> np.ndarray:
    return limit_excess(pose_coordinates(pose))


def test_poses_within_the_limits_cost_nothing():
    rng = np.random.default_rng(0)
    for _ in range(20):
        c = LOWER + (UPPER - LOWER) * rng.uniform(0.02, 0.98, (23, 3))
        assert not excess(from_swing_twist(c, TWIST_AXES)).any()


def test_knee_may_bend_back_and_not_forward():
    assert not excess(pose_with('left_knee', [1.8, 0, 0])).any()
    assert excess(pose_with('left_knee', [-0.8, 0, 0])).any()


def test_elbows_may_bend_forward_and_not_back():
    for name, sign in (('left_elbow', -1), ('right_elbow', 1)):
        assert not excess(pose_with(name, [0, sign * 2.0, 0])).any()
        assert excess(pose_with(name, [0, -sign * 0.8, 0])).any()


def test_limits_are_their_own_mirror():
    rng = np.random.default_rng(1)
    pose = rng.normal(size=(23, 3)) * 0.8
    cost = np.sum(excess(pose) ** 2)
    assert cost > 0
    assert np.isclose(np.sum(excess(mirrored_pose(pose)) ** 2), cost)


def test_mirror_twice_is_the_pose_itself():
    pose = np.random.default_rng(2).normal(size=(5, 23, 3))
    assert np.allclose(mirrored_pose(mirrored_pose(pose)), pose)
    assert np.array_equal(BODY_MIRROR[BODY_MIRROR], np.arange(23))


def test_residual_is_the_signed_excess():
    c = np.clip(np.zeros((23, 3)), LOWER, UPPER)
    c[3, 0] = UPPER[3, 0] + 0.2
    c[17, 1] = LOWER[17, 1] - 0.1
    r = excess(from_swing_twist(c, TWIST_AXES))
    assert np.isclose(r[3, 0], 0.2)
    assert np.isclose(r[17, 1], -0.1)
    assert np.count_nonzero(np.abs(r) > 1e-9) == 2


def test_coordinates_of_rest_are_zero():
    assert not pose_coordinates(np.zeros((23, 3))).any()
