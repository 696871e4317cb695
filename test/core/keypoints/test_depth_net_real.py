"""The embedded network on real frames; skipped where the shared data is not there."""

import numpy as np
import pytest
from support.real_frames import SOFA, load

from pop_core.keypoints.depth_net import load_depth_net
from pop_core.keypoints.depth_network import EMBEDDED
from pop_core.rgbd import RgbdFrame


@pytest.fixture(scope='module')
def detector():
    return load_depth_net()


def test_the_embedded_network_is_small_enough_to_ship():
    assert EMBEDDED.stat().st_size < 8e6


def test_five_people_are_five_each_with_a_mask_of_their_own(detector):
    frame = load('five_people')
    people = detector.detect(frame)
    assert len(people) == 5
    assert (np.sum([person.person_mask for person in people], axis=0) <= 1).all()
    for person in people:
        share = np.isfinite(frame.depth_m[person.person_mask]).mean()
        assert share == 1.0
        assert 1.4 < np.nanmedian(person.joint_depth_m) < 3.4


def test_an_empty_office_holds_nobody(detector):
    assert detector.detect(load('office_empty')) == []


@pytest.mark.parametrize('number', SOFA)
def test_one_man_sits_on_the_sofa(detector, number):
    frame = load(f'sofa_pointing/{number}')
    people = detector.detect(frame)
    assert len(people) == 1
    neck, pelvis = people[0].keypoints_px[[7, 0]]
    assert 200 < neck[0] < 380
    assert neck[1] < pelvis[1]


def test_colours_do_not_matter(detector):
    frame = load('five_people')
    dark = RgbdFrame(np.zeros_like(frame.rgb), frame.depth_m, frame.camera, frame.stamp_ns)
    for first, second in zip(detector.detect(frame), detector.detect(dark), strict=True):
        np.testing.assert_array_equal(first.keypoints_px, second.keypoints_px)
