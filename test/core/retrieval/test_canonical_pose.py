import numpy as np

from pop_core.body.joint_limits import LOWER, UPPER, pose_coordinates
from pop_core.body.joints import JOINT_INDEX
from pop_core.geometry.rotation import from_rotvec
from pop_core.retrieval.canonical_pose import canonical_pose, hinge_elbows, spread_spine


def forearm_directions(body_pose: np.ndarray, side: str, bone: float) -> np.ndarray:
    shoulder, elbow = (JOINT_INDEX[f'{side}_{name}'] - 1 for name in ('shoulder', 'elbow'))
    R = from_rotvec(body_pose[:, shoulder]) @ from_rotvec(body_pose[:, elbow])
    return R @ np.array([bone, 0.0, 0.0])


def random_poses(n: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, 23, 3)) * 0.7


def test_hinged_elbows_leave_every_forearm_where_it_was():
    poses = random_poses(100, 0)
    for side, bone in (('left', 1.0), ('right', -1.0)):
        before, after = (
            forearm_directions(p, side, bone) for p in (poses, hinge_elbows(poses)))
        assert np.allclose(before, after, atol=1e-9)


def test_bent_elbows_come_to_bend_about_the_hinge():
    coordinates = pose_coordinates(random_poses(200, 1))
    bent = np.hypot(coordinates[:, 17, 1], coordinates[:, 17, 2]) > 0.4
    hinged = pose_coordinates(hinge_elbows(random_poses(200, 1)))[bent, 17]
    assert bent.sum() > 50
    assert np.allclose(hinged[:, 2], 0, atol=1e-9)
    assert (hinged[:, 1] < 0).all()


def test_spread_spine_keeps_the_direction_of_the_chest():
    poses = random_poses(50, 2)
    spine = [JOINT_INDEX[f'spine{i}'] - 1 for i in (1, 2, 3)]

    def chest(body_pose: np.ndarray) -> np.ndarray:
        R = from_rotvec(body_pose[:, spine])
        return R[:, 0] @ R[:, 1] @ R[:, 2]

    assert np.allclose(chest(poses), chest(spread_spine(poses)), atol=1e-9)


def test_canonical_poses_lie_within_the_limits_and_stay_there():
    poses = canonical_pose(random_poses(100, 3))
    coordinates = pose_coordinates(poses)
    assert (coordinates >= LOWER - 1e-9).all()
    assert (coordinates <= UPPER + 1e-9).all()
    again = canonical_pose(poses)
    shoulders = [JOINT_INDEX['left_shoulder'] - 1, JOINT_INDEX['right_shoulder'] - 1]
    legs = [JOINT_INDEX[f'{side}_{name}'] - 1 for side in ('left', 'right')
            for name in ('hip', 'knee', 'ankle')]
    assert np.allclose(pose_coordinates(again)[:, legs], coordinates[:, legs], atol=1e-9)
    assert np.isfinite(again[:, shoulders]).all()
