import numpy as np
import pytest

from pop_core.body.kinematics import joints
from pop_core.body.skinning import vertices
from pop_core.estimate import JointState
from pop_core.rendering.depth_renderer import render_depth
from pop_core.synthesis import scenes as scenes_module
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.scenes import SceneError, synthesise_scene


def test_a_seed_gives_the_same_scene_twice(model, scenes):
    again = synthesise_scene(model, scenes[1].seed)
    assert np.array_equal(again.frame.rgb, scenes[1].frame.rgb)
    assert np.array_equal(again.frame.depth_m, scenes[1].frame.depth_m, equal_nan=True)
    assert np.array_equal(again.people[0].vertices, scenes[1].people[0].vertices)


def test_different_seeds_give_different_scenes(scenes):
    assert not np.array_equal(scenes[0].people[0].joints, scenes[1].people[0].joints)


def test_truth_parameters_give_truth_joints_and_mesh(model, scenes):
    for scene in scenes:
        for person in scene.people:
            assert np.allclose(joints(model, person.parameters), person.joints)
            assert np.allclose(vertices(model, person.parameters), person.vertices)


def test_somebody_is_hidden_as_much_as_asked(scenes):
    for scene in scenes:
        assert 0.2 <= max(person.hidden_share for person in scene.people) <= 0.6


def test_masks_are_where_the_clothed_body_is_the_nearest_surface(model, scenes):
    for scene in scenes:
        for person in scene.people:
            alone = render_depth(person.clothed_vertices, model.f, scene.frame.camera)
            assert np.array_equal(alone.depth_m[person.mask], scene.true_depth_m[person.mask])
            assert not (person.mask & ~person.amodal_mask).any()


def test_masks_of_people_do_not_overlap_and_carry_the_parts(scenes):
    for scene in scenes:
        total = np.sum([person.mask for person in scene.people], axis=0)
        assert total.max() <= 1
        assert np.array_equal(scene.part_labels >= 0, total > 0)


def test_nothing_stands_before_a_visible_joint(scenes):
    for scene in scenes:
        for person in scene.people:
            chosen = person.joints[person.joint_state == JointState.VISIBLE]
            u, v = np.rint(scene.frame.camera.project(chosen)).astype(int).T
            gap = chosen[:, 2] - scene.true_depth_m[v, u]
            assert gap.max() < 0.35  # a stout trunk


def test_the_scene_stands_before_a_joint_it_hides(scenes):
    hidden = 0
    for scene in scenes:
        for person in scene.people:
            chosen = person.joints[person.joint_state == JointState.SCENE_OCCLUDED]
            u, v = np.rint(scene.frame.camera.project(chosen)).astype(int).T
            assert (scene.true_depth_m[v, u] < chosen[:, 2]).all()
            assert not person.mask[v, u].any()
            hidden += len(chosen)
    assert hidden > 10


def test_measured_depth_is_near_true_depth(scenes):
    for scene in scenes:
        error = np.abs(scene.frame.depth_m - scene.true_depth_m) / scene.true_depth_m
        near = scene.true_depth_m < 4.0
        assert np.nanmedian(error[near]) < 0.01
        assert np.isfinite(error[near]).mean() > 0.8


def test_detections_are_the_same_at_every_call(scenes):
    first, second = scenes[0].detections(), scenes[0].detections()
    assert len(first) == len(scenes[0].people)
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.keypoints_px, b.keypoints_px, equal_nan=True)


def test_an_empty_room_can_be_asked_for(model):
    scene = synthesise_scene(model, 0, SceneConfig(people=(0, 0)))
    assert scene.people == ()
    assert (scene.part_labels == -1).all()
    assert np.isfinite(scene.frame.depth_m).mean() > 0.5


def test_an_impossible_configuration_is_told(model, monkeypatch):
    monkeypatch.setattr(scenes_module, 'ATTEMPTS', 2)
    config = SceneConfig(people=(1, 1), occluders=(0, 0), hidden_share=(0.97, 1.0))
    with pytest.raises(SceneError, match='seed 0'):
        synthesise_scene(model, 0, config)
