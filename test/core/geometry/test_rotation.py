import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pop_core.geometry.rotation import (
    from_rotvec,
    left_jacobian_inverse,
    nearest_rotation,
    to_quat_xyzw,
    to_rotvec,
)
from pop_core.geometry.rotation_kernels import products


@pytest.fixture
def rotvecs() -> np.ndarray:
    rng = np.random.default_rng(0)
    axis = rng.normal(size=(200, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    # Every magnitude that breaks a formula: zero, tiny, ordinary, and just below a half turn.
    angle = np.concatenate([np.zeros(1), 10.0 ** rng.uniform(-12, -3, 50),
                            rng.uniform(0, np.pi, 100), np.pi - 10.0 ** rng.uniform(-9, -2, 49)])
    return axis * angle[:, None]


def test_exponential_agrees_with_scipy(rotvecs: np.ndarray) -> None:
    expected = Rotation.from_rotvec(rotvecs).as_matrix()
    np.testing.assert_allclose(from_rotvec(rotvecs), expected, atol=1e-14)


def test_logarithm_undoes_the_exponential(rotvecs: np.ndarray) -> None:
    # Close to a half turn the matrix holds the angle only to the square root of rounding.
    np.testing.assert_allclose(to_rotvec(from_rotvec(rotvecs)), rotvecs, atol=3e-8)


def test_quaternions_are_unit_and_agree_with_scipy(rotvecs: np.ndarray) -> None:
    quat = to_quat_xyzw(from_rotvec(rotvecs))
    np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1.0)
    np.testing.assert_allclose(Rotation.from_quat(quat).as_matrix(), from_rotvec(rotvecs),
                               atol=1e-12)


def test_left_jacobian_inverse_is_the_derivative_of_the_logarithm() -> None:
    rng = np.random.default_rng(1)
    rotvec = rng.normal(size=(20, 3)) * 0.9
    step = 1e-6
    for axis in np.eye(3):
        turned = from_rotvec(np.tile(step * axis, (20, 1))) @ from_rotvec(rotvec)
        back = from_rotvec(np.tile(-step * axis, (20, 1))) @ from_rotvec(rotvec)
        numeric = (to_rotvec(turned) - to_rotvec(back)) / (2 * step)
        np.testing.assert_allclose(left_jacobian_inverse(rotvec) @ axis, numeric, atol=1e-7)


def test_nearest_rotation_of_a_rotation_is_itself_and_never_a_reflection() -> None:
    R = from_rotvec(np.array([0.3, -0.4, 1.0]))
    np.testing.assert_allclose(nearest_rotation(R), R, atol=1e-14)
    assert np.linalg.det(nearest_rotation(-R)) == pytest.approx(1.0)


def test_products_are_those_of_matrices_also_of_transposed_ones() -> None:
    rng = np.random.default_rng(2)
    first, second = rng.normal(size=(2, 5, 3, 3))
    np.testing.assert_allclose(products(first, second), first @ second, atol=1e-14)
    turned = second.transpose(0, 2, 1)
    np.testing.assert_allclose(products(first, turned), first @ turned, atol=1e-14)
