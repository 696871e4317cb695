"""Laws of the pictures: where things are drawn, not how beautiful they are."""

from dataclasses import replace

import numpy as np
import pytest

from pop_core.estimate import FrameResult, JointState
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rendering.overlay import draw_people, draw_skeleton
from pop_core.rendering.palette import INK, PAPER, person_color
from pop_core.rendering.pictures import (
    extent_of,
    result_panels,
    result_picture,
)
from pop_core.rendering.scene_view import FROM_ABOVE, FROM_THE_RIGHT, draw_scene, fitting_view
from pop_core.rendering.shading import shade
from pop_core.rendering.shown_body import ShownBody
from pop_core.rendering.text import captioned, colored_depth
from pop_core.rgbd import RgbdFrame

CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
GRAY = 90


def tetrahedron(z=2.0, size=0.4):
    """Return a closed mesh around the optical axis, faces outward."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) * size
    f = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    return corners + [0, 0, z], f


def body(z=2.0, state=JointState.VISIBLE):
    vertices, f = tetrahedron(z)
    joints = np.tile([0.0, 0.0, z], (24, 1))
    shown = ShownBody(vertices, joints, np.full(24, int(state)), np.zeros((120, 160), bool))
    return shown, f


def plain_frame(depth_m=3.0, camera=CAMERA):
    rgb = np.full((120, 160, 3), GRAY, dtype=np.uint8)
    return RgbdFrame(rgb, np.full((120, 160), depth_m, dtype=np.float32), camera)


def test_a_mesh_is_drawn_exactly_where_it_is_rendered():
    vertices, f = tetrahedron()
    rendered, picture = shade(vertices, f, CAMERA, (200, 100, 50))
    np.testing.assert_array_equal(picture.any(axis=2), rendered.covered)
    assert rendered.covered.any()


def test_a_face_turned_to_the_light_is_brighter_than_one_turned_away():
    f = np.array([[0, 1, 2]])
    quarter = np.array([[-0.5, 0.5, 2.0], [0.5, 0.5, 2.0], [0.0, -0.5, 2.0]])
    tilted_up = quarter + np.array([[0, 0, 0], [0, 0, 0], [0, 0, 0.8]])
    tilted_down = quarter + np.array([[0, 0, 0.8], [0, 0, 0.8], [0, 0, 0]])
    brightness = []
    for corners in (tilted_up, tilted_down):
        towards_camera = np.cross(corners[1] - corners[0], corners[2] - corners[0])[2] < 0
        order = f if towards_camera else f[:, ::-1]
        picture = shade(corners, order, CAMERA, (200, 200, 200))[1]
        brightness.append(picture.max())
    assert brightness[0] > brightness[1]


def test_the_nearer_of_two_people_covers_the_farther():
    (near, f), (far, _) = body(1.5), body(3.0)
    rgb = plain_frame().rgb
    # Both orders, so that the order of the list is not what decides.
    for people in ([near, far], [far, near]):
        both = draw_people(rgb, people, f, CAMERA)
        colors = [person_color(people.index(person)) for person in (near, far)]
        where = shade(far.vertices, f, CAMERA, colors[1])[0].covered
        mean = both[where].mean(axis=0)
        to_near, to_far = (np.linalg.norm(_hue(mean) - _hue(color)) for color in colors)
        assert to_near < to_far


def _hue(rgb):
    return np.asarray(rgb, dtype=float) / np.linalg.norm(rgb)


def test_what_stands_behind_measured_depth_is_drawn_faint():
    shown, f = body()
    rgb = np.full((CAMERA.height, CAMERA.width, 3), 90, np.uint8)
    z = float(shown.joints[0, 2])
    depth_m = np.full(rgb.shape[:2], z + 2, np.float32)
    depth_m[CAMERA.height // 2:] = z - 1  # a table hides the lower half
    seen, half_hidden = (draw_people(rgb, [shown], f, CAMERA, depth) for depth in (None, depth_m))
    changed = np.abs(half_hidden.astype(int) - seen).sum(axis=2) > 0
    assert changed[CAMERA.height // 2:].sum() > 100
    assert not changed[:CAMERA.height // 2].any()
    contrast = [np.abs(p.astype(int) - rgb).sum(axis=2)[changed].mean()
                for p in (half_hidden, seen)]
    assert contrast[0] < 0.6 * contrast[1]


def test_measured_points_leave_most_of_a_mesh_to_be_seen():
    shown, f = body()
    covered = render_depth(shown.vertices, f, CAMERA)
    depth_m = np.where(covered.covered, covered.depth_m, np.nan).astype(np.float32)
    frame = RgbdFrame(np.zeros((*depth_m.shape, 3), np.uint8), depth_m, CAMERA)
    view = fitting_view(FROM_THE_RIGHT, shown.vertices, CAMERA.width, CAMERA.height)
    without = draw_scene(frame, [replace(shown, mask=np.zeros_like(covered.covered))], f, view)
    points = draw_scene(frame, [replace(shown, mask=covered.covered)], f, view)
    changed = (points != without).any(axis=2)
    mesh = render_depth(view.points(shown.vertices), f, view.camera).covered
    assert 0.02 < changed.sum() / mesh.sum() < 0.4


def test_a_person_keeps_color_and_number_wherever_in_the_list():
    rgb = np.full((CAMERA.height, CAMERA.width, 3), GRAY, np.uint8)
    near, far = replace(body(1.6)[0], id=3), replace(body(2.4)[0], id=1)
    f = body()[1]
    one, other = (draw_people(rgb, people, f, CAMERA) for people in ([near, far], [far, near]))
    assert np.array_equal(one, other)
    unnamed = draw_people(rgb, [replace(near, id=None)], f, CAMERA)
    named = draw_people(rgb, [replace(near, id=0)], f, CAMERA)
    changed = np.argwhere((unnamed != named).any(axis=2))
    above = CAMERA.project(near.joints[[15]] - [0, 0.24, 0])[0, ::-1]
    assert len(changed)  # the number, above the head and nowhere else
    assert np.abs(changed - above).max() < 25


def test_drawing_leaves_the_image_it_was_given_alone():
    frame = plain_frame()
    draw_people(frame.rgb, [body()[0]], body()[1], CAMERA)
    assert (frame.rgb == GRAY).all()


@pytest.mark.parametrize(
    ('state', 'inside'), [(JointState.VISIBLE, PAPER), (JointState.SCENE_OCCLUDED, INK)])
def test_hidden_joints_are_hollow(state, inside):
    picture = plain_frame().rgb.copy()
    shown, _ = body(state=state)
    draw_skeleton(picture, shown.joints, shown.joint_state, CAMERA)
    center = picture[59:61, 79:81].reshape(-1, 3)
    np.testing.assert_allclose(center, np.tile(inside, (4, 1)), atol=40)


def test_joints_behind_the_camera_are_not_drawn():
    picture = plain_frame().rgb.copy()
    draw_skeleton(picture, np.tile([0, 0, -1.0], (24, 1)), np.zeros(24, int), CAMERA)
    assert (picture == GRAY).all()


@pytest.mark.parametrize('axes', [FROM_THE_RIGHT, FROM_ABOVE], ids=['side', 'top'])
def test_views_are_proper_rotations(axes):
    np.testing.assert_array_equal(axes @ axes.T, np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1)


def test_farther_from_the_camera_is_further_right_in_both_views():
    points = np.array([[0.0, 0, 1], [0, 0, 3]])
    for axes in (FROM_THE_RIGHT, FROM_ABOVE):
        view = fitting_view(axes, points, 200, 100)
        u = view.camera.project(view.points(points))[:, 0]
        assert u[1] > u[0]


def test_a_view_shows_all_that_it_was_fitted_to():
    points = np.random.default_rng(0).uniform([-2, -1, 1], [1, 2, 5], (200, 3))
    for axes in (FROM_THE_RIGHT, FROM_ABOVE):
        view = fitting_view(axes, points, 213, 97)
        uv = view.camera.project(view.points(points))
        assert (uv >= 0).all()
        assert (uv < [213, 97]).all()


def test_a_metre_is_equally_long_along_both_axes_of_a_view():
    corners = np.array([[-1.0, -1, 2], [1, 1, 4]])
    view = fitting_view(FROM_THE_RIGHT, corners, 300, 200)
    across = np.array([[0.0, 0, 2.5], [0, 0, 3.5], [0, -0.5, 3], [0, 0.5, 3]])
    uv = view.camera.project(view.points(across))
    assert uv[1, 0] - uv[0, 0] == pytest.approx(uv[3, 1] - uv[2, 1], rel=1e-6)


def test_a_scene_without_people_or_depth_still_gives_a_picture():
    frame = plain_frame(np.nan)
    picture = result_picture(frame, FrameResult((), (), {}), np.zeros((0, 3), dtype=int))
    assert picture.shape[2] == 3


def test_views_of_one_extent_are_to_one_scale_wherever_people_are():
    near, far = body(1.5), body(3.5)
    frame, f = plain_frame(np.nan), near[1]
    extent = np.concatenate([extent_of([near[0]]), extent_of([far[0]])])
    half = CAMERA.width // 2

    def mesh_px(shown, points):
        views = result_panels(frame, [shown], f, points)[3]
        side = views[30:90, : half - 4].astype(int)  # without caption and scale
        return (np.ptp(side, axis=2) > 40).sum()

    alike = [mesh_px(shown, extent) for shown in (near[0], far[0])]
    assert abs(alike[0] - alike[1]) < 0.1 * alike[0]
    assert mesh_px(near[0], None) > 1.5 * alike[0]


def test_a_view_of_a_body_shows_its_mesh():
    shown, f = body()
    view = fitting_view(FROM_THE_RIGHT, shown.vertices, 160, 120)
    with_body = draw_scene(plain_frame(np.nan), [shown], f, view)
    without = draw_scene(plain_frame(np.nan), [], f, view)
    assert (with_body != without).any(axis=2).mean() > 0.05


def test_near_is_brighter_than_far_and_missing_is_black():
    depth_m = np.linspace(1, 5, 120 * 160, dtype=np.float32).reshape(120, 160)
    depth_m[0, 0] = np.nan
    picture = colored_depth(depth_m).astype(int).sum(axis=2)
    assert picture[0, 0] == 0
    assert picture[1, 0] > picture[-1, -1] > 0


def test_a_caption_stays_in_its_corner():
    picture = plain_frame().rgb
    out = captioned(picture, 'colour')
    assert (out[:20, :20] != picture[:20, :20]).any()
    assert (out[60:] == picture[60:]).all()
