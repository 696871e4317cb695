"""What a perfect depth network would say about a scene, cell by cell (slow and plain)."""

from types import SimpleNamespace

import numpy as np

from pop_core.keypoints.body_parts import CLASS_OF_LABEL, N_CLASSES

STRIDE = 4
SURE = 12.0  # logit


def truth_maps(scene, sigma_m=0.02):
    """Return parts, votes, log sigma and visibility of a TrainingScene."""
    height, width = scene.depth_m.shape
    rows, columns = height // STRIDE, width // STRIDE
    parts = np.zeros((N_CLASSES, rows, columns), dtype=np.float32)
    votes = np.zeros((45, rows, columns), dtype=np.float32)
    visible = np.zeros((15, rows, columns), dtype=np.float32)
    rounded_m = np.rint(scene.depth_m * 1e3) / 1e3  # as scenes are packed
    depth_m = np.where(np.isfinite(rounded_m), rounded_m, np.inf)
    for r in range(rows):
        for c in range(columns):
            block = depth_m[r * STRIDE:(r + 1) * STRIDE, c * STRIDE:(c + 1) * STRIDE]
            dv, du = np.unravel_index(block.argmin(), block.shape)
            v, u, z = r * STRIDE + dv, c * STRIDE + du, block.min()
            owner = scene.owner[v, u]
            if not np.isfinite(z) or owner < 0:
                parts[0, r, c] = SURE
                continue
            parts[CLASS_OF_LABEL[scene.part_labels[v, u]], r, c] = SURE
            person = scene.people[owner]
            uv = scene.camera.project(person.shared_points)
            middle = np.array([c, r]) * STRIDE + (STRIDE - 1) / 2
            shift = (uv - middle) * z / scene.camera.fx
            behind = person.shared_points[:, 2] - z
            votes[:, r, c] = np.column_stack([shift, behind]).ravel()
            visible[:, r, c] = np.where(person.visible, SURE, -SURE)
    log_sigma = np.full((15, rows, columns), np.log(sigma_m), dtype=np.float32)
    return parts, votes, log_sigma, visible


def shown_scene(scene, shown_m, view):
    """Return a TrainingScene as a network sees it that is shown some view of it."""
    shown, camera = view.camera, scene.camera
    focal_px = shown.fx * view.enlarged
    v, u = np.mgrid[:shown.height, :shown.width]
    u = np.rint((u - shown.cx) / focal_px * camera.fx + camera.cx).astype(int)
    v = np.rint((v - shown.cy) / focal_px * camera.fy + camera.cy).astype(int)
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height) & (shown_m > 0)
    u, v = np.where(inside, u, 0), np.where(inside, v, 0)
    people = [SimpleNamespace(shared_points=view.from_camera(person.shared_points),
                              visible=person.visible) for person in scene.people]
    return SimpleNamespace(
        camera=shown, depth_m=np.where(shown_m > 0, shown_m, np.nan), people=people,
        owner=np.where(inside, scene.owner[v, u], -1),
        part_labels=np.where(inside, scene.part_labels[v, u], -1))
