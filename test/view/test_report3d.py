"""The 3D view of a report, as a browser shows it."""

import os
import re
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.browser import CHROMIUM, photograph

from pop_core.body.default_body import default_body
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rendering.palette import person_color
from pop_core.rendering.shown_body import ShownBody
from pop_core.rgbd import point_cloud
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.report import Picture, Report
from pop_ros.report3d import SceneFrame, scene_data, scene_html

BACKGROUND = (0x2c, 0x30, 0x37)
FOV_DEG = 42.0
OBLIQUE = np.array([0.50, 0.26, 0.83])
TO_GL = np.array([1.0, -1.0, -1.0])
MAGENTA = (255, 0, 255)
# The view alone, over the whole window, so that its pixels are the window's.
FULL = """
  const canvas = document.querySelector('canvas');
  canvas.style.cssText = 'position:fixed;left:0;top:0;width:1000px;height:625px;border-radius:0';
  window.dispatchEvent(new Event('resize'));
  const click = selector => document.querySelector(selector).click();
"""
WIDTH, HEIGHT = 1000, 625

needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason='no chromium here (apt-get install chromium)')


@pytest.fixture(scope='module')
def scene() -> SceneFrame:
    """A synthetic person whose own pixels are magenta."""
    truth = synthesise_sequence(default_body(), 4, 3, rate_hz=4.0)[1]
    person = truth.people[0]
    rgb = truth.frame.rgb.copy()
    rgb[person.mask] = MAGENTA
    body = ShownBody(
        person.vertices.astype(np.float64), person.joints, person.joint_state, person.mask)
    return SceneFrame(replace(truth.frame, rgb=rgb), [body], 'the only frame')


@pytest.fixture(scope='module')
def page(scene: SceneFrame, tmp_path_factory: pytest.TempPathFactory) -> Path:
    report = Report('A test', 'One person.')
    report.scenes([scene], default_body().f)
    path = tmp_path_factory.mktemp('page') / 'report.html'
    report.write(path)
    return path


@pytest.fixture(scope='module')
def oblique(page: Path) -> np.ndarray:
    """The view as a page opens it."""
    picture = photograph(page, FULL)[:HEIGHT, :WIDTH]
    kept = os.environ.get('POP_TEST_PICTURES')
    if kept:
        photograph(page)
        shutil.copy(page.with_suffix('.png'), Path(kept) / 'report3d.png')
    return picture


def colored_like(rgb: np.ndarray, color: tuple[int, int, int], degrees: float) -> np.ndarray:
    """Return pixels whose colour is a shade of another."""
    direction = np.array(color) / np.linalg.norm(color)
    length = np.linalg.norm(rgb.astype(float), axis=2)
    cosine = rgb @ direction / np.maximum(length, 1e-9)
    return (cosine > np.cos(np.deg2rad(degrees))) & (length > 90)


def mesh_colored(rgb: np.ndarray) -> np.ndarray:
    return colored_like(rgb, person_color(0), 9.0)


def viewed(p_camera: np.ndarray, scene: SceneFrame) -> np.ndarray:
    """Return points in the frame of the oblique viewer."""
    data = scene_data([scene], default_body().f)
    away = OBLIQUE / np.linalg.norm(OBLIQUE)
    far = data['radius'] / np.tan(np.deg2rad(FOV_DEG / 2)) * 1.12
    right = np.cross([0.0, 1.0, 0.0], away)
    right /= np.linalg.norm(right)
    R_view_gl = np.array([right, -np.cross(away, right), -away])
    return (p_camera * TO_GL - np.array(data['center']) * TO_GL) @ R_view_gl.T + [0, 0, far]


def viewer() -> Camera:
    f = HEIGHT / 2 / np.tan(np.deg2rad(FOV_DEG / 2))
    return Camera(WIDTH, HEIGHT, f, f, (WIDTH - 1) / 2, (HEIGHT - 1) / 2)


@needs_chromium
def test_a_browser_draws_the_mesh_where_the_projection_says(
    page: Path, scene: SceneFrame
) -> None:
    mesh = viewed(scene.bodies[0].vertices, scene)
    expected = render_depth(mesh, default_body().f, viewer()).covered.astype(np.uint8)
    assert expected.sum() > 10_000
    alone = ''.join(f'click("[name={layer}]");' for layer in ('room', 'people', 'skeleton'))
    drawn = mesh_colored(photograph(page, FULL + alone)[:HEIGHT, :WIDTH])
    assert cv2.dilate(expected, np.ones((5, 5)))[drawn].mean() > 0.99
    # Surfaces that face away from the light are too dark to have a colour.
    assert drawn[cv2.erode(expected, np.ones((5, 5))) > 0].mean() > 0.9


@needs_chromium
def test_a_browser_draws_measured_points_where_they_were_measured(
    scene: SceneFrame, oblique: np.ndarray
) -> None:
    points = point_cloud(scene.frame, scene.bodies[0].mask)[0]
    u, v = np.rint(viewer().project(viewed(points, scene))).astype(int).T
    expected = np.zeros((HEIGHT, WIDTH), dtype=np.uint8)
    expected[v, u] = 1
    drawn = colored_like(oblique, MAGENTA, 6.0)
    assert drawn.sum() > 1000
    assert cv2.dilate(expected, np.ones((9, 9)))[drawn].mean() > 0.99


@needs_chromium
@pytest.mark.parametrize(('layer', 'color'), [('mesh', person_color(0)), ('people', MAGENTA)])
def test_a_layer_can_be_switched_off(
    page: Path, oblique: np.ndarray, layer: str, color: tuple[int, int, int]
) -> None:
    without = photograph(page, f'{FULL} click("[name={layer}]");')[:HEIGHT, :WIDTH]
    before = colored_like(oblique, color, 6.0).sum()
    assert colored_like(without, color, 6.0).sum() < 0.02 * before


@needs_chromium
@pytest.mark.parametrize('act', [
    'click("[data-place=side]");',
    """const at = (kind, x) => canvas.dispatchEvent(new PointerEvent(kind, {
         pointerId: 1, button: 0, buttons: 1, clientX: x, clientY: 300, bubbles: true}));
       canvas.setPointerCapture = canvas.releasePointerCapture = () => {};
       at('pointerdown', 300); at('pointermove', 420); at('pointerup', 420);""",
], ids=['button', 'drag'])
def test_the_viewer_can_walk_around(page: Path, oblique: np.ndarray, act: str) -> None:
    moved = photograph(page, FULL + act)[:HEIGHT, :WIDTH]
    seen = mesh_colored(moved)
    assert seen.sum() > 5000
    assert (seen != mesh_colored(oblique)).sum() > 3000


@needs_chromium
def test_a_film_plays_until_it_is_paused(tmp_path: Path) -> None:
    report = Report('A film', 'Red, green, blue.')
    colors = np.array([[200, 30, 30], [30, 200, 30], [30, 30, 200]], np.uint8)
    report.film([Picture.encoded(np.full((200, 300, 3), color, np.uint8), 'a colour', 640)
                 for color in colors])
    report.write(tmp_path / 'film.html')

    def shown(act: str) -> int:
        picture = photograph(tmp_path / 'film.html', act)
        counts = [colored_like(picture, tuple(color), 4.0).sum() for color in colors.tolist()]
        assert max(counts) > 20_000
        assert sorted(counts)[1] < 1000
        return int(np.argmax(counts))

    play = "const button = document.querySelector('.film button'); button.click();"
    assert shown('') == 1  # the middle
    assert shown(f'{play} setTimeout(() => button.click(), 350);') == 2
    assert shown(f'{play} setTimeout(() => button.click(), 600);') == 0


def test_a_page_may_fetch_nothing(page: Path) -> None:
    text = page.read_text()
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)
    assert policy is not None
    assert "default-src 'none'" in policy[1]
    assert 'http' not in policy[1]
    assert page.stat().st_size < 4_000_000


def test_captions_cannot_end_the_script_that_holds_them(scene: SceneFrame) -> None:
    evil = replace(scene, caption='</script><img src=x>')
    assert scene_html([evil], default_body().f).count('</script>') == 1


def test_a_frame_without_people_or_depth_can_be_shown(scene: SceneFrame) -> None:
    blind = replace(scene.frame, depth_m=np.full_like(scene.frame.depth_m, np.nan))
    for frame in (scene.frame, blind):
        data = scene_data([SceneFrame(frame, [], 'nobody')], default_body().f)
        assert np.isfinite([*data['center'], data['radius']]).all()
        assert data['frames'][0]['bodies'] == []
