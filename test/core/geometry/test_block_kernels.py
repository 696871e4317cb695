import numpy as np

from pop_core.geometry.block_kernels import sandwich


def test_a_sandwich_is_the_product_of_whole_matrices() -> None:
    rng = np.random.default_rng(0)
    half, blocks = rng.normal(size=(12, 12)), rng.normal(size=(2, 3, 3))
    matrix = half @ half.T
    whole = np.eye(12)
    whole[4:7, 4:7], whole[7:10, 7:10] = blocks
    np.testing.assert_allclose(sandwich(matrix, blocks, 4), whole.T @ matrix @ whole, atol=1e-12)
