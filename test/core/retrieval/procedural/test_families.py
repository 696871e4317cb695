import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.body.joint_limits import LOWER, UPPER, pose_coordinates
from pop_core.body.joints import SHARED_INDEX
from pop_core.retrieval.pose_library import pose_columns
from pop_core.retrieval.procedural.clearance import limbs_clear
from pop_core.retrieval.procedural.families import FAMILIES, DrawnPoses, draw_batch


def draw(name: str, seed: int = 0, batches: int = 6) -> DrawnPoses:
    rng = np.random.default_rng(seed)
    parts = [draw_batch(FAMILIES[name], default_body(), rng, 64) for _ in range(batches)]
    return DrawnPoses(
        np.concatenate([p.body_pose for p in parts]), np.concatenate([p.tilt for p in parts]))


def joints_of(poses: DrawnPoses) -> dict[str, np.ndarray]:
    columns = pose_columns(poses.body_pose, poses.tilt, default_body())
    return {name: columns[row].T for name, row in SHARED_INDEX.items()}


@pytest.mark.parametrize('name', FAMILIES)
def test_every_family_stays_within_limits_and_out_of_itself(name):
    poses = draw(name)
    assert len(poses.tilt) > 50
    c = pose_coordinates(poses.body_pose)
    assert (c >= LOWER - 1e-9).all()
    assert (c <= UPPER + 1e-9).all()
    columns = pose_columns(poses.body_pose, poses.tilt, default_body())
    assert limbs_clear(columns.transpose(2, 0, 1).copy()).all()


@pytest.mark.parametrize('name', FAMILIES)
def test_every_family_is_decided_by_its_seed(name):
    assert np.array_equal(draw(name, 3, 2).body_pose, draw(name, 3, 2).body_pose)


@pytest.mark.parametrize('name', FAMILIES)
def test_every_family_does_things_with_either_side(name):
    wrists = joints_of(draw(name, 5, 16))
    left, right = wrists['left_wrist'], wrists['right_wrist'] * [-1.0, 1.0, 1.0]
    assert np.linalg.norm(left.mean(axis=0) - right.mean(axis=0)) < 0.12


def test_people_stand_on_their_feet():
    for name in ('standing', 'walking', 'crouching', 'bending'):
        joints = joints_of(draw(name))
        feet = np.maximum(joints['left_ankle'][:, 1], joints['right_ankle'][:, 1])
        assert (feet < -0.15).all(), name


def test_seated_thighs_lie_and_shins_hang():
    joints = joints_of(draw('sitting'))
    for side in ('left', 'right'):
        thigh = joints[f'{side}_knee'] - joints[f'{side}_hip']
        assert (thigh[:, 2] > 0.15).all()
        assert np.median(np.abs(thigh[:, 1])) < 0.12
        assert np.median(joints[f'{side}_ankle'][:, 1] - joints[f'{side}_knee'][:, 1]) < -0.3


def test_kneeling_shins_lie_behind_the_knees():
    joints = joints_of(draw('kneeling'))
    for side in ('left', 'right'):
        shin = joints[f'{side}_ankle'] - joints[f'{side}_knee']
        assert (shin[:, 2] < -0.2).all()


def test_lying_trunks_are_level():
    joints = joints_of(draw('lying'))
    rise = joints['neck'][:, 1] - joints['pelvis'][:, 1]
    assert np.abs(rise).max() < 0.4
    assert np.median(np.abs(rise)) < 0.15


def test_a_forearm_through_the_belly_is_not_clear():
    poses = draw('standing', batches=1)
    joints = pose_columns(poses.body_pose, poses.tilt, default_body()).transpose(2, 0, 1).copy()
    assert limbs_clear(joints).all()
    joints[:, SHARED_INDEX['left_wrist']] = joints[:, SHARED_INDEX['pelvis']] + [0, 0.2, 0]
    assert not limbs_clear(joints).any()
