"""Images of a bright spot, and what a network needs to say where it sees it."""

import numpy as np

from pop_core.keypoints.network import NetworkSpec, TensorSpec


def planes_spec(*outputs, size=(640, 640), kind='float32'):
    return NetworkSpec(
        (TensorSpec('images', (1, 3, *size), kind),),
        tuple(TensorSpec(f'out{i}', shape, kind) for i, shape in enumerate(outputs)))


def spot_in(tensor):
    """The place (u, v) of the spot in the input, seen in green alone."""
    green = np.asarray(tensor, float)
    green = green[0, 1] if green.shape[1] == 3 else green[0, ..., 1]
    weight = green - np.median(green)
    weight[weight < 0.5 * weight.max()] = 0.0
    v, u = np.mgrid[:green.shape[0], :green.shape[1]]
    return np.array([(weight * u).sum(), (weight * v).sum()]) / weight.sum()


def box_around(uv, half=20.0):
    return np.concatenate([uv - half, uv + half])


def row(*parts):
    return np.concatenate([np.ravel(part) for part in parts])


def spotted(h, w, place):
    v, u = np.mgrid[:h, :w]
    radius = max(2.0, 0.02 * max(h, w))
    bright = 250 * np.exp(-((u - place[0]) ** 2 + (v - place[1]) ** 2) / (2 * radius**2))
    return np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)


def as_float(outputs):
    return [np.asarray(output, np.float32) for output in outputs]
