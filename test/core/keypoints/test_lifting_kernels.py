import numpy as np
import pytest

from pop_core.keypoints import lifting_kernels as kernels
from pop_core.keypoints.depth_layers import find_layers


def image_of_two_surfaces(near, far, edge=50):
    depth = np.full((80, 100), far, np.float32)
    depth[:, :edge] = near
    return depth


def layers_at(depth, uv, mask=None):
    mask = np.ones(depth.shape, bool) if mask is None else mask
    return find_layers(depth, mask, np.array([uv], float), 20.0, 0.025)


def test_a_plain_surface_is_one_layer_that_fills_the_patch():
    layers = layers_at(np.full((80, 100), 2.0, np.float32), (40.0, 40.0))
    assert layers.present.sum() == 1
    assert layers.depth_m[0, 0] == pytest.approx(2.0)
    assert layers.share[0, 0] == pytest.approx(1.0)


def test_an_edge_shows_both_surfaces_by_their_shares():
    layers = layers_at(image_of_two_surfaces(1.0, 2.0), (50.0, 40.0))
    seen = {round(float(z), 3): share for z, share in zip(
        layers.depth_m[0], layers.share[0], strict=True) if share > 0}
    assert set(seen) == {1.0, 2.0}
    # The keypoint's own column belongs to the far side.
    assert seen[2.0] > seen[1.0] > 0.3
    assert sum(seen.values()) == pytest.approx(1.0)


def test_a_slope_is_one_layer():
    depth = np.tile(np.linspace(1.8, 2.4, 100, dtype=np.float32), (80, 1))
    assert layers_at(depth, (50.0, 40.0)).present.sum() == 1


def test_pixels_without_measurement_are_missing_from_the_shares():
    depth = np.full((80, 100), 2.0, np.float32)
    depth[:, 50:] = np.nan
    layers = layers_at(depth, (50.0, 40.0))
    assert 0.3 < layers.share[0].sum() < 0.5
    assert np.isfinite(layers.depth_m).all()


def test_an_undetected_keypoint_has_no_layer():
    assert not layers_at(np.full((80, 100), 2.0, np.float32), (np.nan, np.nan)).known.any()


def test_a_mask_tells_whose_surface_it_is():
    depth = image_of_two_surfaces(1.0, 2.0)
    layers = layers_at(depth, (50.0, 40.0), mask=depth > 1.5)
    own = dict(zip(layers.depth_m[0].round(3).tolist(), layers.own_share[0], strict=True))
    assert own[2.0] == 1.0
    assert own[1.0] == 0.0


def approach(depth, start, end):
    return kernels.approach(depth, *start, *end, 0.025)


def test_a_step_toward_the_camera_is_measured():
    depth = image_of_two_surfaces(1.2, 2.0)
    assert approach(depth, (80.0, 40.0), (20.0, 40.0)) == pytest.approx(0.8, abs=1e-6)
    assert approach(depth, (20.0, 40.0), (80.0, 40.0)) == pytest.approx(-0.8, abs=1e-6)


def test_a_limb_pointing_at_the_camera_makes_no_step():
    depth = np.tile(np.linspace(2.0, 1.5, 100, dtype=np.float32), (80, 1))
    assert approach(depth, (5.0, 40.0), (95.0, 40.0)) == 0.0


def test_a_thing_passed_on_the_way_makes_no_step():
    depth = np.full((80, 100), 2.0, np.float32)
    depth[:, 40:50] = 1.0
    assert approach(depth, (10.0, 40.0), (90.0, 40.0)) == pytest.approx(0.0, abs=1e-6)


def test_a_hole_before_the_step_does_not_hide_it():
    depth = image_of_two_surfaces(1.2, 2.0)
    depth[:, 45:60] = np.nan
    assert approach(depth, (80.0, 40.0), (20.0, 40.0)) == pytest.approx(0.8, abs=1e-6)
