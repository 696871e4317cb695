import numpy as np

from pop_core.depth_noise import DepthNoise
from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.segmentation.body_segmentation import SegmentationConfig, segment_body, with_holes

SHAPE = (60, 80)
FOCAL_PX = 100.0
CONFIG = SegmentationConfig()
NOISE = DepthNoise(0.0)
EVERY = np.ones(SHAPE, dtype=bool)


Scene = tuple[np.ndarray, RenderedDepth, np.ndarray]


def scene(body_m: float = 2.0, wall_m: float = 4.0) -> Scene:
    """A flat body on a wall; the rendered body is two pixels narrower than the real one."""
    truth = np.zeros(SHAPE, dtype=bool)
    truth[10:50, 30:50] = True
    depth = np.where(truth, body_m, wall_m).astype(np.float32)
    face = np.full(SHAPE, -1, dtype=np.int32)
    face[10:50, 32:48] = 0
    rendered = np.where(face >= 0, np.float32(body_m), np.float32(np.inf))
    return depth, RenderedDepth(rendered, face), truth


def test_growth_reaches_the_true_border_and_stops_there() -> None:
    depth, rendered, truth = scene()
    mask = segment_body(depth, rendered, EVERY, FOCAL_PX, CONFIG, NOISE)
    np.testing.assert_array_equal(mask, truth)


def test_growth_stays_near_the_silhouette_on_a_surface_that_goes_on() -> None:
    depth, rendered, _ = scene(wall_m=2.01)  # a seat a centimetre behind the body
    mask = segment_body(depth, rendered, EVERY, FOCAL_PX, CONFIG, NOISE)
    reach_px = CONFIG.growth_m * FOCAL_PX / 2.0
    columns = np.flatnonzero(mask.any(axis=0))
    assert columns.min() >= 32 - reach_px
    assert columns.max() <= 47 + reach_px


def test_pixels_far_from_the_body_change_nothing() -> None:
    depth, rendered, _ = scene(wall_m=2.01)
    wide = segment_body(depth, rendered, EVERY, FOCAL_PX, CONFIG, NOISE)
    part = (slice(2, 58), slice(20, 60))
    narrow = segment_body(
        depth[part], RenderedDepth(rendered.depth_m[part], rendered.face[part]), EVERY[part],
        FOCAL_PX, CONFIG, NOISE)
    np.testing.assert_array_equal(wide[part], narrow)
    assert wide.sum() == narrow.sum()


def test_an_occluder_in_front_is_not_the_body() -> None:
    depth, rendered, truth = scene()
    depth[30:50] = 1.0
    mask = segment_body(depth, rendered, EVERY, FOCAL_PX, CONFIG, NOISE)
    assert not mask[30:50].any()
    np.testing.assert_array_equal(mask[:30], truth[:30])


def test_pixels_of_another_person_are_left_to_them() -> None:
    depth, rendered, truth = scene()
    own = EVERY.copy()
    own[:, 40:] = False
    mask = segment_body(depth, rendered, own, FOCAL_PX, CONFIG, NOISE)
    assert not mask[:, 40:].any()
    np.testing.assert_array_equal(mask[:, :40], truth[:, :40])


def test_a_body_outside_the_image_has_no_pixels() -> None:
    depth, _, _ = scene()
    nothing = RenderedDepth(
        np.full(SHAPE, np.inf, dtype=np.float32), np.full(SHAPE, -1, dtype=np.int32))
    assert not segment_body(depth, nothing, EVERY, FOCAL_PX, CONFIG, NOISE).any()


def test_steps_as_large_as_the_sensors_noise_do_not_end_a_surface() -> None:
    depth, rendered, truth = scene(body_m=4.0, wall_m=6.0)
    depth[:, 49:] += np.float32(0.05)  # one step of disparity of a Kinect at 4 m
    rendered.depth_m[20:30, 34:40] = 3.88
    fine = segment_body(depth, rendered, EVERY, 2 * FOCAL_PX, CONFIG, NOISE)
    assert not fine[10:50, 49].any()
    assert not fine[20:30, 34:40].any()
    coarse = segment_body(depth, rendered, EVERY, 2 * FOCAL_PX, CONFIG, DepthNoise(0.0015))
    np.testing.assert_array_equal(coarse, truth)


def test_a_hole_in_the_person_is_the_persons_and_one_beside_it_is_not() -> None:
    depth, rendered, truth = scene()
    unmeasured = np.zeros(SHAPE, dtype=bool)
    unmeasured[10:20, 36:44] = True  # dark hair
    unmeasured[20:40, 60:70] = True  # a window of the room
    depth[unmeasured] = np.nan
    measured = segment_body(depth, rendered, ~unmeasured, FOCAL_PX, CONFIG, NOISE)
    assert not measured[12, 40]
    np.testing.assert_array_equal(with_holes(measured, unmeasured, rendered), truth)


def test_a_body_behind_nothing_measured_has_no_pixels() -> None:
    _, rendered, _ = scene()
    assert not with_holes(~EVERY, EVERY, rendered).any()
