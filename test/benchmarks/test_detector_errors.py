"""What the causes of errors are told apart by."""

import numpy as np
import pytest

from benchmarks.detector_errors import JointErrors
from pop_core.body.joints import SHARED_MIRROR


def person(seed=0):
    return np.random.default_rng(seed).uniform([-0.8, -0.8, 2.5], [0.8, 0.8, 2.9], (15, 3))


def shares(found, truth, seen=None):
    """Return name -> (visible, hidden) as printed; '-' where there are none."""
    errors = JointErrors()
    errors.add(found, truth, np.ones(15, bool) if seen is None else seen, np.ones(15, bool))
    rows = [line.split() for line in errors.text().splitlines()[1:]]
    return {' '.join(row[:-2]): tuple(row[-2:]) for row in rows}


def test_joints_moved_along_their_rays_need_the_true_depth():
    truth = person()
    rows = shares(truth * 1.1, truth)
    assert rows['as found'][0] == '0.00'
    assert rows['given the true depth'][0] == '1.00'
    assert rows['given the true pixel'][0] == '0.00'


def test_joints_moved_aside_need_the_true_pixel():
    truth = person()
    rows = shares(truth + [0.2, 0.0, 0.0], truth)
    assert rows['as found'][0] == '0.00'
    assert rows['given the true pixel'][0] == '1.00'


def test_a_back_taken_for_a_front_needs_to_know_who_faces_the_camera():
    truth = person()
    rows = shares(truth[SHARED_MIRROR], truth)
    assert rows['given who faces the camera'][0] == '1.00'
    assert float(rows['as found'][0]) < 0.5


@pytest.mark.parametrize(('joint', 'name'), [(0, 'pelvis'), (13, 'wrist')])
def test_errors_are_told_by_joint_and_by_distance(joint, name):
    truth = person()
    found = truth.copy()
    found[joint] = np.nan
    rows = shares(found, truth)
    assert float(rows[name][0]) < 1
    assert rows['ankle'][0] == '1.00'
    assert rows['2 to 3 m'][0] == '0.93'
    assert rows['beyond 4 m'] == ('-', '-')


def test_hidden_joints_are_counted_apart():
    truth, seen = person(), np.arange(15) < 7
    found = np.where(seen[:, None], truth, truth + 1.0)
    assert shares(found, truth, seen)['as found'] == ('1.00', '0.00')


def test_without_people_it_says_so():
    assert JointErrors().text() == 'nobody was found'
