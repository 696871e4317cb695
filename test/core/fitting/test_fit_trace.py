"""Watching a fit changes nothing, and shows it fall."""

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.fit_trace import (
    FREE_SPACE,
    JOINTS,
    POLISH,
    SURFACE,
    TracedStep,
    TracedSteps,
)
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.observation import observe
from pop_core.geometry.rotation import from_rotvec
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import load_pose_prior


def candidates(body: BodyModel, person: BodyParameters) -> list[PoseCandidate]:
    """Three neighbours in the library, each somewhat off."""
    rng = np.random.default_rng(0)
    found = []
    for _ in range(3):
        pose = person.replaced(
            body_pose=person.body_pose + 0.15 * rng.normal(size=(23, 3)),
            transl=person.transl + 0.05 * rng.normal(size=3))
        p = attached_positions(shared_points(body), body, pose)
        found.append(PoseCandidate(
            pose.body_pose, p, pose.scale, from_rotvec(pose.global_orient), pose.transl, 0.02,
            1.0, 0))
    return found


@pytest.fixture
def watched(body: BodyModel, person: BodyParameters) -> tuple[BodyFit, BodyFit, list[TracedStep]]:
    """The same fit without and with an onlooker, and what the onlooker saw."""
    nobody = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
    observation = observe(photograph(body, person), lift_truth(body, person), nobody)
    fitter = BodyFitter(body, load_pose_prior())
    start = candidates(body, person)
    plain = fitter.fit(observation, start)
    onlooker = fitter.steps = TracedSteps(fitter.steps)
    first, second = fitter.fit(observation, start), fitter.fit(observation, start)
    steps, again = onlooker.take_traces()
    assert steps == again
    assert onlooker.take_traces() == []
    assert np.array_equal(first.parameters.transl, second.parameters.transl)
    return plain, first, steps


def test_a_watched_fit_is_the_same_fit(
    watched: tuple[BodyFit, BodyFit, list[TracedStep]]
) -> None:
    plain, traced, _ = watched
    assert np.array_equal(plain.parameters.body_pose, traced.parameters.body_pose)
    assert plain.energies == traced.energies


def test_every_hypothesis_is_seen_and_the_winner_to_the_end(
    watched: tuple[BodyFit, BodyFit, list[TracedStep]]
) -> None:
    steps = watched[2]
    assert {step.hypothesis for step in steps} == {0, 1, 2}
    winner = [step.stage for step in steps if step.hypothesis == steps[-1].hypothesis]
    assert list(dict.fromkeys(winner)) == [JOINTS, SURFACE, FREE_SPACE, POLISH]
    assert sum(step.stage == POLISH for step in steps) == FittingConfig().polish_steps


def test_the_depth_energy_of_a_fit_in_full_view_falls_to_a_fraction(
    watched: tuple[BodyFit, BodyFit, list[TracedStep]]
) -> None:
    steps = watched[2]
    own = [step.depth for step in steps if step.hypothesis == steps[-1].hypothesis]
    assert own[-1] < 0.5 * own[0]
