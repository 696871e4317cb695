import cv2
import numpy as np
import pytest

from pop_core.rendering.summary_film import FilmError, SummaryFilm

COLORS = ((200, 30, 30), (30, 200, 30), (30, 30, 200), (200, 200, 30))


def pictures() -> list[np.ndarray]:
    return [np.full((61, 121, 3), color, dtype=np.uint8) for color in COLORS]


def write(path, **settings) -> None:
    with SummaryFilm(path, rate_hz=5.0, **settings) as film:
        for picture in pictures():
            film.add(picture)


def read_video(path) -> list[np.ndarray]:
    video, found = cv2.VideoCapture(str(path)), []
    while (read := video.read())[0]:
        found.append(read[1][..., ::-1])
    return found


def read_animation(path) -> list[np.ndarray]:
    done, animation = cv2.imreadanimation(str(path))
    assert done
    return [frame[..., 2::-1] for frame in animation.frames]


@pytest.mark.parametrize(
    ('name', 'read'),
    [('film.mp4', read_video), ('film.webp', read_animation), ('film.gif', read_animation)])
def test_a_film_shows_its_pictures_in_order_and_color(tmp_path, name, read):
    write(tmp_path / name)
    found = read(tmp_path / name)
    assert len(found) == len(COLORS)
    for frame, color in zip(found, COLORS, strict=True):
        # Compression changes a plain colour by a few levels; colours differ by 170.
        np.testing.assert_allclose(frame.reshape(-1, 3).mean(axis=0), color, atol=25)


def test_a_film_is_scaled_down_to_its_width_with_even_sides(tmp_path):
    write(tmp_path / 'film.mp4', width=60)
    assert read_video(tmp_path / 'film.mp4')[0].shape == (30, 60, 3)


def test_a_film_without_pictures_leaves_no_file(tmp_path):
    with SummaryFilm(tmp_path / 'film.mp4', rate_hz=5.0):
        pass
    assert not (tmp_path / 'film.mp4').exists()


def test_an_unknown_suffix_is_refused_with_those_that_are_known(tmp_path):
    with pytest.raises(FilmError, match=r'\.mp4, \.webp, \.gif'):
        SummaryFilm(tmp_path / 'film.avi', rate_hz=5.0)
