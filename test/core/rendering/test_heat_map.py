import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.rendering.heat_map import LARGEST_M, MeasuredSurface, heat_colors, heat_map
from pop_core.rendering.line_chart import Line, line_chart

CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
STANDING = BodyParameters(
    np.array([0.0, 0.2, 3.0]), np.array([np.pi, 0, 0]), np.zeros((23, 3)), np.zeros(10))


@pytest.fixture(scope='module')
def body() -> BodyModel:
    return default_body()


def darkness(picture: np.ndarray) -> float:
    return float(255 - picture.astype(float).mean())


def test_colors_darken_with_the_error_and_end_at_the_largest():
    colors = heat_colors(np.linspace(0, LARGEST_M, 40)).astype(int).sum(axis=1)
    assert np.all(np.diff(colors) <= 0)
    assert colors[0] - colors[-1] > 500
    beyond = heat_colors(np.array([LARGEST_M, 10.0]))
    assert np.array_equal(beyond[0], beyond[1])


def test_only_the_wrong_half_of_a_body_is_dark(body: BodyModel):
    mesh = vertices(body, STANDING)
    rgb = np.full((120, 160, 3), 200, dtype=np.uint8)
    wrong = np.where(mesh[:, 0] > 0, LARGEST_M, 0.0)  # the right half of the image
    picture = heat_map(rgb, [MeasuredSurface(mesh, wrong)], body.f, CAMERA)
    trunk = picture[50:70, 68:92]
    assert darkness(trunk[:, 15:]) > darkness(trunk[:, :9]) + 60


def test_the_picture_shows_three_sides_and_a_scale(body: BodyModel):
    rgb = np.zeros((120, 160, 3), dtype=np.uint8)
    person = MeasuredSurface(vertices(body, STANDING), np.zeros(len(body.v_template)))
    picture = heat_map(rgb, [person], body.f, CAMERA)
    assert picture.shape[1] == 160 + 2 * 80 + 2 * 6
    assert picture.shape[0] > 120


def test_a_chart_draws_falling_values_downwards():
    x = np.arange(5.0)
    red, chart_size = (220, 0, 0), (300, 200)
    chart = line_chart('t', [Line(x, 10.0 ** -x, red, 2)], [(0.0, 'a'), (4.0, 'long name')],
                       chart_size)
    rows, columns = np.nonzero((chart == red).all(axis=2))
    by_column = [rows[columns == u].mean() for u in sorted(set(columns))]
    assert np.all(np.diff(by_column) > -1)
    # Equal factors are equal heights on a logarithmic scale.
    straight = np.linspace(by_column[0], by_column[-1], len(by_column))
    assert np.abs(np.array(by_column) - straight).max() < 2


def test_a_chart_without_positive_values_can_be_drawn():
    chart = line_chart('t', [Line(np.zeros(1), np.zeros(1), (0, 0, 0))], [], (300, 200))
    assert chart.shape == (200, 300, 3)
