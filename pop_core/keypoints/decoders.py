"""Every decoder of ONNX networks, and which one a network gets."""

from __future__ import annotations

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.mmdet_boxes import RtmDetDecoder, YoloxSuppressedDecoder
from pop_core.keypoints.movenet import MoveNetDecoder
from pop_core.keypoints.network import NetworkDecoder, NetworkSpec
from pop_core.keypoints.openpose import OpenPoseDecoder
from pop_core.keypoints.personlab import PersonLabDecoder
from pop_core.keypoints.rtmo import RtmoDecoder
from pop_core.keypoints.rtmpose import SimccDecoder
from pop_core.keypoints.single_person_heatmap import SinglePersonHeatmapDecoder
from pop_core.keypoints.yolo_boxes import YoloBoxDecoder
from pop_core.keypoints.yolo_pose import YoloPoseDecoder
from pop_core.keypoints.yolox import YoloxDecoder

DECODERS: dict[str, type[NetworkDecoder]] = {
    decoder.name: decoder for decoder in (
        PersonLabDecoder, OpenPoseDecoder, SinglePersonHeatmapDecoder, RtmoDecoder,
        YoloPoseDecoder, MoveNetDecoder, SimccDecoder, YoloxDecoder, YoloBoxDecoder,
        RtmDetDecoder, YoloxSuppressedDecoder)
}


def choose_decoder(spec: NetworkSpec, name: str | None, where: str) -> NetworkDecoder:
    """Return the decoder of that name, or the only one that fits.

    Args:
        spec: Inputs and outputs of the network.
        name: What the user said; None lets names and shapes decide.
        where: Name of the file, for messages.

    Raises:
        NetworkShapeError: If there is none of that name, it does not fit, none fits, or several
            do.
    """
    if name is not None and name not in DECODERS:
        raise NetworkShapeError(
            f'{where}: expected a decoder of {", ".join(sorted(DECODERS))}, found {name!r}')
    tried = list(DECODERS.values()) if name is None else [DECODERS[name]]
    fitting = [decoder for decoder in tried if decoder.fits(spec)]
    if not fitting:
        expected = '; or '.join(f'{decoder.name}: {decoder.expects}' for decoder in tried)
        raise NetworkShapeError(f'{where}: expected {expected}; found {spec}')
    if len(fitting) > 1:
        names = ' or '.join(decoder.name for decoder in fitting)
        raise NetworkShapeError(
            f'{where}: expected to be told a decoder, {names}, whose outputs look alike; '
            f'found {spec}')
    return fitting[0](spec)


def reason(decoder: NetworkDecoder, spec: NetworkSpec, where: str) -> str:
    """Return a sentence about why a network is read as it is."""
    return f'{where}: read as {decoder.name}, for it has {spec}'
