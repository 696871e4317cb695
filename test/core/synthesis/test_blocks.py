import numpy as np
import pytest

from pop_core.synthesis.blocks import (
    Shape,
    block_surface,
    box,
    cylinder,
    depth_inside,
    ellipsoid,
    moved,
)

GREY = np.full(3, 0.5)
SIZE = [0.8, 1.2, 0.5]


def volume(surface):
    """Signed volume by the divergence theorem: positive when triangles face outward."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    return (a * np.cross(b, c)).sum() / 6


@pytest.mark.parametrize(('make', 'share'), [
    (box, 1.0), (cylinder, np.pi / 4), (ellipsoid, np.pi / 6)])
def test_a_block_is_closed_and_faces_outward(make, share):
    surface = block_surface(make(SIZE, [0.3, 0.2, -1.0], GREY))
    # Twenty sides leave a round block up to 4 % smaller than the smooth one.
    assert volume(surface) == pytest.approx(share * np.prod(SIZE), rel=0.04)


@pytest.mark.parametrize('make', [box, cylinder, ellipsoid])
def test_the_surface_of_a_block_is_where_depth_inside_is_zero(make):
    block, = moved([make(SIZE, [0.0, 0.1, 0.0], GREY)], np.array([1.0, 0.0, 2.0]), 0.7)
    assert np.abs(depth_inside(block, block_surface(block).vertices)).max() < 1e-9


@pytest.mark.parametrize('make', [box, cylinder, ellipsoid])
def test_the_middle_of_a_block_is_inside_and_points_beside_it_are_not(make):
    block, = moved([make(SIZE, [0.0, 0.0, 0.0], GREY)], np.array([1.0, 0.5, 2.0]), 0.4)
    p = np.array([[1.0, 1.1, 2.0], [1.9, 1.1, 2.0], [1.0, 1.8, 2.0], [1.0, 0.4, 2.0]])
    assert (depth_inside(block, p) > 0).tolist() == [True, False, False, False]


def test_moving_a_block_moves_its_surface():
    block = box(SIZE, [0.2, 0.0, 0.3], GREY)
    shift, yaw = np.array([0.5, 0.0, -1.0]), 1.1
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    expected = block_surface(block).vertices @ turn.T + shift
    there = block_surface(moved([block], shift, yaw)[0]).vertices
    assert np.allclose(there, expected)
    assert block.shape is Shape.BOX
