"""Views of people that the completion network learns from, drawn and kept."""

import numpy as np
import pytest

from pop_core.completion.person_view import RELIEF_M
from pop_core.training.completion.views import (
    STEPS,
    UNMEASURED,
    draw_noise,
    draw_views,
    load_views,
    pack,
    places_of,
    write_views,
)
from pop_core.training.shards import ShardError


@pytest.fixture(scope='module')
def drawn(small_scenes):
    return list(draw_views(iter(small_scenes), np.random.default_rng(0)))


def test_views_hold_the_person_they_are_of(drawn):
    assert len(drawn) > 10
    for view, person in drawn:
        back = view.to_camera(places_of(view, person))
        assert np.allclose(back, person.shared_points, atol=1e-6)
        assert view.keypoints[:, 3].sum() >= 4


def test_packing_keeps_depth_to_a_step(drawn):
    packed = pack(drawn)
    for row, (view, _) in zip(packed.relief, drawn, strict=True):
        known = view.measured > 0
        assert np.abs(row[known] * (RELIEF_M / STEPS) - view.relief_m[known]).max() < 0.005
        assert (row[view.measured == 0] == UNMEASURED).all()
        assert (row > UNMEASURED)[view.measured != 0].all()


def test_noise_varies():
    rng = np.random.default_rng(0)
    drawn = [draw_noise(rng) for _ in range(20)]
    assert 5 < len(set(drawn)) < 20


def test_files_of_views(tmp_path):
    assert list(write_views(tmp_path, 10, seed=3, per_file=8)) == [8, 16]
    path, other = sorted(tmp_path.glob('*.npz'))
    views = load_views(path)
    assert len(views) == 8
    other.unlink()
    before = path.stat().st_mtime_ns
    assert list(write_views(tmp_path, 10, seed=3, per_file=8)) == [16]
    assert path.stat().st_mtime_ns == before
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(ShardError, match='expected packed views'):
        load_views(path)
