import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting import sight_kernels
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.depth_consistency import (
    HidingPlaces,
    Sight,
    depth_energy,
    free_space_pairs,
    free_space_violation,
    see_body,
)
from pop_core.fitting.observation import Observation, observe
from pop_core.rgbd import RgbdFrame

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)


def look(body: BodyModel, person: BodyParameters, frame: RgbdFrame) -> Observation:
    return observe(frame, lift_truth(body, person), NOBODY)


def body_pixels(body: BodyModel, person: BodyParameters, observation: Observation) -> np.ndarray:
    return observation.depth_m < 3.5


def test_the_kernel_means_the_same_by_each_sight() -> None:
    assert {sight.name: getattr(sight_kernels, sight.name) for sight in Sight} == {
        sight.name: sight.value for sight in Sight}


def test_the_true_body_contradicts_nothing(body: BodyModel, person: BodyParameters) -> None:
    frame = photograph(body, person)
    observation = look(body, person, frame)
    state = FitBody(body, full=False).state(person)
    visibility = see_body(state, observation)
    sight = visibility.sight
    # Vertices at the very rim project onto the wall beside the body, a coarse pixel wide.
    assert (sight == Sight.CONTRADICTED).mean() < 0.1
    assert (sight == Sight.VISIBLE).mean() > 0.3
    segment = body_pixels(body, person, observation)
    assert depth_energy(visibility.rendered.depth_m, observation, segment) < 0.01


def test_something_in_front_hides_and_costs_nothing(
    body: BodyModel, person: BodyParameters
) -> None:
    frame = photograph(body, person)
    depth = frame.depth_m.copy()
    depth[130:] = 1.5
    observation = look(body, person, RgbdFrame(frame.rgb, depth, CAMERA))
    state = FitBody(body, full=False).state(person)
    visibility = see_body(state, observation)
    below = observation.depth_at(state.vertices)[0] == np.float32(1.5)
    hidden = (visibility.sight == Sight.SCENE_OCCLUDED) | (visibility.sight == Sight.SELF_OCCLUDED)
    assert below.any()
    assert hidden[below].all()
    segment = (observation.depth_m > 1.6) & (observation.depth_m < 3.5)
    assert depth_energy(visibility.rendered.depth_m, observation, segment) < 0.01


def test_an_arm_in_the_open_is_pulled_to_the_body(
    body: BodyModel, person: BodyParameters
) -> None:
    frame = photograph(body, person)
    observation = look(body, person, frame)
    raised = person.body_pose.copy()
    raised[15, 2] = 0.3  # the left arm stretched out, where the camera sees the wall
    state = FitBody(body, full=False).state(person.replaced(body_pose=raised))
    visibility = see_body(state, observation)
    segment = body_pixels(body, person, observation)
    places = HidingPlaces(observation, segment, state.vertices[:, 2])
    pairs = free_space_pairs(state, visibility, places)
    hand = np.isin(state.body.main_bone[pairs.vertex],
                   [JOINT_INDEX['left_wrist'], JOINT_INDEX['left_hand']])
    toward = np.einsum('nc,nc->n', pairs.direction, pairs.target - state.vertices[pairs.vertex])
    sideways = hand & (pairs.direction[:, 0] == 1)
    assert sideways.any()
    # Facing the camera, the person's left hand is on the right of the image: inward is -x.
    assert toward[sideways].max() < 0


def test_energy_and_violation_grow_when_the_body_steps_forward(
    body: BodyModel, person: BodyParameters
) -> None:
    frame = photograph(body, person)
    observation = look(body, person, frame)
    segment = body_pixels(body, person, observation)
    energies, violations = [], []
    for step_m in (0.0, 0.06, 0.12):
        nearer = person.replaced(transl=person.transl - [0, 0, step_m])
        visibility = see_body(FitBody(body, full=False).state(nearer), observation)
        energies.append(depth_energy(visibility.rendered.depth_m, observation, segment))
        violations.append(free_space_violation(visibility.rendered, observation.depth_m))
    assert energies == sorted(energies)
    # Its gap, plus the rim: a nearer body is larger in the image, and there the gap is cut off.
    assert energies[-1] == pytest.approx(0.12, abs=0.03)
    assert violations[0] < 0.05
    assert violations[-1] > 0.9


def test_the_energy_is_that_of_the_composed_depth_image() -> None:
    rng = np.random.default_rng(5)
    body, measured = rng.uniform(1.9, 2.2, (2, 30, 40)).astype(np.float32)
    body[rng.random(body.shape) < 0.5] = np.inf
    measured[rng.random(body.shape) < 0.1] = np.nan
    segment = rng.random(body.shape) < 0.4
    rest = np.where(segment, np.inf, measured)  # the scene without the person
    error = np.minimum(np.abs(np.fmin(body, rest) - measured), 0.15)
    assert sight_kernels.mean_misfit(body, measured, segment, 0.15) == pytest.approx(
        np.nansum(error) / segment.sum(), rel=1e-5)


def test_missing_depth_contradicts_nothing(body: BodyModel, person: BodyParameters) -> None:
    frame = photograph(body, person)
    nothing = RgbdFrame(frame.rgb, np.full_like(frame.depth_m, np.nan), CAMERA)
    visibility = see_body(
        FitBody(body, full=False).state(person), look(body, person, nothing))
    assert set(np.unique(visibility.sight)) <= {Sight.UNKNOWN, Sight.SELF_OCCLUDED}
