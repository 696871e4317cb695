import numpy as np
import pytest
from support.one_person import facing_person

from pop_core.body.default_body import default_body
from pop_core.fitting.body_state import FitBody
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import (
    is_closed,
    render_alike,
    render_depth,
    render_parts,
    vertex_normals,
)

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


@pytest.mark.parametrize('full', [True, False])
def test_of_a_closed_body_the_faces_that_look_away_are_never_seen(
    full: bool,
) -> None:
    state = FitBody(default_body(), full=full).state(facing_person(np.zeros(10)))
    assert state.body.is_closed
    every = render_depth(state.vertices, state.body.faces, CAMERA)
    half = render_depth(state.vertices, state.body.faces, CAMERA, closed=True)
    assert every.covered.any()
    np.testing.assert_array_equal(half.depth_m, every.depth_m)
    np.testing.assert_array_equal(half.face, every.face)


def test_a_surface_with_a_border_or_turned_inside_out_is_not_closed() -> None:
    v, f = default_body().v_template.astype(np.float64), default_body().f
    assert is_closed(v, f)
    assert not is_closed(v, f[1:])
    assert not is_closed(v, f[:, ::-1])
    assert not is_closed(v, np.vstack([f, f[:1]]))
    assert not is_closed(v, np.vstack([f[1:], f[:1, ::-1]]))


def test_parts_are_seen_as_each_alone() -> None:
    state = FitBody(default_body(), full=False).state(facing_person(np.zeros(10)))
    faces = state.body.faces
    part = np.random.default_rng(0).integers(0, 3, len(faces))
    for closed in (False, True):
        together = render_parts(state.vertices, faces, part, 3, CAMERA, closed=closed)
        for k in range(3):
            alone = render_depth(state.vertices, faces[part == k], CAMERA, closed=closed)
            np.testing.assert_array_equal(together[k], alone.depth_m)


@pytest.mark.parametrize('closed', [True, False])
def test_versions_of_a_body_are_seen_as_each_alone(closed: bool) -> None:
    person = facing_person(np.zeros(10))
    body = FitBody(default_body(), full=False)
    poses = [person.body_pose.copy() for _ in range(3)]
    poses[1][15, 2], poses[2][17, 1] = 0.8, 1.0  # a shoulder and an elbow
    states = [body.state(person.replaced(body_pose=pose)) for pose in poses]
    alike = (states[0].vertices == states[1].vertices).all(axis=1)
    assert 0.5 < alike.mean() < 1.0
    far = body.state(person.replaced(transl=person.transl + 0.3))
    for versions in (states, [*states, far], states[:1]):
        drawn = render_alike([s.vertices for s in versions], body.faces, CAMERA, closed=closed)
        for depth_m, state in zip(drawn, versions, strict=True):
            alone = render_depth(state.vertices, body.faces, CAMERA, closed=closed)
            np.testing.assert_array_equal(depth_m, alone.depth_m)
    assert render_alike([], body.faces, CAMERA).shape == (0, CAMERA.height, CAMERA.width)


def test_normals_of_a_cube_point_along_its_diagonals() -> None:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    # Both diagonals of every side, so that no corner gets more area from one side than another.
    faces = [t for a, b, c, d in quads
             for t in ((a, b, c), (a, c, d), (a, b, d), (b, c, d))]
    normals = vertex_normals(corners, np.array(faces))
    np.testing.assert_allclose(normals, corners / np.sqrt(3), atol=1e-12)
