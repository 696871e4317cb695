"""A region of interest: people inside are kept, those outside are not."""

from dataclasses import replace

import numpy as np
import pytest

from pop_core.errors import SettingError
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.region import RegionConfig, is_inside
from pop_core.settings import apply_settings, list_settings

AXES = (('x_min_m', 'x_max_m'), ('y_min_m', 'y_max_m'), ('z_min_m', 'z_max_m'))


def person(place: np.ndarray, uv: tuple[float, float] = (320.0, 240.0)) -> LiftedJoints:
    rng = np.random.default_rng(3)
    offsets = rng.uniform(-0.3, 0.3, (15, 3))
    offsets -= np.median(offsets, axis=0)
    return LiftedJoints(
        place + offsets, np.full(15, 0.02), np.zeros(15, dtype=np.int64),
        np.tile(np.array(uv, dtype=np.float64), (15, 1)), np.ones(15))


def test_everybody_is_inside_unless_told_otherwise() -> None:
    for place in ([0.0, 0.0, 0.5], [-60.0, 20.0, 99.0]):
        assert is_inside(person(np.array(place)), RegionConfig())


@pytest.mark.parametrize('axis', range(3))
def test_the_box_ends_where_its_sides_are(axis: int) -> None:
    low, high = AXES[axis]
    region = replace(RegionConfig(), **{low: 2.0, high: 3.0})
    for value, inside in ((1.99, False), (2.01, True), (2.99, True), (3.01, False)):
        place = np.array([0.0, 0.0, 2.5])
        place[axis] = value
        assert is_inside(person(place), region) == inside


@pytest.mark.parametrize(('uv', 'inside'), [
    ((100, 50), True), ((99, 50), False), ((201, 90), False), ((150, 49), False),
    ((150, 121), False), ((200, 120), True)])
def test_the_rectangle_ends_where_its_sides_are(uv: tuple[int, int], inside: bool) -> None:
    region = RegionConfig(left_px=100, right_px=200, top_px=50, bottom_px=120)
    assert is_inside(person(np.array([0.0, 0.0, 2.0]), uv), region) == inside


def test_joints_on_something_else_do_not_move_a_person_out() -> None:
    joints = person(np.array([0.0, 0.0, 2.0]))
    joints.positions_camera[:4, 2] = 7.0
    assert is_inside(joints, RegionConfig(z_max_m=2.5))


def test_nobody_is_inside_without_a_lifted_joint() -> None:
    joints = person(np.array([0.0, 0.0, 2.0]))
    joints.positions_camera[:] = np.nan
    assert not is_inside(joints, RegionConfig())


@pytest.mark.parametrize('sides', [*AXES, ('left_px', 'right_px'), ('top_px', 'bottom_px')])
def test_a_region_inside_out_is_refused_by_name(sides: tuple[str, str]) -> None:
    low, high = sides
    kinds = {item.name: type(item.default) for item in list_settings(RegionConfig())}
    values = {low: kinds[low](9), high: kinds[high](3)}
    with pytest.raises(SettingError, match=f'expected {low} below {high}, found 9.* and 3'):
        apply_settings(RegionConfig(), values)
