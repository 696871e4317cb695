"""From keypoints and depth to bodies, on a synthetic scene and at its edges."""

from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from pop_core.body.default_body import default_body
from pop_core.completion.joint_completion import JointCompletion, load_completion
from pop_core.config import PipelineConfig
from pop_core.depth_noise import USUAL_NOISE
from pop_core.estimate import EstimateStatus, FrameResult, JointState
from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.observation import Observation
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.region import RegionConfig
from pop_core.pipeline import BodyPipeline, PersonFit, Reading, Scene
from pop_core.retrieval.default_library import default_library
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.ground import Ground, find_ground
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.scenes import SyntheticScene, synthesise_scene
from pop_core.tracking.tracker import BodyTracker


class Given:
    """A keypoint source that says what it is told."""

    def __init__(self, detections: list[Detection]) -> None:
        self.detections = detections

    def detect(self, frame: RgbdFrame) -> list[Detection]:  # noqa: ARG002
        return self.detections


@pytest.fixture(scope='module')
def scene() -> SyntheticScene:
    config = SceneConfig(people=(2, 2), pose_shares=(('standing', 1.0),),
                         sensors=('structured_light',), child_share=0.0)
    return synthesise_scene(default_body(), 11, config)


def run(frame: RgbdFrame, detections: list[Detection]) -> FrameResult:
    pipeline = BodyPipeline(default_body(), default_library(), Given(detections))
    return pipeline.process(frame)


@pytest.fixture(scope='module')
def result(scene: SyntheticScene) -> FrameResult:
    return run(scene.frame, [d for d in scene.detections() if d is not None])


def test_everybody_is_found_where_they_are(scene: SyntheticScene, result: FrameResult) -> None:
    assert len(result.bodies) == len(scene.people)
    for person in scene.people:
        off = [np.linalg.norm(b.joints[0] - person.joints[0]) for b in result.bodies]
        assert min(off) < 0.1  # a hand's width, with sensor and keypoint noise


def test_bodies_come_nearest_first_with_masks_of_their_own(result: FrameResult) -> None:
    depth = [b.joints[0, 2] for b in result.bodies]
    assert depth == sorted(depth)
    assert not (result.bodies[0].mask & result.bodies[1].mask).any()


def test_masks_lie_on_the_people(scene: SyntheticScene, result: FrameResult) -> None:
    people = np.any([p.mask for p in scene.people], axis=0)
    found = np.any([b.mask for b in result.bodies], axis=0)
    assert (found & people).sum() / found.sum() > 0.9


def test_a_nearer_person_hides_others_also_in_holes_of_depth(
    scene: SyntheticScene, result: FrameResult
) -> None:
    nearer, depth_m = result.bodies[0], scene.frame.depth_m.copy()
    holes = nearer.mask & (np.random.default_rng(0).random(depth_m.shape) < 0.2)
    depth_m[holes] = np.nan
    seen = Scene(
        RgbdFrame(scene.frame.rgb, depth_m, scene.frame.camera), None, USUAL_NOISE,
        np.zeros(depth_m.shape, dtype=bool))
    pipeline = BodyPipeline(default_body(), default_library(), Given([]))
    behind = pipeline.behind(seen, nearer)
    np.testing.assert_array_equal(behind.taken, nearer.mask)
    filled = holes & np.isfinite(behind.frame.depth_m)
    assert filled.sum() > 0.8 * holes.sum()
    off_m = np.abs(behind.frame.depth_m[filled] - scene.true_depth_m[filled])
    assert np.median(off_m) < 0.03
    there = ~np.isnan(depth_m) | ~nearer.mask
    np.testing.assert_array_equal(behind.frame.depth_m[there], depth_m[there])


def test_who_is_found_behind_others_sees_no_holes_in_them(
    scene: SyntheticScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a single frame, and in the first one of a recording."""
    depth_m = scene.frame.depth_m.copy()
    depth_m[np.random.default_rng(1).random(depth_m.shape) < 0.1] = np.nan
    frame = RgbdFrame(scene.frame.rgb, depth_m, scene.frame.camera)
    pipeline = BodyPipeline(
        default_body(), default_library(),
        Given([d for d in scene.detections() if d is not None]))
    holes, fit_person = [], BodyPipeline.fit_person

    def watched(self: BodyPipeline, seen: Scene, *arguments: Any) -> PersonFit:
        if seen.taken.any():
            holes.append(float(np.isnan(seen.frame.depth_m[seen.taken]).mean()))
        return fit_person(self, seen, *arguments)

    monkeypatch.setattr(BodyPipeline, 'fit_person', watched)
    for look in (pipeline.process, BodyTracker(pipeline).process):
        holes.clear()
        assert len(look(frame).bodies) == 2
        assert len(holes) == 1
        assert holes[0] < 0.01


def test_hidden_joints_are_called_hidden(scene: SyntheticScene, result: FrameResult) -> None:
    agree = []
    for person in scene.people:
        body = min(result.bodies, key=lambda b: np.linalg.norm(b.joints[0] - person.joints[0]))
        known = body.joint_state != JointState.UNKNOWN
        agree.append(((body.joint_state == 0) == (person.joint_state == 0))[known])
    assert np.mean(np.concatenate(agree)) > 0.8


def test_the_same_frame_gives_the_same_bodies(scene: SyntheticScene, result: FrameResult) -> None:
    again = run(scene.frame, [d for d in scene.detections() if d is not None])
    for first, second in zip(result.bodies, again.bodies, strict=True):
        np.testing.assert_array_equal(first.vertices, second.vertices)


def test_backs_taken_for_fronts_give_the_same_bodies(
    scene: SyntheticScene, result: FrameResult
) -> None:
    """A detector that confuses left and right in every joint of everybody."""
    detections = [d.with_sides_exchanged() for d in scene.detections() if d is not None]
    found = run(scene.frame, detections)
    for body in result.bodies:
        off = [np.linalg.norm(other.joints - body.joints, axis=1).mean() for other in found.bodies]
        assert min(off) < 0.06


def test_while_people_are_fitted_products_have_one_thread(
    scene: SyntheticScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    def threads() -> set[int]:
        return {info['num_threads'] for info in threadpool_info() if info['user_api'] == 'blas'}

    during, fit = [], BodyFitter.fit

    def watched(self: BodyFitter, *arguments: Any) -> BodyFit:
        during.append(threads())
        return fit(self, *arguments)

    monkeypatch.setattr(BodyFitter, 'fit', watched)
    with threadpool_limits(2, 'blas'):
        run(scene.frame, [d for d in scene.detections() if d is not None])
        assert threads() == {2}
    assert during
    assert all(each == {1} for each in during)


def test_nobody_detected_is_an_empty_result(scene: SyntheticScene) -> None:
    empty = run(scene.frame, [])
    assert empty.bodies == ()
    assert empty.statuses == ()


def test_a_person_without_depth_is_a_status_not_an_exception(scene: SyntheticScene) -> None:
    blind = RgbdFrame(scene.frame.rgb, np.full_like(scene.frame.depth_m, np.nan),
                      scene.frame.camera)
    found = run(blind, [d for d in scene.detections() if d is not None])
    assert found.bodies == ()
    assert set(found.statuses) == {EstimateStatus.TOO_FEW_JOINTS}


def test_keypoints_on_an_empty_wall_are_nobody(scene: SyntheticScene) -> None:
    """A poster of a person: flat depth where a body should be."""
    wall = RgbdFrame(scene.frame.rgb, np.full_like(scene.frame.depth_m, 3.0), scene.frame.camera)
    found = run(wall, [d for d in scene.detections() if d is not None])
    for body in found.bodies:
        assert np.isfinite(body.vertices).all()


def test_people_outside_the_region_of_interest_are_left_alone(
    scene: SyntheticScene, result: FrameResult
) -> None:
    detections = [d for d in scene.detections() if d is not None]
    anywhere = BodyPipeline(default_body(), default_library(), Given(detections))
    near, far = sorted(anywhere.lift(scene.frame, d).distance_m for d in detections)
    config = PipelineConfig(region=RegionConfig(z_max_m=(near + far) / 2))
    pipeline = BodyPipeline(default_body(), default_library(), Given(detections), config)
    found = pipeline.process(scene.frame)
    assert len(found.bodies) == 1
    np.testing.assert_allclose(found.bodies[0].joints, result.bodies[0].joints, atol=1e-9)
    assert sorted(status.name for status in found.statuses) == ['OK', 'OUTSIDE']


def test_what_hides_the_legs_is_nobodys_floor(
    scene: SyntheticScene, result: FrameResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    floor = find_ground(scene.frame)
    assert floor is not None
    seat = Ground(floor.normal, floor.offset_m - 0.5)
    monkeypatch.setattr('pop_core.pipeline.find_ground', lambda _: seat)
    detections = [d for d in scene.detections() if d is not None]
    pipeline = BodyPipeline(default_body(), default_library(), Given(detections))
    found = pipeline.process(scene.frame)
    assert len(found.bodies) == len(result.bodies)
    for body, usual in zip(found.bodies, result.bodies, strict=True):
        assert np.linalg.norm(body.joints - usual.joints, axis=1).mean() < 0.05


class Told(JointCompletion):
    """A completion network that is asked, and of whose answers another thing is said."""

    def __init__(self, off_m: float, sigma_m: float | None = None) -> None:
        super().__init__(load_completion().session)
        self.off_m, self.sigma_m, self.asked = off_m, sigma_m, 0

    def expected(self, *arguments: Any) -> JointBelief | None:
        self.asked += 1
        belief = super().expected(*arguments)
        if belief is None:
            return None
        sigma_m = belief.sigma_m if self.sigma_m is None else np.full(15, self.sigma_m)
        return JointBelief(belief.positions_camera + [self.off_m, 0.0, self.off_m], sigma_m)


def test_hidden_joints_are_asked_for_unless_that_is_off(scene: SyntheticScene) -> None:
    detections = [d for d in scene.detections() if d is not None]
    for use, asked in ((True, 4), (False, 0)):  # of two people, and with their sides exchanged
        told = Told(0.0)
        pipeline = BodyPipeline(
            default_body(), default_library(), Given(detections),
            PipelineConfig(use_completion=use), completion=told)
        assert len(pipeline.process(scene.frame).bodies) == 2
        assert told.asked == asked


@pytest.mark.parametrize(('off_m', 'sigma_m', 'used'), [
    (0.2, 0.01, False), (3.0, 0.01, False), (0.1, 0.06, True)])
def test_a_network_that_is_wrong_leaves_people_where_they_are(
    scene: SyntheticScene, result: FrameResult, monkeypatch: pytest.MonkeyPatch,
    off_m: float, sigma_m: float, used: bool,
) -> None:
    told, fit = [], BodyFitter.fit

    def watched(self: BodyFitter, seen: Observation, *arguments: Any) -> BodyFit:
        told.append(seen.expected is not None)
        return fit(self, seen, *arguments)

    monkeypatch.setattr(BodyFitter, 'fit', watched)
    detections = [d for d in scene.detections() if d is not None]
    pipeline = BodyPipeline(
        default_body(), default_library(), Given(detections), completion=Told(off_m, sigma_m))
    found = pipeline.process(scene.frame)
    assert told
    assert all(each == used for each in told)
    assert len(found.bodies) == len(result.bodies)
    for body, usual in zip(found.bodies, result.bodies, strict=True):
        assert np.linalg.norm(body.joints[0] - usual.joints[0]) < 0.1


def test_sides_are_exchanged_where_depth_is_surer_and_the_fit_costs_clearly_less(
    scene: SyntheticScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fit's own attempts to turn about set aside: they would undo most of it."""
    named = [d for d in scene.detections() if d is not None]
    wrong = [d.with_sides_exchanged() for d in named]
    read, fit_as_read = [], BodyPipeline._fit_as_read

    def watched(self: BodyPipeline, seen: Scene, reading: Reading, *arguments: Any) -> PersonFit:
        read.append(reading)
        return fit_as_read(self, seen, reading, *arguments)

    monkeypatch.setattr(BodyPipeline, '_fit_as_read', watched)
    run(scene.frame, named)
    assert len(read) == len(named)
    for cost, exchanged in ((0.89, True), (0.91, False)):
        read.clear()
        monkeypatch.setattr(BodyFitter, 'costs', lambda *_, cost=cost: [cost, 1.0])
        pipeline = BodyPipeline(default_body(), default_library(), Given(wrong))
        people = watched_people(pipeline, scene.frame)
        assert len(read) == 2 * len(wrong)
        for person, readings in zip(people, (read[:2], read[2:]), strict=True):
            assert person.observation is not None
            np.testing.assert_array_equal(
                person.observation.lifted.positions_camera,
                readings[exchanged].lifted.without_guesses().positions_camera)


def test_without_other_readings_nobody_is_read_twice(scene: SyntheticScene) -> None:
    wrong = [d.with_sides_exchanged() for d in scene.detections() if d is not None]
    told = Told(0.0)
    config = PipelineConfig(fitting=FittingConfig(other_readings=False))
    pipeline = BodyPipeline(
        default_body(), default_library(), Given(wrong), config, completion=told)
    pipeline.process(scene.frame)
    assert told.asked == len(wrong)


def watched_people(pipeline: BodyPipeline, frame: RgbdFrame) -> list[PersonFit]:
    """Return what became of every person of a frame, nearest first."""
    people, fit_person = [], pipeline.fit_person

    def watched(*arguments: Any) -> PersonFit:
        people.append(fit_person(*arguments))
        return people[-1]

    pipeline.fit_person = watched  # type: ignore[method-assign]
    pipeline.process(frame)
    return people
