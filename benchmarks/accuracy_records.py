"""All figures of one person of one scene, as plain numbers that go into a file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment

from benchmarks import metrics
from benchmarks.accuracy_methods import Guess
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.estimate import JointState
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rgbd import flying_pixels, point_cloud
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.truth import PersonTruth

Record = dict[str, Any]
MATCH_M = 1.0          # a body farther from everybody's pelvis is nobody's
MOST_POINTS = 2500     # of a person, for Eq. 8: the mean changes by less than 0.1 mm
CURVE_M = np.arange(0.0, 0.1001, 0.005)  # where the cumulative curves are sampled


def match(
    model: BodyModel, guesses: Sequence[Guess], people: Sequence[PersonTruth]
) -> dict[int, int]:
    """Return the guess of each person: nearest pelvis, one to one, at most MATCH_M away."""
    if not guesses or not people:
        return {}
    found = np.array([joints(model, guess.parameters)[0] for guess in guesses])
    true = np.array([person.joints[0] for person in people])
    distance = np.linalg.norm(true[:, None] - found[None], axis=2)
    pairs = zip(*linear_sum_assignment(distance), strict=True)
    return {int(p): int(g) for p, g in pairs if distance[p, g] < MATCH_M}


def person_record(
    model: BodyModel, scene: SyntheticScene, person: PersonTruth, guess: Guess | None
) -> Record:
    """Return the figures of one person; without a guess only who it was."""
    record: Record = {
        'seed': scene.seed, 'kind': person.kind, 'sensor': scene.sensor,
        'bare': person.clothes_m == 0.0, 'child': person.parameters.scale != 1.0,
        'hidden_share': person.hidden_share, 'found': guess is not None,
        'state': person.joint_state.tolist(),
    }
    if guess is not None:
        record |= _joint_figures(model, person, guess)
        record |= _shape_figures(model, person, guess.parameters)
        record |= _surface_figures(model, scene, person, guess.parameters)
        if guess.mask is not None:
            scores = metrics.mask_scores(guess.mask, person.mask)
            record |= dict(zip(('iou', 'precision', 'recall'), scores, strict=True))
    return record


def _joint_figures(model: BodyModel, person: PersonTruth, guess: Guess) -> Record:
    """Return Eq. 4-7, their aligned relatives and the calibration of stated covariances."""
    estimate = joints(model, guess.parameters)
    errors = metrics.joint_errors(estimate, person.joints)
    shared = metrics.pose_joints()
    visible = person.joint_state == JointState.VISIBLE
    out: Record = {
        'errors_m': errors.round(5).tolist(),
        'err_J': metrics.mean_over(errors, metrics.smpl_joints()),
        'err_pose': metrics.mean_over(errors, shared),
        'err_visible': metrics.mean_over(errors, shared & visible),
        'err_occluded': metrics.mean_over(errors, shared & ~visible),
        'mpjpe_root': metrics.root_aligned_error(estimate, person.joints),
        'pa_mpjpe': metrics.procrustes_aligned_error(estimate, person.joints),
        'map_10cm': metrics.share_within(errors[shared], 0.10),
        'oracle_pose': _oracle(model, person, guess),
    }
    for state in (JointState.SELF_OCCLUDED, JointState.SCENE_OCCLUDED, JointState.OUT_OF_IMAGE):
        name = f'err_{state.name.lower()}'
        out[name] = metrics.mean_over(errors, shared & (person.joint_state == state))
    if guess.joint_covariance is not None:
        squared = metrics.mahalanobis2(estimate, person.joints, guess.joint_covariance)
        out['mahalanobis2'] = squared.round(4).tolist()
    return out


def _oracle(model: BodyModel, person: PersonTruth, guess: Guess) -> float:
    """Return err_pose of the best hypothesis: what a perfect choice among them would reach."""
    every = (guess.parameters, *guess.runners_up)
    return min(
        metrics.mean_over(
            metrics.joint_errors(joints(model, p), person.joints), metrics.pose_joints())
        for p in every)


def _shape_figures(model: BodyModel, person: PersonTruth, estimate: BodyParameters) -> Record:
    truth = person.parameters
    height = metrics.stature(model, estimate) - metrics.stature(model, truth)
    return {
        'err_beta': metrics.shape_error(model, estimate, truth),
        'tpose': metrics.tpose_error(model, estimate, truth),
        'stature': abs(height),
        'too_tall': height,
        'pve': metrics.vertex_error(vertices(model, estimate), person.vertices),
    }


def _surface_figures(
    model: BodyModel, scene: SyntheticScene, person: PersonTruth, estimate: BodyParameters
) -> Record:
    """Return Eq. 8 of the estimate and of the truth body on the same measured points."""
    mesh = vertices(model, estimate)
    points = observed_points(scene, person)
    out: Record = {}
    for suffix, body in (('', mesh), ('_truth', person.vertices)):
        rendered = render_depth(body, model.f, scene.frame.camera)
        out[f'free_space{suffix}'] = metrics.free_space_violation(
            rendered, scene.frame.depth_m)
    if len(points) == 0:
        return out
    for suffix, body in (('', mesh), ('_truth', person.vertices)):
        to_surface = metrics.distance_to_surface(points, body, model.f)
        to_vertices = metrics.distance_to_vertices(points, body)
        out[f'p2p_vertex{suffix}'] = float(to_vertices.mean())
        out[f'p2p_surface{suffix}'] = float(to_surface.mean())
        out[f'curve{suffix}'] = [
            round(metrics.share_within(to_vertices, limit), 4) for limit in CURVE_M]
    out['p2p_above_truth'] = out['p2p_surface'] - out['p2p_surface_truth']
    out['within_3cm'], out['within_6cm'] = out['curve'][6], out['curve'][12]
    return out


def observed_points(
    scene: SyntheticScene, person: PersonTruth
) -> Float[np.ndarray, 'n 3']:
    """Return measured points of a person [m]: true mask, no flying pixels, at most MOST_POINTS."""
    depth_m = scene.frame.depth_m
    with np.errstate(invalid='ignore'):
        near_truth = np.abs(depth_m - scene.true_depth_m) < 0.15
    flying = flying_pixels(depth_m, scene.frame.camera.fx)
    points, _ = point_cloud(scene.frame, person.mask & near_truth & ~flying)
    rng = np.random.default_rng([scene.seed, 11])
    if len(points) > MOST_POINTS:
        points = points[rng.choice(len(points), MOST_POINTS, replace=False)]
    return points
