import numpy as np
import pytest

from pop_core.body.kinematics import joints
from pop_core.geometry.transform import invert_transform
from pop_core.synthesis.blocks import block_surface, box, depth_inside
from pop_core.synthesis.layouts import draw_layout
from pop_core.synthesis.occlusion import hidden_from
from pop_core.synthesis.props import draw_prop
from pop_core.synthesis.scene_config import SceneConfig, training_config
from pop_core.synthesis.scenes import synthesise_scene

EYE = np.array([0.0, 1.0, 3.0])


@pytest.fixture(scope='module')
def layouts(model):
    rng = np.random.default_rng(2)
    drawn = [draw_layout(model, SceneConfig(prop_share=0.0), rng) for _ in range(12)]
    return [layout for layout in drawn if layout is not None]


def test_a_wall_hides_what_stands_behind_it_and_nothing_else():
    wall = block_surface(box([1.0, 2.0, 0.1], [0.0, 0.0, 1.0], np.ones(3)))
    points = np.array([[0.0, 1.0, 0.0], [0.4, 1.5, 0.5], [2.0, 1.0, 0.0], [0.0, 1.0, 2.0]])
    assert hidden_from(EYE, points, wall.vertices, wall.faces).tolist() == [
        True, True, False, False]


def test_nobody_stands_inside_furniture(layouts):
    assert len(layouts) >= 4
    for layout in layouts:
        seats = {id(block) for actor in layout.actors for block in actor.seat}
        others = [block for block in layout.blocks if id(block) not in seats]
        for actor in layout.actors:
            assert all(depth_inside(block, actor.surface).max() < 0 for block in others)


def test_people_keep_clear_of_each_other(layouts):
    for layout in layouts:
        for k, first in enumerate(layout.actors):
            for second in layout.actors[k + 1:]:
                gap = np.linalg.norm(first.skin[::9, None] - second.skin[None, ::9], axis=2)
                assert gap.min() > 0.04


def test_cameras_stand_inside_the_room(layouts):
    for layout in layouts:
        eye = invert_transform(layout.T_camera_room)[:3, 3]
        assert abs(eye[0]) < layout.room.half_width_m
        assert 0 < eye[1] < layout.room.height_m


def test_what_is_carried_is_at_the_person(model, layouts):
    rng = np.random.default_rng(0)
    actor = layouts[0].actors[0]
    p = joints(model, actor.parameters)
    for _ in range(20):
        prop = draw_prop(model, actor.parameters, rng)
        assert np.linalg.norm(prop.base - p, axis=1).min() < 0.6
        assert prop.base[1] >= 0.0


def test_training_scenes_are_small_and_may_be_empty_or_crowded(model):
    config = training_config(160, 128)
    scenes = [synthesise_scene(model, seed, config) for seed in range(6)]
    assert {scene.frame.depth_m.shape for scene in scenes} == {(128, 160)}
    assert not any(scene.frame.rgb.any() for scene in scenes)
    counts = {len(scene.people) for scene in scenes}
    assert len(counts) > 1
