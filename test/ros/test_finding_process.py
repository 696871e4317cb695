"""The process that fits people for a node: the same people, errors by name, a shared end."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.faults import fail_in_two_parts, take_for_ever
from support.lost_limb import lost_limbs, raised
from support.node import ROOT
from support.one_person import facing_person
from support.smpl_body import SPLIT, imported_body
from support.stage import Stage

from pop_core.body.default_body import default_body
from pop_core.config import PipelineConfig
from pop_core.depth_noise import USUAL_NOISE
from pop_core.estimate import EstimateStatus
from pop_core.keypoints.detection import Detection
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_file import save_library
from pop_core.tracking.finder import find_person
from pop_core.tracking.late_limbs import LimbQuestion, find_limbs
from pop_core.tracking.tracking_config import TrackingConfig
from pop_ros import finding_process
from pop_ros.finding_process import FITTING_NICENESS, FindingError, FindingProcess
from pop_ros.fitting import Fitting
from pop_ros.model_files import ModelFiles

WAIT_S = 120.0
FEW_POSES = 20_000


@pytest.fixture(scope='module')
def stage() -> Stage:
    return Stage(default_body())


@pytest.fixture(scope='module')
def seen(stage: Stage) -> tuple[Scene, Detection]:
    person = facing_person(np.zeros(10))
    frame = stage.frame(person, hidden=False)
    scene = Scene(frame, None, USUAL_NOISE, np.zeros(frame.depth_m.shape, dtype=bool))
    return scene, stage.source.detection(frame, person)


@pytest.fixture
def finding() -> Iterator[FindingProcess]:
    made = FindingProcess()
    yield made
    made.stop()


def child_of(finding: FindingProcess) -> int:
    process = finding._process
    assert process is not None
    return process.pid


def is_running(pid: int) -> bool:
    try:
        return Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0] != 'Z'
    except OSError:
        return False


def test_it_finds_whom_the_node_itself_would_find_with_the_settings_of_the_moment(
    finding: FindingProcess, stage: Stage, seen: tuple[Scene, Detection]
) -> None:
    finding.start()
    there = finding.submit(find_person, *seen).result(WAIT_S)
    here = find_person(stage.tracker.pipeline, *seen)
    np.testing.assert_array_equal(there.estimate.vertices, here.estimate.vertices)
    np.testing.assert_array_equal(there.body.hessian, here.body.hessian)
    finding.configure(PipelineConfig(max_range_m=1.0))
    assert finding.submit(find_person, *seen).result(WAIT_S).status is EstimateStatus.TOO_FAR


def test_it_fits_the_body_and_the_poses_that_the_node_fits(
    seen: tuple[Scene, Detection], tmp_path: Path
) -> None:
    save_library(default_library().subset(np.arange(FEW_POSES)), tmp_path / 'few.poplib')
    fitting = Fitting(ModelFiles(imported_body(tmp_path), tmp_path / 'few.poplib'))
    finding = FindingProcess(fitting)
    try:
        assert finding.submit(pose_count).result(WAIT_S) == FEW_POSES
        there = finding.submit(find_person, *seen).result(WAIT_S)
    finally:
        finding.stop()
    here = find_person(fitting(PipelineConfig()), *seen)
    np.testing.assert_array_equal(there.estimate.vertices, here.estimate.vertices)
    assert len(there.estimate.vertices) == len(default_body().v_template) + SPLIT


def pose_count(pipeline: BodyPipeline) -> int:
    return len(pipeline.library)


def test_limbs_looked_for_there_are_those_found_here(
    finding: FindingProcess, stage: Stage
) -> None:
    person, pipeline = facing_person(np.zeros(10)), stage.tracker.pipeline
    lost = lost_limbs(pipeline, stage.body, raised(person, -0.9), person)
    question = LimbQuestion.of(lost, TrackingConfig())
    there = finding.submit(find_limbs, question).result(WAIT_S)
    here = find_limbs(pipeline, question)
    np.testing.assert_array_equal(there.body_pose, here.body_pose)
    assert [is_found for _, is_found in there.tried] == [True]


def test_an_error_there_is_an_error_here_and_a_dead_process_is_replaced(
    finding: FindingProcess, seen: tuple[Scene, Detection]
) -> None:
    with pytest.raises(AttributeError):
        finding.submit(find_person, 'no scene', seen[1]).result(WAIT_S)
    waiting = finding.submit(find_person, *seen)
    os.kill(child_of(finding), signal.SIGKILL)
    with pytest.raises(FindingError, match='ended with code -9'):
        waiting.result(WAIT_S)
    assert finding.submit(find_person, *seen).result(WAIT_S).status is EstimateStatus.OK


def test_a_process_that_hangs_is_ended_and_replaced(
    finding: FindingProcess, seen: tuple[Scene, Detection], monkeypatch: pytest.MonkeyPatch
) -> None:
    finding.submit(find_person, *seen).result(WAIT_S)
    hung = child_of(finding)
    monkeypatch.setattr(finding_process, 'PATIENCE_S', 0.5)
    os.kill(hung, signal.SIGSTOP)
    with pytest.raises(FindingError, match='ended with code -9 after 0'):
        finding.submit(find_person, *seen).result(WAIT_S)
    assert not is_running(hung)
    # A busy machine may need longer for the fit of its successor.
    monkeypatch.setattr(finding_process, 'PATIENCE_S', WAIT_S)
    assert finding.submit(find_person, *seen).result(WAIT_S).status is EstimateStatus.OK


def test_a_process_that_hangs_again_is_ended_as_soon_as_the_first_time(
    finding: FindingProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    finding.start().result(WAIT_S)
    monkeypatch.setattr(finding_process, 'PATIENCE_S', 0.5)
    for _ in range(2):
        hung = finding.submit(take_for_ever)
        with pytest.raises(FindingError, match='ended with code -9 after 0'):
            hung.result(WAIT_S)


def test_what_waits_for_a_process_that_is_stopped_fails_by_name(finding: FindingProcess) -> None:
    finding.start().result(WAIT_S)
    asked = [finding.submit(take_for_ever) for _ in range(3)]
    while finding.busy_s == 0.0:
        time.sleep(0.01)
    finding.stop()
    for future in (*asked, finding.submit(take_for_ever)):
        with pytest.raises(FindingError, match=r'was stopped|ended with code -9'):
            future.result(WAIT_S)


def test_an_error_that_cannot_be_sent_arrives_by_its_name_and_words(
    finding: FindingProcess
) -> None:
    finding.start().result(WAIT_S)
    pid = child_of(finding)
    with pytest.raises(FindingError, match='TwoPartsError: of this and that'):
        finding.submit(fail_in_two_parts).result(WAIT_S)
    assert child_of(finding) == pid


def test_nothing_is_left_of_a_node_that_was_killed_while_its_process_works(
    tmp_path: Path
) -> None:
    code = (f'import sys; sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / "test")!r}]; '
            'from support.faults import take_for_ever; '
            'from pop_ros.finding_process import FindingProcess; f = FindingProcess(); '
            'f.start().result(); f.submit(take_for_ever); '
            'print(f._process.pid, flush=True); import time; time.sleep(60)')
    node = subprocess.Popen(
        [sys.executable, '-c', code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        text=True, cwd=tmp_path)
    assert node.stdout is not None
    pid = int(node.stdout.readline())
    node.kill()
    node.wait(30)
    end_s = time.monotonic() + 30
    while is_running(pid) and time.monotonic() < end_s:
        time.sleep(0.1)
    assert not is_running(pid)


def test_half_an_answer_is_not_taken_for_a_part_of_the_next(
    finding: FindingProcess, seen: tuple[Scene, Detection], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finding_process, 'PROGRAM', (
        'import pickle, sys; d = pickle.dumps([0] * 9); sys.stdout.buffer.write(d[:-5]); '
        'sys.stdout.flush(); sys.stdin.buffer.read(1)'))
    with pytest.raises(FindingError):
        finding.submit(find_person, *seen).result(WAIT_S)
    monkeypatch.undo()
    assert finding.submit(find_person, *seen).result(WAIT_S).status is EstimateStatus.OK


def test_where_no_process_can_be_started_it_is_said(
    finding: FindingProcess, seen: tuple[Scene, Detection], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, 'executable', '/nowhere/python')
    finding.start()
    with pytest.raises(FindingError, match=r'found none: .*nowhere'):
        finding.submit(find_person, *seen).result(WAIT_S)


def test_stopping_while_a_dead_process_is_replaced_leaves_none(
    finding: FindingProcess, seen: tuple[Scene, Detection], monkeypatch: pytest.MonkeyPatch
) -> None:
    replacing, started = threading.Event(), finding_process._started

    def slowly_started(niceness: int) -> subprocess.Popen[bytes]:
        replacing.set()
        time.sleep(0.3)
        return started(niceness)

    monkeypatch.setattr(finding_process, '_started', slowly_started)
    waiting = finding.submit(find_person, *seen)
    assert replacing.wait(WAIT_S)
    finding.stop()
    with pytest.raises(FindingError):
        waiting.result(WAIT_S)
    assert not is_running(child_of(finding))


def test_modules_of_the_working_directory_are_not_taken_for_those_of_the_node(
    finding: FindingProcess, seen: tuple[Scene, Detection], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / 'pickle.py').write_text('raise SystemExit(3)')
    monkeypatch.chdir(tmp_path)
    assert finding.submit(find_person, *seen).result(WAIT_S).status is EstimateStatus.OK


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGINT])
def test_nothing_is_left_of_a_node_that_was_killed(number: signal.Signals) -> None:
    code = (f'import sys; sys.path.insert(0, {str(ROOT)!r}); '
            'from pop_ros.finding_process import FindingProcess; f = FindingProcess(); f.start(); '
            'import time; time.sleep(1); print(f._process.pid, flush=True); time.sleep(60)')
    node = subprocess.Popen(
        [sys.executable, '-c', code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    assert node.stdout is not None
    pid = int(node.stdout.readline())
    assert is_running(pid)
    node.send_signal(number)
    end_s = time.monotonic() + 30
    while is_running(pid) and time.monotonic() < end_s:
        time.sleep(0.1)
    assert not is_running(pid)
    node.wait(30)


def test_it_gives_way_to_the_node_though_it_has_a_session_of_its_own(
    finding: FindingProcess
) -> None:
    finding.start()
    finding.submit(time.sleep).exception(WAIT_S)  # whatever comes of it, the process is there
    pid = child_of(finding)
    wanted = min(FITTING_NICENESS + os.nice(0), 19)
    assert os.getsid(pid) != os.getsid(0)
    assert os.getpriority(os.PRIO_PROCESS, pid) == wanted
    autogroup = Path(f'/proc/{pid}/autogroup')
    if not autogroup.exists():
        pytest.skip('this Linux has no autogroups')
    assert autogroup.read_text().split()[-1] == str(wanted)
