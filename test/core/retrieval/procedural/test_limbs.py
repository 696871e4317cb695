import numpy as np

from pop_core.geometry.rotation import from_rotvec
from pop_core.retrieval.procedural.limbs import (
    arm_rotation,
    hinge_angle,
    leg_rotation,
    normalised,
    two_bone_directions,
)


def random_directions(n: int, seed: int) -> np.ndarray:
    return normalised(np.random.default_rng(seed).normal(size=(n, 3)))


def test_two_bones_end_where_they_were_sent():
    rng = np.random.default_rng(0)
    lengths = (0.38, 0.43)
    target = random_directions(200, 1) * rng.uniform(0.3, 0.79, (200, 1))
    u, v = two_bone_directions(target, lengths, random_directions(200, 2))
    assert np.allclose(lengths[0] * u + lengths[1] * v, target, atol=1e-9)


def test_the_middle_joint_lies_on_the_side_of_the_pole():
    target, pole = random_directions(200, 3) * 0.5, random_directions(200, 4)
    u, _ = two_bone_directions(target, (0.38, 0.43), pole)
    off_line = u - np.sum(u * target, axis=1, keepdims=True) * target / 0.25
    assert (np.sum(off_line * pole, axis=1) >= -1e-9).all()


def test_targets_out_of_reach_stretch_the_limb_towards_them():
    target = random_directions(50, 5) * 3.0
    u, v = two_bone_directions(target, (0.3, 0.25), random_directions(50, 6))
    end = 0.3 * u + 0.25 * v
    assert np.allclose(normalised(end), target / 3.0, atol=1e-9)
    assert np.allclose(np.linalg.norm(end, axis=1), 0.985 * 0.55)


def test_leg_rotations_point_the_bones():
    u, v = random_directions(300, 7), random_directions(300, 8)
    R, knee = leg_rotation(u, v, random_directions(300, 9))
    down = np.array([0.0, -1.0, 0.0])
    assert np.allclose(R @ down, u, atol=1e-9)
    clear = hinge_angle(u, v) > 0.3  # straighter knees lean on the pole
    assert np.allclose((R @ from_rotvec(knee) @ down)[clear], v[clear], atol=1e-9)
    assert np.allclose(np.linalg.det(R), 1.0)
    assert (knee[:, 0] >= 0).all()


def test_arm_rotations_point_the_bones_of_both_sides():
    u, v = random_directions(300, 10), random_directions(300, 11)
    clear = hinge_angle(u, v) > 0.3
    for sign in (1.0, -1.0):
        R, elbow = arm_rotation(u, v, random_directions(300, 12), sign)
        bone = np.array([sign, 0.0, 0.0])
        assert np.allclose(R @ bone, u, atol=1e-9)
        assert np.allclose((R @ from_rotvec(elbow) @ bone)[clear], v[clear], atol=1e-9)
        assert np.allclose(np.linalg.det(R), 1.0)
        assert (sign * elbow[:, 1] <= 0).all()


def test_straight_limbs_turn_their_hinge_by_the_pole():
    u = np.tile([0.0, -1.0, 0.0], (1, 1))
    R, _ = leg_rotation(u, u.copy(), np.array([[0.0, 0.0, 1.0]]))
    assert np.allclose(R[0], np.eye(3), atol=1e-9)
    u = np.tile([1.0, 0.0, 0.0], (1, 1))
    R, _ = arm_rotation(u, u.copy(), np.array([[0.0, 0.0, -1.0]]), 1.0)
    assert np.allclose(R[0], np.eye(3), atol=1e-9)
