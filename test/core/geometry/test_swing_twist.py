import numpy as np
import pytest

from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.geometry.swing_twist import (
    from_swing_twist,
    swing_twist_jacobian,
    to_swing_twist,
)

AXES = np.array([0, 1, 2, 1])


def random_coordinates(n: int, seed: int = 0, reach: float = 2.6) -> np.ndarray:
    rng = np.random.default_rng(seed)
    c = rng.uniform(-1, 1, (n, len(AXES), 3))
    for joint, k in enumerate(AXES):
        swing = np.delete(np.arange(3), k)
        length = np.linalg.norm(c[:, joint][:, swing], axis=1, keepdims=True)
        c[:, joint, swing[0]] *= (rng.uniform(0, reach, (n, 1)) / length)[:, 0]
        c[:, joint, swing[1]] *= (rng.uniform(0, reach, (n, 1)) / length)[:, 0]
        too_long = np.maximum(np.linalg.norm(c[:, joint][:, swing], axis=1) / reach, 1.0)
        c[:, joint, swing[0]] /= too_long
        c[:, joint, swing[1]] /= too_long
        c[:, joint, k] = rng.uniform(-3.1, 3.1, n)
    return c


def test_coordinates_return_from_their_rotation():
    c = random_coordinates(200)
    assert np.allclose(to_swing_twist(from_swing_twist(c, AXES), AXES), c, atol=1e-9)


def test_rotation_returns_from_its_coordinates():
    rng = np.random.default_rng(1)
    axis = rng.normal(size=(200, 4, 3))
    rotvec = axis / np.linalg.norm(axis, axis=-1, keepdims=True) * rng.uniform(0, 3, (200, 4, 1))
    back = from_swing_twist(to_swing_twist(rotvec, AXES), AXES)
    assert np.allclose(from_rotvec(back), from_rotvec(rotvec), atol=1e-9)


@pytest.mark.parametrize('k', [0, 1, 2])
def test_rotation_is_swing_after_twist_about_the_axis(k):
    c = random_coordinates(1, seed=2)[0, :1]
    swing = c[0].copy()
    swing[k] = 0
    twist = np.eye(3)[k] * c[0, k]
    expected = from_rotvec(swing) @ from_rotvec(twist)
    found = from_rotvec(from_swing_twist(c[None], np.array([k])))[0, 0]
    assert np.allclose(found, expected, atol=1e-12)


def test_small_rotations_equal_their_rotation_vector():
    small = np.random.default_rng(3).normal(size=(10, 4, 3)) * 1e-6
    assert np.allclose(to_swing_twist(small, AXES), small, atol=1e-11)


def test_half_turn_of_a_bone_gives_finite_coordinates():
    c = to_swing_twist(np.array([[[0.0, np.pi, 0.0]]]), np.array([0]))
    assert np.allclose(np.abs(c), [[[0.0, np.pi, 0.0]]], atol=1e-6)


def test_jacobian_agrees_with_central_differences():
    step = 1e-6
    for c in [*random_coordinates(20, seed=4, reach=2.4), np.zeros((4, 3)),
              np.full((4, 3), 1e-5)]:
        R = from_rotvec(from_swing_twist(c, AXES))
        numeric = np.empty((4, 3, 3))
        for k in range(3):
            delta = np.eye(3)[k] * step
            ahead = to_swing_twist(to_rotvec(from_rotvec(delta) @ R), AXES)
            behind = to_swing_twist(to_rotvec(from_rotvec(-delta) @ R), AXES)
            wrapped = np.angle(np.exp(1j * (ahead - behind)))
            numeric[:, :, k] = wrapped / (2 * step)
        found = swing_twist_jacobian(c, AXES)
        # Central differences lose half the digits, more where the swing nears pi.
        assert np.allclose(found, numeric, atol=2e-5, rtol=1e-5)
