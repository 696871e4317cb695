"""The thread that asks the keypoint source: in order, with errors told, and never in the way."""

import subprocess
import sys
import threading
import time
from concurrent.futures import wait

import pytest
from support.node import ROOT

from pop_ros.looking_thread import LookingThread

WAIT_S = 10.0


def test_questions_are_answered_in_order_by_one_other_thread() -> None:
    looking, answered = LookingThread(), []
    answers = [
        looking.submit(lambda k=k: (answered.append(k), threading.get_ident())[1])
        for k in range(20)]
    wait(answers, WAIT_S)
    assert answered == list(range(20))
    thread, = {answer.result() for answer in answers}
    assert thread != threading.get_ident()
    assert looking.stop(WAIT_S)


def test_an_error_belongs_to_its_question_alone() -> None:
    looking = LookingThread()
    failed, good = looking.submit(lambda: 1 / 0), looking.submit(lambda: 2)
    with pytest.raises(ZeroDivisionError):
        failed.result(WAIT_S)
    assert good.result(WAIT_S) == 2
    assert looking.stop(WAIT_S)


def test_a_stopped_thread_ends_once_its_work_is_done() -> None:
    before = threading.active_count()
    looking = LookingThread()
    last = looking.submit(threading.get_ident)
    assert looking.stop(WAIT_S)
    assert last.done()
    assert threading.active_count() == before


def test_a_thread_that_still_thinks_is_said_to() -> None:
    looking, go_on = LookingThread(), threading.Event()
    assert looking.busy_s == 0.0
    answer = looking.submit(go_on.wait)
    assert not looking.stop(0.01)
    before_s = looking.busy_s
    assert 0.01 <= before_s < looking.busy_s
    go_on.set()
    assert answer.result(WAIT_S)
    assert looking.stop(WAIT_S)
    assert looking.busy_s == 0.0


def test_the_time_of_a_look_does_not_count_for_the_next() -> None:
    looking = LookingThread()
    looking.submit(lambda: time.sleep(0.2))
    assert looking.submit(lambda: looking.busy_s).result(WAIT_S) < 0.2
    assert looking.stop(WAIT_S)


def test_a_source_that_never_answers_keeps_no_program_alive() -> None:
    program = ('import threading; from pop_ros.looking_thread import LookingThread; '
               'LookingThread().submit(threading.Event().wait)')
    assert subprocess.run([sys.executable, '-c', program], cwd=ROOT, timeout=60).returncode == 0
