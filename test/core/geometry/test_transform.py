import numpy as np

from pop_core.geometry.rotation import from_rotvec
from pop_core.geometry.transform import invert_transform, make_transform, transform_points


def transforms() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    T_a_b = make_transform(from_rotvec(rng.normal(size=3)), rng.normal(size=3))
    T_b_c = make_transform(from_rotvec(rng.normal(size=3)), rng.normal(size=3))
    return T_a_b, T_b_c


def test_equal_letters_meet() -> None:
    T_a_b, T_b_c = transforms()
    p_c = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(
        transform_points(T_a_b @ T_b_c, p_c),
        transform_points(T_a_b, transform_points(T_b_c, p_c)), atol=1e-12)


def test_the_inverse_undoes() -> None:
    T_a_b, _ = transforms()
    np.testing.assert_allclose(invert_transform(T_a_b) @ T_a_b, np.eye(4), atol=1e-12)


def test_a_translation_moves_the_origin() -> None:
    T_a_b = make_transform(np.eye(3), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(transform_points(T_a_b, np.zeros((1, 3))), [[1.0, 2.0, 3.0]])
