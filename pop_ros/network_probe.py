"""Try out a network in a process of its own, which may take bounded memory and time.

A hostile file can make the process fail, not the one that asked.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from pop_core.errors import PopError
from pop_ros.network_registry import NetworkFileError

MEMORY = 8 * 2**30  # bytes of address space; half of it are libraries
TIMEOUT_S = 120.0
SIZE = (480, 640)
RUNS = 3


@dataclass(frozen=True, slots=True)
class Probe:
    """What was found out about a network.

    Args:
        reason: How its outputs are read, and why so.
        time_ms: Median time of a 640 x 480 image, preparation and decoding included.
    """

    reason: str
    time_ms: float


def probe_network(path: Path, decoder: str | None = None) -> Probe:
    """Load a network and run it on a grey image, elsewhere.

    Args:
        path: The .onnx file.
        decoder: Name of the decoder; None takes the one that the outputs fit.

    Raises:
        NetworkFileError: If it is no network that can be used, or takes too much of anything.
    """
    command = [sys.executable, '-m', 'pop_ros.network_probe', str(path), decoder or '']
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        raise NetworkFileError(
            f'{path}: expected outputs within {TIMEOUT_S:.0f} s, found none') from None
    try:
        answer = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        raise NetworkFileError(
            f'{path}: expected outputs, found that the process ended ({done.returncode})'
        ) from None
    if 'error' in answer:
        raise NetworkFileError(answer['error'])
    return Probe(answer['reason'], answer['time_ms'])


def main() -> None:
    """Load and run the network of the command line; print what happened as JSON."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    path, decoder = Path(sys.argv[1]), sys.argv[2] or None
    try:
        answer: dict[str, str | float] = _try(path, decoder)
    except PopError as error:
        answer = {'error': str(error)}
    except MemoryError:
        answer = {'error': f'{path}: expected outputs, found that they need too much memory'}
    sys.stdout.write(json.dumps(answer) + '\n')


def _try(path: Path, decoder: str | None) -> dict[str, str | float]:
    import numpy as np

    from pop_core.keypoints.boxes import PersonBox
    from pop_core.keypoints.network import BoxDecoder, PeopleDecoder, TopDownDecoder
    from pop_core.keypoints.onnx_detector import load_source

    source = load_source(path, decoder)
    rgb = np.full((*SIZE, 3), 127, np.uint8)
    times_ms = []
    for _ in range(RUNS):
        start = time.perf_counter()
        if isinstance(source.decoder, TopDownDecoder):
            box = PersonBox(np.array([200.0, 40.0, 440.0, 440.0]), 1.0)
            source.decoder.detect_in(rgb, [box], source.session.run)
        elif isinstance(source.decoder, BoxDecoder):
            source.decoder.find_boxes(rgb, source.session.run)
        else:
            assert isinstance(source.decoder, PeopleDecoder)
            source.decoder.detect(rgb, source.session.run)
        times_ms.append(1e3 * (time.perf_counter() - start))
    return {'reason': source.reason, 'time_ms': float(np.median(times_ms))}


if __name__ == '__main__':
    main()
