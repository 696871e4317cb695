"""Keypoints from an ONNX network run by ONNX Runtime on the CPU."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnxruntime

from pop_core.errors import NetworkShapeError
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.network import NetworkDecoder, NetworkSpec, Tensor, TensorSpec
from pop_core.keypoints.people_selection import PeopleConfig, select_people
from pop_core.keypoints.personlab import PersonLabDecoder
from pop_core.keypoints.single_person_heatmap import SinglePersonHeatmapDecoder
from pop_core.rgbd import RgbdFrame

DECODERS: tuple[type[NetworkDecoder], ...] = (
    PersonLabDecoder, SinglePersonHeatmapDecoder)
THREADS = 2
DTYPES = {'tensor(uint8)': 'uint8', 'tensor(float)': 'float32', 'tensor(float16)': 'float16'}


class OnnxKeypointDetector:
    """People found by a network in the colour image, checked against depth."""

    def __init__(
        self, path: Path, decoder: str | None = None, config: PeopleConfig | None = None
    ) -> None:
        """Load a network and choose what decodes it.

        Args:
            path: The .onnx file.
            decoder: Name of the decoder; None takes the one that the outputs fit.
            config: Which of the network's people are kept.

        Raises:
            NetworkShapeError: If it is no network, or fits no decoder or not the named one.
        """
        self.path = path
        self.config = config or PeopleConfig()
        self._session = _load(path)
        self.spec = _spec(self._session)
        self.decoder = choose_decoder(self.spec, decoder, str(path))

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, best first."""
        people = self.decoder.detect(frame.rgb, self._run)
        return select_people(frame, people, self.config)

    def _run(self, tensor: Tensor) -> Sequence[Tensor]:
        outputs = self._session.run(None, {self.spec.inputs[0].name: tensor})
        return [np.asarray(output) for output in outputs]


def choose_decoder(spec: NetworkSpec, name: str | None, where: str) -> NetworkDecoder:
    """Return the decoder of that name, or the first that fits.

    Raises:
        NetworkShapeError: If there is none of that name, or it does not fit.
    """
    known = {decoder.name: decoder for decoder in DECODERS}
    if name is not None and name not in known:
        raise NetworkShapeError(f'{where}: expected a decoder of {sorted(known)}, found {name!r}')
    tried = list(known.values()) if name is None else [known[name]]
    for decoder in tried:
        if decoder.fits(spec):
            return decoder(spec)
    expected = '; or '.join(f'{decoder.name}: {decoder.expects}' for decoder in tried)
    raise NetworkShapeError(f'{where}: expected {expected}; found {spec}')


def _load(path: Path) -> onnxruntime.InferenceSession:
    onnxruntime.disable_telemetry_events()  # a robot's perception tells nobody what it runs
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = THREADS
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # Spinning threads would take the cores from the fit between two images.
    options.add_session_config_entry('session.intra_op.allow_spinning', '0')
    try:
        return onnxruntime.InferenceSession(
            path.read_bytes(), options, providers=['CPUExecutionProvider'])
    except OSError as error:
        reason = error.strerror
        raise NetworkShapeError(f'{path}: expected an ONNX file, found: {reason}') from None
    except Exception as error:  # noqa: BLE001 - ONNX Runtime's errors share no public base
        reason = ' '.join(str(error).split())[:160]
        raise NetworkShapeError(f'{path}: expected an ONNX network, found: {reason}') from None


def _spec(session: onnxruntime.InferenceSession) -> NetworkSpec:
    sides = ([_tensor(item) for item in side]
             for side in (session.get_inputs(), session.get_outputs()))
    inputs, outputs = (tuple(side) for side in sides)
    return NetworkSpec(inputs, outputs)


def _tensor(item: onnxruntime.NodeArg) -> TensorSpec:
    shape = tuple(size if isinstance(size, int) else None for size in item.shape)
    return TensorSpec(item.name, shape, DTYPES.get(item.type, item.type))
