"""The trained completion network as an ONNX file that `pop_core.completion` runs."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import onnx
import torch

from pop_core.completion.joint_completion import FORMAT, KIND
from pop_core.completion.person_view import FEATURES, HALF_M, VIEW_PX
from pop_core.keypoints.onnx_session import load_network
from pop_core.training.completion.network import Completion, CompletionNet
from pop_core.training.export import OPSET, SAME, ExportError

INPUTS = ('relief_m', 'measured', 'keypoints')


def export_onnx(network: CompletionNet, path: Path, about: str = '') -> None:
    """Write a network.

    Args:
        network: The network; its batch normalisation is folded into the convolutions.
        path: The .onnx file.
        about: What a reader of the file should know.

    Raises:
        ExportError: If ONNX Runtime computes something else from the file than PyTorch.
    """
    network = network.eval().cpu()
    path.parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        # torch's newer exporter would need another library and gives the same graph.
        warnings.simplefilter('ignore')
        torch.onnx.export(
            network, _example(), str(path), dynamo=False, opset_version=OPSET,
            input_names=list(INPUTS), output_names=list(Completion._fields))
    model = onnx.load(path)
    for key, value in {KIND: FORMAT, 'about': about}.items():
        model.metadata_props.add(key=key, value=value)
    onnx.save(model, str(path))
    apart = largest_difference(network, path)
    if not apart <= SAME:
        path.unlink()
        raise ExportError(
            f'{path}: expected outputs within {SAME} of PyTorch, found them {apart:.2g} apart')


def largest_difference(network: CompletionNet, path: Path) -> float:
    """Return how far the outputs of a network and of its file are apart at most; NaN if one is."""
    example = _example()
    with torch.no_grad():
        expected = network(*example)
    found = load_network(path).run(*(tensor.numpy() for tensor in example))
    return float(np.max([
        np.abs(there - here.numpy()).max()
        for here, there in zip(expected, found, strict=True)]))


def _example() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return an input of somebody before a wall, with holes."""
    generator = torch.Generator().manual_seed(0)
    relief_m = 0.02 * torch.randn(1, VIEW_PX, VIEW_PX, generator=generator) + 1.0
    relief_m[:, 10:70, 30:50] -= 1.0
    measured = (torch.rand(relief_m.shape, generator=generator) > 0.05).float()
    keypoints = torch.rand(1, 15, FEATURES, generator=generator)
    keypoints[..., :2] = (2.0 * keypoints[..., :2] - 1.0) * HALF_M
    return relief_m * measured, measured, keypoints
