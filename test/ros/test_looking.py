"""The keypoint source in a process of its own: it sees and says what it would in the node's."""

import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest
from support.recording import Recording, record

from pop_core.config import PipelineConfig
from pop_core.keypoints.canonical_depth_kernels import read_depth
from pop_core.keypoints.depth_mask_kernels import label_pixels
from pop_core.keypoints.lifting import LiftingConfig
from pop_core.keypoints.openpose_json import KeypointFileError
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.looks import look_for_people
from pop_ros.finding_process import FindingProcess
from pop_ros.looking import DistantDetector, Looking
from pop_ros.node_arguments import SourceArguments

WAIT_S = 120.0


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('looking'), n_frames=1, rate_hz=15.0)


@pytest.fixture(scope='module')
def sources(recording: Recording) -> SourceArguments:
    return SourceArguments('json', recording.keypoints)


@pytest.fixture(scope='module')
def looking(sources: SourceArguments) -> Iterator[FindingProcess]:
    made = FindingProcess(Looking(sources))
    yield made
    made.stop()


@pytest.fixture
def frame(recording: Recording) -> RgbdFrame:
    return replace(recording.scenes[0].frame, stamp_ns=recording.stamps[0])


@pytest.mark.parametrize('config', [
    PipelineConfig(), PipelineConfig(use_ground=False, lifting=LiftingConfig(min_score=0.9))])
def test_it_sees_what_the_node_itself_would_with_the_settings_of_the_moment(
    looking: FindingProcess, sources: SourceArguments, frame: RgbdFrame, config: PipelineConfig
) -> None:
    looking.configure(config)
    there = looking.submit(look_for_people, frame, frame).result(WAIT_S)
    here = look_for_people(Looking(sources)(config), frame, frame)
    assert len(there.found.detections) == 1
    for ours, theirs in zip(here.found.lifted, there.found.lifted, strict=True):
        np.testing.assert_array_equal(theirs.positions_camera, ours.positions_camera)
        np.testing.assert_array_equal(theirs.state, ours.state)
    assert there.noise == here.noise
    assert (there.ground is None) == (not config.use_ground)


def test_what_it_cannot_read_is_said_as_if_the_node_had_read_it(
    looking: FindingProcess, frame: RgbdFrame, recording: Recording
) -> None:
    detector = DistantDetector(looking)
    assert len(detector.detect(frame)) == 1
    with pytest.raises(KeypointFileError, match=r'5\.json: expected keypoints .*found no'):
        detector.detect(replace(frame, stamp_ns=5))
    (recording.keypoints / '6.json').write_text('{"people": 6}')
    with pytest.raises(KeypointFileError, match=r'6\.json'):
        detector.detect(replace(frame, stamp_ns=6))


def nap(_eyes: object, seconds: float) -> None:
    time.sleep(seconds)


def test_how_long_an_answer_is_waited_for_is_told(looking: FindingProcess) -> None:
    looking.submit(nap, 0.0).result(WAIT_S)
    assert looking.busy_s == 0.0
    answers = [looking.submit(nap, 0.3) for _ in range(2)]
    time.sleep(0.1)
    before_s = looking.busy_s
    answers[0].result(WAIT_S)
    # The time of one answer does not count for the next.
    assert 0.0 < before_s
    assert looking.busy_s < 0.3
    answers[1].result(WAIT_S)


def test_loading_is_no_waiting(sources: SourceArguments) -> None:
    made = FindingProcess(Looking(sources))
    began_s, longest_s = time.monotonic(), 0.0
    try:
        first = made.start()
        while not first.done():
            longest_s = max(longest_s, made.busy_s)
            time.sleep(0.01)
        first.result()
    finally:
        made.stop()
    assert longest_s < 0.1 < time.monotonic() - began_s


def test_kernels_of_the_embedded_network_are_there_before_the_first_frame() -> None:
    with ProcessPoolExecutor(1, get_context('spawn')) as fresh:
        assert fresh.submit(kernels_after_preparing).result(WAIT_S) == [True, True]


def kernels_after_preparing() -> list[bool]:
    """Return whether kernels of a look are loaded, those included that only people need."""
    Looking(SourceArguments('depth'))(PipelineConfig())
    return [bool(kernel.signatures) for kernel in (read_depth, label_pixels)]
