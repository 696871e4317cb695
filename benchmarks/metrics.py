"""Errors of estimated bodies against known truth: Eq. 3-8 of the paper and what it leaves out.

Camera frame, metres, absolute (nothing is aligned) unless a function says so.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy.spatial import cKDTree

from pop_core.body.joints import SHARED
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import tpose_vertices
from pop_core.rendering.depth_renderer import RenderedDepth

# Squared Mahalanobis radius of the ellipsoid that holds 68 and 95 % of a 3D normal distribution.
CHI2_3_68, CHI2_3_95 = 3.5059, 7.8147
FREE_SPACE_M = 0.05


def shape_error(
    model: BodyModel, estimate: BodyParameters, truth: BodyParameters
) -> float:
    """Return |beta_gt - beta| / |beta_gt| (Eq. 3), scale folded into beta on both sides."""
    folded_truth = folded_betas(model, truth)
    difference = folded_truth - folded_betas(model, estimate)
    return float(np.linalg.norm(difference) / np.linalg.norm(folded_truth))


def folded_betas(model: BodyModel, parameters: BodyParameters) -> Float[np.ndarray, 'b']:
    """Return the betas whose T-pose at scale 1 is nearest to a scaled one (least squares).

    T-poses are compared up to a shift: where a body floats in its own frame is not its shape.
    """
    if parameters.scale == 1.0:
        return parameters.betas
    centred = model.v_template - model.v_template.mean(axis=0)
    directions = model.shapedirs - model.shapedirs.mean(axis=0)
    A = directions.reshape(-1, model.n_betas)
    grown = (parameters.scale - 1.0) * centred.ravel() + parameters.scale * (A @ parameters.betas)
    return np.linalg.lstsq(A, grown, rcond=None)[0]


def joint_errors(
    estimate: Float[np.ndarray, 'n 3'], truth: Float[np.ndarray, 'n 3']
) -> Float[np.ndarray, 'n']:
    """Return the distance of each joint from its true place [m]: the summand of Eq. 4-7."""
    return np.linalg.norm(estimate - truth, axis=1)


def mean_over(errors: Float[np.ndarray, '24'], chosen: Bool[np.ndarray, '24']) -> float:
    """Return the mean error of some joints [m], NaN when there are none (Eq. 4-7)."""
    return float(errors[chosen].mean()) if chosen.any() else float('nan')


def smpl_joints() -> Bool[np.ndarray, '24']:
    """Return the 23 joints of Eq. 4: all but the root, which only tells the placement."""
    chosen = np.ones(24, dtype=bool)
    chosen[0] = False
    return chosen


def pose_joints() -> Bool[np.ndarray, '24']:
    """Return the 14 joints of Eq. 5: those shared with OpenPose, without the root."""
    chosen = np.zeros(24, dtype=bool)
    chosen[SHARED] = True
    chosen[0] = False
    return chosen


def root_aligned_error(
    estimate: Float[np.ndarray, 'n 3'], truth: Float[np.ndarray, 'n 3']
) -> float:
    """Return the mean joint error [m] after both roots are put at the origin (MPJPE)."""
    return float(joint_errors(estimate - estimate[0], truth - truth[0]).mean())


def procrustes_aligned_error(
    estimate: Float[np.ndarray, 'n 3'], truth: Float[np.ndarray, 'n 3']
) -> float:
    """Return the mean joint error [m] after the best similarity (PA-MPJPE; Umeyama 1991)."""
    a, b = estimate - estimate.mean(axis=0), truth - truth.mean(axis=0)
    u, s, vt = np.linalg.svd(a.T @ b)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = u @ (signs[:, None] * vt)
    scale = (s * signs).sum() / (a**2).sum()
    return float(joint_errors(scale * a @ rotation, b).mean())


def share_within(errors: Float[np.ndarray, 'n'], limit_m: float) -> float:
    """Return the share of errors below a limit; over joints at 10 cm this is mAP@10 cm.

    As on the ITOP data (Haque et al. 2016), where a joint counts when it is nearer than 10 cm.
    """
    return float((errors < limit_m).mean()) if len(errors) else float('nan')


def vertex_error(
    estimate: Float[np.ndarray, 'v 3'], truth: Float[np.ndarray, 'v 3']
) -> float:
    """Return the mean distance of corresponding vertices [m] (PVE)."""
    return float(joint_errors(estimate, truth).mean())


def tpose_error(model: BodyModel, estimate: BodyParameters, truth: BodyParameters) -> float:
    """Return the mean vertex distance of the two T-poses [m], centred: shape without pose."""
    a, b = tpose_vertices(model, estimate), tpose_vertices(model, truth)
    return vertex_error(a - a.mean(axis=0), b - b.mean(axis=0))


def stature(model: BodyModel, parameters: BodyParameters) -> float:
    """Return the height of a T-pose from sole to crown [m]."""
    return float(np.ptp(tpose_vertices(model, parameters)[:, 1]))


def distance_to_vertices(
    points: Float[np.ndarray, 'n 3'], vertices: Float[np.ndarray, 'v 3']
) -> Float[np.ndarray, 'n']:
    """Return the distance of each point to its nearest vertex [m]: the summand of Eq. 8."""
    return np.asarray(cKDTree(vertices).query(points)[0])


def distance_to_surface(
    points: Float[np.ndarray, 'n 3'], vertices: Float[np.ndarray, 'v 3'],
    faces: Int[np.ndarray, 'm 3'], candidates: int = 12,
) -> Float[np.ndarray, 'n']:
    """Return the distance of each point to a mesh [m].

    Of each point only the `candidates` triangles with the nearest centres are looked at: enough
    for meshes of even triangles (compared with all of them in the tests).
    """
    corners = vertices[faces]
    _, near = cKDTree(corners.mean(axis=1)).query(points, k=min(candidates, len(faces)))
    near = np.asarray(near).reshape(len(points), -1)
    flat = corners[near.ravel()]
    repeated = np.repeat(points, near.shape[1], axis=0)
    distance = distance_to_triangles(repeated, flat[:, 0], flat[:, 1], flat[:, 2])
    return distance.reshape(near.shape).min(axis=1)


def distance_to_triangles(
    p: Float[np.ndarray, 'n 3'], a: Float[np.ndarray, 'n 3'], b: Float[np.ndarray, 'n 3'],
    c: Float[np.ndarray, 'n 3'],
) -> Float[np.ndarray, 'n']:
    """Return the distance of each point to its own triangle [m]: the plane's or an edge's."""
    e1, e2, d = b - a, c - a, p - a
    s11, s12, s22 = ((x * y).sum(axis=1) for x, y in ((e1, e1), (e1, e2), (e2, e2)))
    t1, t2 = (d * e1).sum(axis=1), (d * e2).sum(axis=1)
    determinant = np.maximum(s11 * s22 - s12**2, 1e-18)
    v, w = (s22 * t1 - s12 * t2) / determinant, (s11 * t2 - s12 * t1) / determinant
    normal = np.cross(e1, e2)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    plane = np.abs((d * normal).sum(axis=1)) / length
    edges = np.minimum(
        distance_to_segments(p, a, b),
        np.minimum(distance_to_segments(p, b, c), distance_to_segments(p, c, a)))
    return np.where((v >= 0) & (w >= 0) & (v + w <= 1), plane, edges)


def distance_to_segments(
    p: Float[np.ndarray, 'n 3'], a: Float[np.ndarray, 'n 3'], b: Float[np.ndarray, 'n 3']
) -> Float[np.ndarray, 'n']:
    """Return the distance of each point to its own segment [m]."""
    along = b - a
    share = ((p - a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-18)
    return np.linalg.norm(p - a - np.clip(share, 0.0, 1.0)[:, None] * along, axis=1)


def free_space_violation(rendered: RenderedDepth, depth_m: Float32[np.ndarray, 'h w']) -> float:
    """Return the share of a body's pixels that stand 5 cm or more before what was measured.

    The sensor looked through these places: no body can be there.
    """
    known = rendered.covered & np.isfinite(depth_m)
    if not known.any():
        return float('nan')
    return float((rendered.depth_m[known] < depth_m[known] - FREE_SPACE_M).mean())


def mask_scores(
    estimate: Bool[np.ndarray, 'h w'], truth: Bool[np.ndarray, 'h w']
) -> tuple[float, float, float]:
    """Return intersection over union, precision and recall of a mask."""
    both = float((estimate & truth).sum())
    union = max(float((estimate | truth).sum()), 1.0)
    precision = both / max(float(estimate.sum()), 1.0)
    recall = both / max(float(truth.sum()), 1.0)
    return both / union, precision, recall


def mahalanobis2(
    estimate: Float[np.ndarray, 'n 3'], truth: Float[np.ndarray, 'n 3'],
    covariance: Float[np.ndarray, 'n 3 3'],
) -> Float[np.ndarray, 'n']:
    """Return squared errors in units of their stated covariance; below CHI2_3_68 for 68 %."""
    difference = estimate - truth
    solved = np.linalg.solve(covariance, difference[..., None])[..., 0]
    return (difference * solved).sum(axis=1)
