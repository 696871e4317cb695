"""The outputs that a perfect PersonLab network would give for known people."""

import numpy as np

from pop_core.keypoints.personlab import EDGES, PersonLabMaps

STRIDE, H, W = 16.0, 31, 41
# A standing person, COCO order, (y, x) relative to the middle, in units of 1/200 of the height.
STANDING = np.array([
    (-90, 0), (-94, 4), (-94, -4), (-92, 8), (-92, -8), (-65, 18), (-65, -18), (-35, 24),
    (-35, -24), (-8, 26), (-8, -26), (0, 11), (0, -11), (45, 13), (45, -13), (88, 14), (88, -14),
])


def standing(x, y, height_px):
    return STANDING * height_px / 200.0 + [y, x]


def perfect_maps(people):
    """Each cell belongs to the person whose keypoint is nearest; offsets are exact there."""
    rows, columns = np.mgrid[:H, :W]
    cells = np.stack([rows, columns], axis=-1) * STRIDE
    people = np.array(people)
    scores = np.zeros((H, W, 17), np.float32)
    short = np.zeros((H, W, 2, 17), np.float32)
    mid = np.zeros((H, W, 2, 2, 16), np.float32)
    owner = np.zeros((H, W, 17), int)
    for j in range(17):
        gap = people[:, j][None, None] - cells[:, :, None]
        distance = np.linalg.norm(gap, axis=-1)
        owner[..., j] = distance.argmin(axis=-1)
        nearest = np.take_along_axis(gap, owner[..., j][..., None, None], axis=2)[:, :, 0]
        short[..., j] = nearest
        scores[..., j] = np.exp(-0.5 * (distance.min(axis=-1) / 20.0) ** 2)
    for e, (a, b) in enumerate(EDGES):
        for way, (source, target) in enumerate(((a, b), (b, a))):
            mid[:, :, way, :, e] = people[owner[..., source], target] - cells
    return PersonLabMaps(scores, short, mid, STRIDE)
