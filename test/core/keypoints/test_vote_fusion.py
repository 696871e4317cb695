"""Which votes decide where a joint is, and what the skin before it says."""

import numpy as np
import pytest

from pop_core.body.joints import SHARED_INDEX, SHARED_NAMES
from pop_core.geometry.camera import Camera
from pop_core.keypoints.body_parts import LABEL_OF_CLASS, PART_NAMES
from pop_core.keypoints.depth_masks import no_labels
from pop_core.keypoints.depth_votes import Cells
from pop_core.keypoints.joint_surface import SURFACE_SHARE, joints_with_skin
from pop_core.keypoints.skin_offsets import skin_to_joint_m
from pop_core.keypoints.vote_fusion import BORDERING, VotedPerson, fuse_votes
from pop_core.rgbd import RgbdFrame

VGA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
WRIST, HIP = SHARED_INDEX['left_wrist'], SHARED_INDEX['left_hip']
FOREARM, CHEST = 1 + PART_NAMES.index('left_elbow'), 1 + PART_NAMES.index('spine3')


def two_opinions(visible):
    """Return cells of a chest and of a forearm that place all joints half a metre apart."""
    joints = np.zeros((40, 15, 3)) + [0.0, 0.0, 2.0]
    joints[20:, :, 0] += 0.5
    part = np.zeros((40, 16))
    part[:20, CHEST] = part[20:, FOREARM] = 1.0
    ones = np.ones((40, 15))
    return Cells(np.arange(40), np.arange(40), np.full(40, 1.9), np.full(40, 1e-3),
                 np.full(40, 0.9), part, joints, 0.05 * ones, visible * ones)


def test_cells_of_a_forearm_decide_where_the_seen_wrist_is():
    joints = fuse_votes(two_opinions(visible=1.0)).joints
    assert joints[WRIST, 0] > 0.48
    assert joints[SHARED_INDEX['neck'], 0] < 0.02


def test_all_cells_decide_where_a_hidden_wrist_is():
    joints = fuse_votes(two_opinions(visible=0.0)).joints
    np.testing.assert_allclose(joints[:, 0], 0.25, atol=0.01)


@pytest.mark.parametrize('name', SHARED_NAMES)
def test_parts_end_at_joints_of_their_own_side(name):
    there = [PART_NAMES[k - 1] for k in np.flatnonzero(BORDERING[SHARED_INDEX[name]])]
    assert there
    if name.startswith('left_'):
        assert not any(part.startswith('right_') for part in there)


def person_with_skin(joint_m, skin_at_m, part, owner=0, visible=1.0):
    """Return a person whose joints all stand before the camera, and their depth after."""
    joints = np.tile([0.2, -0.1, joint_m], (15, 1))
    person = VotedPerson(joints, np.full(15, 0.1), np.full(15, visible), 0.9, 0.3, skin_at_m)
    labels = no_labels((480, 640))
    labels.person[:] = owner
    labels.part[:] = LABEL_OF_CLASS[part]
    frame = RgbdFrame(np.zeros((480, 640, 3), np.uint8),
                      np.full((480, 640), skin_at_m, np.float32), VGA)
    return joints, joints_with_skin(person, 0, labels, frame)


def test_a_seen_joint_before_its_skin_moves_toward_its_place_behind_it():
    before, after = person_with_skin(1.8, 2.0, FOREARM)
    wanted = 2.0 + skin_to_joint_m(None)[0][WRIST]
    assert after[WRIST, 2] == pytest.approx(1.8 + SURFACE_SHARE * (wanted - 1.8))
    np.testing.assert_allclose(  # along its ray
        after[WRIST, :2] / after[WRIST, 2], before[WRIST, :2] / before[WRIST, 2])


@pytest.mark.parametrize('case', [{'owner': 1}, {'owner': -1}, {'visible': 0.0},
                                  {'part': CHEST}], ids=str)
def test_other_skin_and_hidden_joints_say_nothing(case):
    before, after = person_with_skin(**({'joint_m': 1.8, 'skin_at_m': 2.0, 'part': FOREARM}
                                        | case))
    np.testing.assert_array_equal(after[WRIST], before[WRIST])


def test_a_forearm_says_nothing_of_the_hip_behind_it():
    before, after = person_with_skin(2.1, 1.8, FOREARM)
    np.testing.assert_array_equal(after[HIP], before[HIP])
