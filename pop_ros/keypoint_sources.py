"""Which keypoint sources a user named: one, or several that are merged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pop_core.errors import PopError

if TYPE_CHECKING:
    from pop_core.config import PipelineConfig
    from pop_core.keypoints.boxes import BoxDetector, TopDownDetector
    from pop_core.keypoints.depth_net import DepthNetDetector
    from pop_core.keypoints.detection import KeypointDetector
    from pop_core.keypoints.onnx_detector import OnnxSource
    from pop_core.keypoints.people_selection import PeopleConfig

    Source = KeypointDetector | BoxDetector | TopDownDetector

SOURCES = (
    "'depth' (the embedded network), 'json' (OpenPose files), the path of an ONNX network, or a "
    'name of `pop models list`')


class SourceError(PopError):
    """A keypoint source that does not exist or lacks what it needs."""


def make_detector(
    spec: str | Path,
    keypoints_dir: str | Path | None = None,
    decoder: str | None = None,
    json_source: KeypointDetector | None = None,
) -> KeypointDetector:
    """Return the keypoint source that a user named; several, with commas between, are merged.

    A network that looks into boxes gets those of the others.

    Args:
        spec: 'json', the path of an ONNX network or a name of the registry, each perhaps behind
            `DECODER@`; commas between several.
        keypoints_dir: Folder of `<stamp_ns>.json` files; needed by 'json'.
        decoder: Decoder of the only network's outputs where they do not tell; None chooses.
        json_source: What 'json' stands for in place of a folder.

    Raises:
        SourceError: If there is no such source, or something that it needs is missing.
        NetworkShapeError: If a network fits no decoder.
    """
    words = split_sources(str(spec))
    if decoder is not None:
        words = _with_decoder(words, decoder)
    folder = None if keypoints_dir is None else Path(keypoints_dir)
    return _combined([_source(word, folder, json_source) for word in words], str(spec))


def split_sources(spec: str) -> list[str]:
    """Return the sources of a list with commas; a file whose name has a comma is one source.

    Raises:
        SourceError: If none is named, or one twice.
    """
    words = [spec] if Path(spec).is_file() else [word.strip() for word in spec.split(',')]
    if not all(words):
        raise SourceError(f'keypoints: expected {SOURCES}, found {spec!r}')
    if len(set(words)) < len(words):
        raise SourceError(f'keypoints: expected each source once, found {spec!r}')
    return words


def reasons(detector: object) -> list[str]:
    """Return a sentence about each network: how it is read, and why so."""
    return [str(part.reason) for part in _parts(detector) if hasattr(part, 'reason')]


def keep_people(detector: object, config: PeopleConfig) -> None:
    """Tell every network of a source which of the people it finds are kept."""
    from pop_core.keypoints.onnx_detector import OnnxKeypointDetector, OnnxTopDownDetector

    for part in _parts(detector):
        if isinstance(part, OnnxKeypointDetector | OnnxTopDownDetector):
            part.config = config


def apply_settings(detector: object, config: PipelineConfig) -> None:
    """Tell a source the settings of people.*, fusion.* and depth_net.*."""
    from pop_core.keypoints.fusion import FusedDetector

    keep_people(detector, config.people)
    for part in depth_networks(detector):
        part.config = config.depth_net
    if isinstance(detector, FusedDetector):
        detector.config = config.fusion


def depth_networks(detector: object) -> list[DepthNetDetector]:
    """Return the depth networks of a source."""
    from pop_core.keypoints.depth_net import DepthNetDetector

    return [part for part in _parts(detector) if isinstance(part, DepthNetDetector)]


def _parts(detector: object) -> Sequence[Any]:
    from pop_core.keypoints.fusion import FusedDetector

    if isinstance(detector, FusedDetector):
        return [*detector.people, *detector.boxes, *detector.top_down]
    return [detector]


def _combined(sources: Sequence[Source], spec: str) -> KeypointDetector:
    """Return sources as one; who finds people in images and in boxes gets boxes if there are any.

    Raises:
        SourceError: If boxes are found that nobody looks into, or the other way round.
    """
    from pop_core.keypoints.boxes import BoxDetector, TopDownDetector
    from pop_core.keypoints.detection import KeypointDetector
    from pop_core.keypoints.fusion import FusedDetector

    if len(sources) == 1 and isinstance(sources[0], KeypointDetector):
        return sources[0]
    boxes = [source for source in sources if isinstance(source, BoxDetector)]
    top_down = [source for source in sources if isinstance(source, TopDownDetector)]
    either = [source for source in top_down if isinstance(source, KeypointDetector)]
    people: list[KeypointDetector] = [
        source for source in sources
        if isinstance(source, KeypointDetector) and not isinstance(source, TopDownDetector)]
    if boxes and not top_down:
        raise SourceError(
            f'keypoints: expected a network that looks into boxes beside one that finds them, '
            f'found {spec} alone: add one such as rtmpose-m')
    if not people and not boxes:
        people = [*either] or [_boxes_for(spec)]
        top_down = [source for source in top_down if source not in either]
    return FusedDetector(people, boxes, top_down)


def _with_decoder(words: Sequence[str], decoder: str) -> list[str]:
    networks = [word for word in words if word not in ('json', 'depth')]
    if len(networks) != 1:
        raise SourceError(
            f'keypoints: expected one network beside --decoder, found {", ".join(words)}: '
            'write DECODER@NETWORK')
    return [f'{decoder}@{word}' if word in networks else word for word in words]


def _source(
    word: str, keypoints_dir: Path | None, json_source: KeypointDetector | None
) -> Source:
    if word == 'json':
        return json_source or _json_detector(keypoints_dir)
    if word == 'depth':
        return _depth_detector()
    return _network(word)


def _depth_detector() -> KeypointDetector:
    from pop_core.keypoints.depth_net import load_depth_net
    from pop_core.keypoints.depth_network import EMBEDDED

    if not EMBEDDED.is_file():
        raise SourceError(
            f'keypoints: expected {SOURCES}, found depth: this version has no embedded network; '
            'docs/training.md tells how to train one')
    return load_depth_net()


def _boxes_for(spec: str) -> KeypointDetector:
    try:
        return _depth_detector()
    except SourceError:
        raise SourceError(
            f'keypoints: expected something that finds people beside {spec}, which looks into '
            "their boxes; found none: add a source with a comma, as in 'rtmo-m,rtmpose-m'"
        ) from None


def _json_detector(folder: Path | None) -> KeypointDetector:
    from pop_core.keypoints.openpose_json import OpenPoseJsonDetector

    if folder is None or not folder.is_dir():
        found = 'none' if folder is None else f'{folder}, which is no folder'
        raise SourceError(
            f'keypoints: expected a folder of <stamp_ns>.json files (--keypoints-dir), '
            f'found {found}')
    return OpenPoseJsonDetector(folder)


def _network(word: str) -> OnnxSource | DepthNetDetector:
    from pop_core.keypoints.decoders import DECODERS
    from pop_core.keypoints.depth_net import depth_net_of
    from pop_core.keypoints.depth_network import is_depth_net
    from pop_core.keypoints.onnx_detector import source_of
    from pop_core.keypoints.onnx_session import OnnxSession, load_network
    from pop_ros.network_registry import find_entry, verified_network

    before, _, after = word.rpartition('@')
    decoder, name = (before, after) if before in DECODERS else (None, word)
    entry = find_entry(name)
    if entry is not None:
        return source_of(OnnxSession(verified_network(entry), name), decoder or entry.decoder)
    path = Path(name)
    if path.suffix != '.onnx' or not path.is_file():
        why = 'does not end in .onnx' if path.is_file() else 'is not there'
        raise SourceError(f'keypoints: expected {SOURCES}, found {path}, which {why}')
    session = load_network(path)
    if decoder is None and is_depth_net(session):
        return depth_net_of(session, path)
    return source_of(session, decoder)
