"""Sources of people made of ONNX networks: one class for each kind of network."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.decoders import choose_decoder, reason
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.network import (
    BoxDecoder,
    OnePersonDecoder,
    PeopleDecoder,
    TopDownDecoder,
)
from pop_core.keypoints.onnx_session import OnnxSession, load_network
from pop_core.keypoints.people_selection import PeopleConfig, select_people
from pop_core.keypoints.upright import (
    box_turned_back,
    detect_upright,
    upright_box,
    upright_frame,
)
from pop_core.rgbd import RgbdFrame

MOST_BOXES = 20  # a top-down network runs once for each
MOST_PEOPLE = 100  # each is lifted to be examined; a network that sees more sees noise


class OnnxKeypointDetector:
    """People found by a network in the colour image, checked against depth."""

    def __init__(
        self, session: OnnxSession, decoder: PeopleDecoder, config: PeopleConfig | None = None
    ) -> None:
        """Take a loaded network, what decodes it, and which of its people are kept."""
        self.session = session
        self.decoder = decoder
        self.config = config or PeopleConfig()

    @property
    def reason(self) -> str:
        """Return why the network is read as it is."""
        return reason(self.decoder, self.session.spec, self.session.where)

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, best first."""
        return detect_upright(self._detect, frame)

    def _detect(self, frame: RgbdFrame) -> list[Detection]:
        people = self.decoder.detect(frame.rgb, self.session.run)[:MOST_PEOPLE]
        return select_people(frame, people, self.config)


class OnnxTopDownDetector:
    """Joints found by a network inside boxes that others found, checked against depth."""

    def __init__(
        self, session: OnnxSession, decoder: TopDownDecoder, config: PeopleConfig | None = None
    ) -> None:
        """Take a loaded network, what decodes it, and which of its people are kept."""
        self.session = session
        self.decoder = decoder
        self.config = config or PeopleConfig()

    @property
    def reason(self) -> str:
        """Return why the network is read as it is."""
        return reason(self.decoder, self.session.spec, self.session.where)

    def detect_in(self, frame: RgbdFrame, boxes: Sequence[PersonBox]) -> list[Detection]:
        """Return the people of a frame's boxes, best first; of many boxes only the best."""
        best = [upright_box(box, frame.camera) for box in boxes[:MOST_BOXES]]

        def find(upright: RgbdFrame) -> list[Detection]:
            people = self.decoder.detect_in(upright.rgb, best, self.session.run)
            return select_people(upright, people, self.config)

        return detect_upright(find, frame)


class OnnxOnePersonDetector(OnnxTopDownDetector):
    """The same of a network that also finds the one person of a whole image."""

    decoder: OnePersonDecoder

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the person of a frame, or nobody."""
        return detect_upright(self._detect, frame)

    def _detect(self, frame: RgbdFrame) -> list[Detection]:
        people = self.decoder.detect(frame.rgb, self.session.run)
        return select_people(frame, people, self.config)


class OnnxBoxDetector:
    """Boxes around people found by a network in the colour image."""

    def __init__(self, session: OnnxSession, decoder: BoxDecoder) -> None:
        """Take a loaded network and what decodes it."""
        self.session = session
        self.decoder = decoder

    @property
    def reason(self) -> str:
        """Return why the network is read as it is."""
        return reason(self.decoder, self.session.spec, self.session.where)

    def find_boxes(self, frame: RgbdFrame) -> list[PersonBox]:
        """Return a box around every person, best first."""
        boxes = self.decoder.find_boxes(upright_frame(frame).rgb, self.session.run)
        return [box_turned_back(box, frame.camera) for box in boxes]


OnnxSource = OnnxKeypointDetector | OnnxTopDownDetector | OnnxBoxDetector


def load_source(path: Path, decoder: str | None = None) -> OnnxSource:
    """Return what a network of a file is a source of.

    Args:
        path: The .onnx file.
        decoder: Name of the decoder; None takes the one that the outputs fit.

    Raises:
        NetworkShapeError: If it is no network, or fits no decoder or not the named one.
    """
    return source_of(load_network(path), decoder)


def source_of(session: OnnxSession, decoder: str | None = None) -> OnnxSource:
    """Return what a loaded network is a source of.

    Raises:
        NetworkShapeError: If the network fits no decoder or not the named one.
    """
    chosen = choose_decoder(session.spec, decoder, session.where)
    if isinstance(chosen, OnePersonDecoder):
        return OnnxOnePersonDetector(session, chosen)
    if isinstance(chosen, TopDownDecoder):
        return OnnxTopDownDetector(session, chosen)
    if isinstance(chosen, BoxDecoder):
        return OnnxBoxDetector(session, chosen)
    assert isinstance(chosen, PeopleDecoder)
    return OnnxKeypointDetector(session, chosen)
