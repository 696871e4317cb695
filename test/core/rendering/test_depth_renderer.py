import numpy as np

from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import render_depth, vertex_normals

CAMERA = Camera(80, 60, 70.0, 70.0, 39.5, 29.5)


def slanted() -> np.ndarray:
    """A triangle that nearly fills the view, each corner at another depth."""
    corners = np.array([[-2.0, -2.0], [2.0, -2.0], [0.0, 3.0]])
    depth = np.array([2.0, 3.0, 2.5])
    return np.column_stack([corners * depth[:, None] / 2, depth])


def test_depth_of_a_plane_is_exact_at_every_pixel() -> None:
    triangle = slanted()
    rendered = render_depth(triangle, np.array([[0, 1, 2]]), CAMERA)
    normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    rays = np.dstack([CAMERA.ray_grid(), np.ones((60, 80))])
    expected = (normal @ triangle[0]) / (rays @ normal)
    assert rendered.covered.mean() > 0.2
    np.testing.assert_allclose(
        rendered.depth_m[rendered.covered], expected[rendered.covered], rtol=1e-6)
    assert np.isinf(rendered.depth_m[~rendered.covered]).all()


def test_the_nearer_of_two_surfaces_is_seen_in_either_order() -> None:
    near = slanted()
    both = np.vstack([near, near * 1.5])
    for faces in (np.array([[0, 1, 2], [3, 4, 5]]), np.array([[3, 4, 5], [0, 1, 2]])):
        rendered = render_depth(both, faces, CAMERA)
        alone = render_depth(near, np.array([[0, 1, 2]]), CAMERA)
        np.testing.assert_array_equal(
            rendered.depth_m[alone.covered], alone.depth_m[alone.covered])


def test_what_lies_behind_the_camera_is_not_drawn() -> None:
    behind = slanted() * [1, 1, -1]
    assert not render_depth(behind, np.array([[0, 1, 2]]), CAMERA).covered.any()


def test_normals_of_a_cube_point_along_its_diagonals() -> None:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    # Both diagonals of every side, so that no corner gets more area from one side than another.
    faces = [t for a, b, c, d in quads
             for t in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))]
    normals = vertex_normals(corners, np.array(faces))
    np.testing.assert_allclose(normals, corners / np.sqrt(3), atol=1e-12)
