"""What hangs together with the skeleton is the person's, though no hypothesis is there."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.depth_consistency import render_body
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.hypotheses import HypothesisSteps
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.unclaimed_surface import LARGEST_M2, MOST_M2, UnclaimedSurface
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.body_segmentation import SegmentationConfig

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
ARM = ('left_elbow', 'left_wrist')


@pytest.fixture(scope='module')
def pointing(person: BodyParameters) -> BodyParameters:
    """The person with one arm spread."""
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1] += (0.0, 0.0, 1.1)
    return person.replaced(body_pose=pose)


def seen(
    body: BodyModel, person: BodyParameters, frame: RgbdFrame, *missed: str
) -> Observation:
    gone = np.zeros(15, dtype=bool)
    gone[[SHARED_INDEX[name] for name in missed]] = True
    return observe(frame, lift_truth(body, person).without(gone), NOBODY)


def claimed(body: BodyModel, person: BodyParameters, observation: Observation) -> np.ndarray:
    steps = HypothesisSteps(body, FittingConfig(), SegmentationConfig())
    state = FitBody(body, full=False).state(person)
    return steps.segment(render_body(state, observation), observation)


def test_an_arm_without_keypoints_is_unclaimed_where_the_body_has_it_elsewhere(
    body: BodyModel, person: BodyParameters, pointing: BodyParameters
) -> None:
    observation = seen(body, pointing, photograph(body, pointing), *ARM)
    surface = UnclaimedSurface(observation)
    found = surface.pieces(claimed(body, person, observation))
    arm = claimed(body, pointing, observation) & ~claimed(body, person, observation)
    assert (found & arm).sum() > 0.6 * arm.sum()  # a hand is two pixels thin
    assert (found & ~arm).sum() < 0.2 * arm.sum()


def test_a_body_that_explains_everything_leaves_nothing(
    body: BodyModel, pointing: BodyParameters
) -> None:
    observation = seen(body, pointing, photograph(body, pointing), *ARM)
    surface = UnclaimedSurface(observation)
    assert not surface.pieces(claimed(body, pointing, observation)).any()


def test_a_wall_that_a_person_leans_on_is_nobodys(
    body: BodyModel, person: BodyParameters, pointing: BodyParameters
) -> None:
    """Depth has no step where the back touches the wall."""
    frame = photograph(body, pointing)
    wall_m = np.float32(pointing.transl[2] + 0.05)
    behind = replace(frame, depth_m=np.minimum(frame.depth_m, wall_m))
    observation = seen(body, pointing, behind, *ARM)
    found = UnclaimedSurface(observation).pieces(claimed(body, person, observation))
    wall = observation.depth_m >= wall_m
    assert found.any()
    assert not (found & wall).any()


def test_many_pieces_together_are_something_else(
    body: BodyModel, person: BodyParameters
) -> None:
    """Surface that goes on from a sitter to a soft seat is left out piece by piece."""
    observation = seen(body, person, photograph(body, person))
    whole = claimed(body, person, observation)
    row = np.flatnonzero(whole.any(axis=1))
    bands = (np.arange(len(whole)) - row[0]) % 8 < 6
    pixel_m2 = (observation.depth_m / observation.camera.fx) ** 2
    assert pixel_m2[whole & bands[:, None]].sum() > MOST_M2
    surface = UnclaimedSurface(observation)
    assert not surface.pieces(whole & ~bands[:, None]).any()
    two = bands & (np.arange(len(whole)) < row[0] + 16)
    assert surface.pieces(whole & ~two[:, None]).any()


def test_more_than_a_limb_is_something_else(body: BodyModel, person: BodyParameters) -> None:
    observation = seen(body, person, photograph(body, person))
    nothing = np.zeros_like(observation.own)
    area_m2 = ((observation.depth_m / observation.camera.fx) ** 2)[observation.own].sum()
    assert area_m2 > LARGEST_M2
    assert not UnclaimedSurface(observation).pieces(nothing).any()
