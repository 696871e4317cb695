"""The trained network as an ONNX file that `pop_core.keypoints.depth_net` runs."""

from __future__ import annotations

import warnings
from pathlib import Path

import onnx
import torch

from pop_core.keypoints.canonical_depth import STRIDE
from pop_core.keypoints.depth_network import FORMAT, KIND
from pop_core.training.network import DepthMaps, DepthNet

OPSET = 17


def export_onnx(network: DepthNet, path: Path, about: str = '') -> None:
    """Write a network: input `depth_m` (1, 1, h, w) [m], outputs as DepthMaps, any h and w.

    Args:
        network: The network; its batch normalisation is folded into the convolutions.
        path: The .onnx file.
        about: What a reader of the file should know.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    example = torch.zeros(1, 1, 160, 192)
    axes = {'depth_m': {2: 'height', 3: 'width'}}
    axes |= {name: {2: 'rows', 3: 'columns'} for name in DepthMaps._fields}
    with warnings.catch_warnings():
        # torch's newer exporter would need another library and gives the same graph.
        warnings.simplefilter('ignore')
        torch.onnx.export(
            network.eval().cpu(), (example,), str(path), dynamo=False, opset_version=OPSET,
            input_names=['depth_m'], output_names=list(DepthMaps._fields), dynamic_axes=axes)
    model = onnx.load(path)
    facts = {KIND: FORMAT, 'focal_px': str(network.config.focal_px),
             'stride': str(STRIDE), 'about': about}
    if network.config.shown_at_m is not None:
        facts['shown_at_m'] = str(network.config.shown_at_m)
    for key, value in facts.items():
        model.metadata_props.add(key=key, value=value)
    onnx.save(model, str(path))
