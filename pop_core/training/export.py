"""The trained network as an ONNX file that `pop_core.keypoints.depth_net` runs."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import onnx
import torch

from pop_core.errors import PopError
from pop_core.keypoints.canonical_depth import STRIDE
from pop_core.keypoints.depth_network import FORMAT, KIND
from pop_core.keypoints.onnx_session import load_network as load_onnx
from pop_core.training.network import DepthMaps, DepthNet

OPSET = 17
SAME = 1e-3
IMAGE = (160, 192)


class ExportError(PopError):
    """A written network that says something else than the one it was written from."""


def export_onnx(network: DepthNet, path: Path, about: str = '') -> None:
    """Write a network: input `depth_m` (1, 1, h, w) [m], outputs as DepthMaps, any h and w.

    Args:
        network: The network; its batch normalisation is folded into the convolutions.
        path: The .onnx file.
        about: What a reader of the file should know.

    Raises:
        ExportError: If ONNX Runtime computes something else from the file than PyTorch.
    """
    network = network.eval().cpu()
    path.parent.mkdir(parents=True, exist_ok=True)
    example = torch.zeros(1, 1, *IMAGE)
    axes = {'depth_m': {2: 'height', 3: 'width'}}
    axes |= {name: {2: 'rows', 3: 'columns'} for name in DepthMaps._fields}
    with warnings.catch_warnings():
        # torch's newer exporter would need another library and gives the same graph.
        warnings.simplefilter('ignore')
        torch.onnx.export(
            network, (example,), str(path), dynamo=False, opset_version=OPSET,
            input_names=['depth_m'], output_names=list(DepthMaps._fields), dynamic_axes=axes)
    model = onnx.load(path)
    facts = {KIND: FORMAT, 'focal_px': str(network.config.focal_px),
             'stride': str(STRIDE), 'about': about}
    if network.config.shown_at_m is not None:
        facts['shown_at_m'] = str(network.config.shown_at_m)
    for key, value in facts.items():
        model.metadata_props.add(key=key, value=value)
    onnx.save(model, str(path))
    apart = largest_difference(network, path)
    if not apart <= SAME:
        path.unlink()
        raise ExportError(
            f'{path}: expected outputs within {SAME} of PyTorch, found them {apart:.2g} apart')


def largest_difference(network: DepthNet, path: Path) -> float:
    """Return how far the outputs of a network and of its file are apart at most; NaN if one is.

    Args:
        network: The network, in evaluation mode.
        path: What `export_onnx` wrote of it.
    """
    rng = np.random.default_rng(0)
    # A person-sized step before a wall, noise, and holes.
    depth_m = 4.0 + rng.normal(0, 0.02, (1, 1, *IMAGE)).astype(np.float32)
    depth_m[..., 40:150, 60:110] -= 1.5
    depth_m[rng.random(depth_m.shape) < 0.05] = 0.0
    with torch.no_grad():
        expected = network(torch.from_numpy(depth_m))
    found = load_onnx(path).run(depth_m)
    return float(np.max([
        np.abs(there - here.numpy()).max()
        for here, there in zip(expected, found, strict=True)]))
