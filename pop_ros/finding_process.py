"""A process that fits people from retrieved poses while the node follows the others.

A second thread would share the interpreter with the one that follows, and make it half as fast.
Jobs and answers are pickles on the two pipes of a child: it ends when the pipes do, so nothing is
left of a node that was killed.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from functools import lru_cache
from typing import Any, BinaryIO

from threadpoolctl import ThreadpoolController

from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_core.keypoints.detection import Detection
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.finder import FoundPerson, find_person
from pop_ros.sources import make_pipeline

NICENESS = 5  # where processors are scarce those who are followed go first


class FindingError(PopError):
    """The process that fits people ended."""


class FindingProcess:
    """A process with a pipeline of its own; one that ended is replaced for the next person."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self._config = PipelineConfig()
        self._process: subprocess.Popen[bytes] | None = None
        # A thread waits for the answers, and asks in order.
        self._waiting = ThreadPoolExecutor(1, 'pop finding people')

    def configure(self, config: PipelineConfig) -> None:
        """Use these settings from the next person on."""
        self._config = config

    def start(self) -> None:
        """Load body and library there; the first person would wait for them."""
        self._waiting.submit(self._answer, (self._config, None, None))

    def submit(self, scene: Scene, detection: Detection) -> Future[FoundPerson]:
        """Begin to fit a person; the future fails with `FindingError` if the process ends."""
        return self._waiting.submit(self._answer, (self._config, scene, detection))

    def stop(self) -> None:
        """End the process, whatever it does."""
        self._waiting.shutdown(wait=False, cancel_futures=True)
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _answer(self, job: Any) -> Any:
        if self._process is None or self._process.poll() is not None:
            self._process = _started()
        child = self._process
        assert child.stdin is not None
        assert child.stdout is not None
        try:
            pickle.dump(job, child.stdin, protocol=pickle.HIGHEST_PROTOCOL)
            child.stdin.flush()
            answer = pickle.load(child.stdout)
        except (EOFError, OSError) as error:
            raise FindingError(
                f'the process that fits people ended with code {child.wait()}; the next person '
                'starts another') from error
        if isinstance(answer, Exception):
            raise answer
        return answer


def _started() -> subprocess.Popen[bytes]:
    paths = os.pathsep.join(path for path in sys.path if path)
    # In a session of its own: Ctrl-C in a terminal is for the node to answer.
    return subprocess.Popen(
        [sys.executable, '-m', 'pop_ros.finding_process'], stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, env={**os.environ, 'PYTHONPATH': paths}, start_new_session=True)


class Nobody:
    """A keypoint source for a pipeline that is given its detections."""

    def detect(self, _frame: RgbdFrame) -> list[Detection]:
        """Return no people."""
        return []


@lru_cache(maxsize=1)
def _loaded() -> BodyPipeline:
    ThreadpoolController().limit(limits=1, user_api='blas')
    return make_pipeline(Nobody())


@lru_cache(maxsize=1)
def _pipeline(config: PipelineConfig) -> BodyPipeline:
    loaded = _loaded()
    return BodyPipeline(loaded.model, loaded.library, Nobody(), config, loaded.fitter.prior)


def _found(
    config: PipelineConfig, scene: Scene | None, detection: Detection | None
) -> FoundPerson | None:
    pipeline = _pipeline(config)
    if scene is None or detection is None:
        return None
    return find_person(pipeline, scene, detection)


def answer_jobs(jobs: BinaryIO, answers: BinaryIO) -> None:
    """Answer jobs with who was found, or with the error met, until there are no more."""
    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        answer: FoundPerson | Exception | None
        try:
            answer = _found(*job)
        except Exception as error:  # noqa: BLE001 - the node counts it and says it
            answer = error
        pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()


def main() -> None:
    """Answer on what was the standard output; whatever is printed goes elsewhere."""
    os.nice(NICENESS)
    with os.fdopen(os.dup(1), 'wb') as answers:
        os.dup2(2, 1)
        answer_jobs(sys.stdin.buffer, answers)


if __name__ == '__main__':
    main()
