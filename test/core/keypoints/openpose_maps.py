"""Heatmaps and part affinity fields that a perfect OpenPose network would give."""

import numpy as np


def perfect_maps(people, layout, shape, sigma=1.0):
    """Heatmaps and fields, in cells, that a network of the layout is trained to draw."""
    v, u = np.mgrid[:shape[0], :shape[1]].astype(float)
    heat = np.zeros((layout.heat, *shape), np.float32)
    fields = np.zeros((layout.fields, *shape), np.float32)
    for person in people:
        for row, name in enumerate(layout.keypoints.names):
            if name in person:
                squared = (u - person[name][0]) ** 2 + (v - person[name][1]) ** 2
                heat[row] = np.maximum(heat[row], 0.9 * np.exp(-squared / (2 * sigma**2)))
        for limb in layout.limbs:
            names = [layout.keypoints.names[j] for j in (limb.first, limb.second)]
            if all(name in person for name in names):
                draw_limb(fields[limb.field: limb.field + 2], *(person[n] for n in names))
    return heat, fields


def draw_limb(field, a, b):
    v, u = np.mgrid[:field.shape[1], :field.shape[2]].astype(float)
    way = b - a
    length = np.linalg.norm(way)
    unit = way / length
    along = (u - a[0]) * unit[0] + (v - a[1]) * unit[1]
    across = np.abs((u - a[0]) * unit[1] - (v - a[1]) * unit[0])
    near = (along > -1.0) & (along < length + 1.0) & (across < 1.2)
    field[:, near] = unit[:, None]
