import numpy as np

from pop_core.retrieval.pruning import PoseThinner, nearest_distances


def clouds(n: int, seed: int = 0, spread: float = 0.03) -> np.ndarray:
    rng = np.random.default_rng(seed)
    base = rng.normal(size=(12, 15, 3)) * 0.3
    return (base[rng.integers(0, 12, n)] + rng.normal(size=(n, 15, 3)) * spread).astype(np.float32)


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a[:, None] - b[None], axis=3).mean(axis=2)


def test_kept_poses_are_those_of_the_slow_twin():
    joints, spacing = clouds(600), 0.06
    kept: list[int] = []
    for i in range(len(joints)):
        if not kept or distances(joints[[i]], joints[kept]).min() > spacing:
            kept.append(i)
    thinner = PoseThinner(joints, spacing, 600)
    assert 50 < len(kept) < 550
    assert thinner.accept(joints).tolist() == kept


def test_batches_know_of_the_batches_before():
    joints = clouds(600, seed=1)
    whole = PoseThinner(joints, 0.06, 600).accept(joints)
    parts = PoseThinner(joints, 0.06, 600)
    first, second = parts.accept(joints[:250]), parts.accept(joints[250:])
    assert np.array_equal(np.concatenate([first, 250 + second]), whole)


def test_every_pose_is_near_a_kept_one():
    joints = clouds(800, seed=2)
    kept = joints[PoseThinner(joints, 0.07, 800).accept(joints)]
    assert nearest_distances(joints, kept).max() <= 0.07 + 1e-6


def test_poses_far_outside_the_sample_are_still_compared():
    sample = clouds(300, seed=3)
    far = sample[:20] + 5.0
    thinner = PoseThinner(sample, 0.01, 100)
    assert len(thinner.accept(far)) == 20
    assert len(thinner.accept(far)) == 0


def test_no_more_than_wanted_are_kept():
    thinner = PoseThinner(clouds(300), 1e-4, 40)
    assert len(thinner.accept(clouds(300))) == 40
    assert thinner.full


def test_nearest_distances_equal_brute_force():
    a, b = clouds(30, seed=4), clouds(200, seed=5)
    assert np.allclose(nearest_distances(a, b), distances(a, b).min(axis=1), atol=1e-6)
