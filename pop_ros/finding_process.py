"""A process that finds people, or their lost limbs, while the node follows them.

A second thread would share the interpreter with the one that follows, and make it half as fast.
What the work is done with is made there: a pipeline for fits, a keypoint source for looks. Jobs
and answers are pickles on the two pipes of a child: it ends when the pipes do, so nothing is left
of a node that was killed.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

from threadpoolctl import ThreadpoolController

from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_ros.fitting import Fitting

AnswerT = TypeVar('AnswerT')
FITTING_NICENESS = 10  # where processors are scarce those who are followed go first
# Without caches the first answer takes minutes, any other a part of a second.
FIRST_PATIENCE_S, PATIENCE_S = 600.0, 30.0
# Not `-m`, which would look for modules in the working directory before all others.
PROGRAM = ('import sys; niceness, *sys.path[:] = sys.argv[1:]; '
           'from pop_ros.finding_process import main; main(int(niceness))')
AUTOGROUP, AUTOGROUP_TRIES = Path('/proc/self/autogroup'), 30
ORPHAN_S = 1.0  # from one look at whether the node still runs to the next
STOPPED = 'the process that finds people was stopped'
Equip = Callable[[PipelineConfig], Any]
FITTING = Fitting()


class FindingError(PopError):
    """The process that finds people ended, or is none to be had."""


class FindingProcess:
    """A process with what it works with; one that ended is replaced for the next person."""

    def __init__(self, equip: Equip = FITTING, niceness: int = FITTING_NICENESS) -> None:
        """Start nothing yet.

        Args:
            equip: Makes there, of the settings, what work is done with; pickled.
            niceness: How far the process stands back where processors are scarce.
        """
        self._equip, self._niceness = equip, niceness
        self._config = PipelineConfig()
        self._process: subprocess.Popen[bytes] | None = None
        self._is_loaded = self._is_stopped = False
        self._asked_s: float | None = None
        # So that no process is started while another thread stops the last one.
        self._lock = threading.Lock()
        # A thread waits for the answers, and asks in order.
        self._waiting = ThreadPoolExecutor(1, 'pop finding people')

    @property
    def busy_s(self) -> float:
        """Return for how long the same answer is waited for [s]; loading does not count."""
        asked_s = self._asked_s
        return 0.0 if asked_s is None else time.monotonic() - asked_s

    def configure(self, config: PipelineConfig) -> None:
        """Use these settings from the next person on."""
        self._config = config

    def start(self) -> Future[None]:
        """Load there what work is done with; the first person would wait for it."""
        return self.submit(_nothing)

    def submit(self, work: Callable[..., AnswerT], *inputs: Any) -> Future[AnswerT]:
        """Begin `work(equipment, *inputs)` there.

        The future fails with `FindingError` if the process ends, and with the error of the work.

        Args:
            work: A function of a module.
            inputs: What it is given, to be pickled.
        """
        try:
            return self._waiting.submit(self._answer, work, inputs, self._config)
        except RuntimeError:  # the thread has been told to end
            refused: Future[AnswerT] = Future()
            refused.set_exception(FindingError(STOPPED))
            return refused

    def stop(self) -> None:
        """End the process, whatever it does; what still waits fails."""
        with self._lock:
            self._is_stopped = True
            if self._process is not None:
                self._process.kill()
                self._process.wait()
        self._waiting.shutdown(wait=False)

    def _answer(
        self, work: Callable[..., AnswerT], inputs: Sequence[Any], config: PipelineConfig
    ) -> Any:
        child = self._child()
        if not self._is_loaded:
            self._ask(child, FIRST_PATIENCE_S, _nothing, (), config)
            self._is_loaded = True
        self._asked_s = time.monotonic()
        try:
            return self._ask(child, PATIENCE_S, work, inputs, config)
        finally:
            self._asked_s = None

    def _ask(
        self, child: subprocess.Popen[bytes], patience_s: float, work: Callable[..., Any],
        inputs: Sequence[Any], config: PipelineConfig,
    ) -> Any:
        job = self._equip, config, work, inputs
        data = pickle.dumps(job, protocol=pickle.HIGHEST_PROTOCOL)
        answer = _exchange(child, data, patience_s)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def _child(self) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._is_stopped:
                raise FindingError(STOPPED)
            if self._process is None or self._process.poll() is not None:
                self._process, self._is_loaded = _started(self._niceness), False
            return self._process


def _exchange(child: subprocess.Popen[bytes], data: bytes, patience_s: float) -> Any:
    """Return the answer of a process; it is ended when it takes longer."""
    assert child.stdin is not None
    assert child.stdout is not None
    asked_s = time.monotonic()
    watchdog = threading.Timer(patience_s, child.kill)
    watchdog.daemon = True
    watchdog.start()
    try:
        child.stdin.write(data)
        child.stdin.flush()
        return pickle.load(child.stdout)
    except Exception as error:
        child.kill()  # what it says next would be taken for another answer
        raise FindingError(
            f'the process that finds people ended with code {child.wait()} after '
            f'{time.monotonic() - asked_s:.1f} s; the next person starts another') from error
    finally:
        watchdog.cancel()


def _started(niceness: int) -> subprocess.Popen[bytes]:
    # In a session of its own: Ctrl-C in a terminal is for the node to answer.
    try:
        return subprocess.Popen(
            [sys.executable, '-c', PROGRAM, str(niceness), *sys.path], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, start_new_session=True)
    except OSError as error:
        raise FindingError(
            f'expected a second process to find people in, found none: {error}') from error


def _nothing(_equipment: Any) -> None:
    """Do nothing with what has been loaded for it."""


def _done(
    equip: Equip, config: PipelineConfig, work: Callable[..., AnswerT], inputs: Sequence[Any]
) -> AnswerT:
    return work(equip(config), *inputs)


def answer_jobs(jobs: BinaryIO, answers: BinaryIO) -> None:
    """Answer jobs with who was found, or with the error met, until there are no more."""
    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        answer: Any
        try:
            answer = _done(*job)
        except Exception as error:  # noqa: BLE001 - the node counts it and says it
            answer = error
        answers.write(_as_sent(answer))
        answers.flush()


def _as_sent(answer: Any) -> bytes:
    """Return an answer pickled; an error that would not arrive, by its name and words."""
    try:
        data = pickle.dumps(answer, protocol=pickle.HIGHEST_PROTOCOL)
        if isinstance(answer, Exception):
            pickle.loads(data)
    except Exception:  # noqa: BLE001 - anything may happen in the methods of an error
        return pickle.dumps(FindingError(f'{type(answer).__name__}: {answer}'))
    return data


def _stay_behind(node: int, niceness: int) -> None:
    """Give way to processes of other sessions, and end with the node, whatever is done here.

    Linux shares processors out among sessions first (autogroups), whatever the niceness of who is
    in them: this process, which has a session of its own, would get as much as the whole node.
    """
    for _ in range(AUTOGROUP_TRIES):
        try:
            AUTOGROUP.write_text(str(niceness), encoding='ascii')
        except BlockingIOError:
            # One of all processes may do so within 0.1 s; those of a node start together.
            time.sleep(0.1 + os.getpid() % 7 * 0.01)
        except OSError:
            break  # this Linux has none
        else:
            break
    while os.getppid() == node:
        time.sleep(ORPHAN_S)
    os._exit(1)


def main(niceness: int) -> None:
    """Answer on what was the standard output; whatever is printed goes elsewhere."""
    node = os.getppid()
    threading.Thread(
        target=_stay_behind, args=(node, os.nice(niceness)), name='pop stay behind', daemon=True,
    ).start()
    ThreadpoolController().limit(limits=1, user_api='blas')
    with os.fdopen(os.dup(1), 'wb') as answers:
        os.dup2(2, 1)
        answer_jobs(sys.stdin.buffer, answers)
