"""The worker takes the newest item, survives errors and ends."""

import threading

import pytest

from pop_ros.worker import Mailbox, Worker


def test_a_newer_item_replaces_one_that_waits_and_says_so() -> None:
    mailbox: Mailbox[int] = Mailbox()
    assert [mailbox.put(i) for i in (1, 2, 3)] == [False, True, True]
    assert mailbox.take() == 3
    assert not mailbox.put(4)


def test_clearing_drops_what_waits_and_says_whether_there_was_anything() -> None:
    mailbox: Mailbox[int] = Mailbox()
    mailbox.put(1)
    assert mailbox.clear()
    assert not mailbox.clear()
    assert not mailbox.put(2)


def test_a_busy_worker_skips_to_the_newest_item() -> None:
    seen: list[int] = []
    entered, release, done = threading.Event(), threading.Event(), threading.Event()

    def process(item: int) -> None:
        seen.append(item)
        entered.set()
        release.wait(5)
        if item == 9:
            done.set()

    worker = Worker(process, lambda _error: None)
    worker.start()
    worker.mailbox.put(0)
    assert entered.wait(5)
    for item in range(1, 10):
        worker.mailbox.put(item)
    release.set()
    assert done.wait(5)
    assert seen == [0, 9]
    assert worker.stop(5)


def test_an_error_is_told_and_the_next_item_still_processed() -> None:
    errors: list[Exception] = []
    done = threading.Event()

    def process(item: int) -> None:
        if item == 0:
            raise ValueError('bad frame')
        done.set()

    def on_error(error: Exception) -> None:
        errors.append(error)
        worker.mailbox.put(1)

    worker = Worker(process, on_error)
    worker.start()
    worker.mailbox.put(0)
    assert done.wait(5)
    assert [str(error) for error in errors] == ['bad frame']
    assert worker.stop(5)


def test_a_failed_preparation_ends_the_worker_and_is_told() -> None:
    told = threading.Event()

    def prepare() -> None:
        raise OSError('no such library')

    worker: Worker[int] = Worker(lambda _item: None, lambda _error: told.set(), prepare)
    worker.start()
    assert told.wait(5)
    assert worker.stop(5)


def test_stopping_tells_when_the_work_does_not_end() -> None:
    entered, release = threading.Event(), threading.Event()

    def process(_item: int) -> None:
        entered.set()
        release.wait(10)

    worker = Worker(process, lambda _error: None)
    worker.start()
    worker.mailbox.put(1)
    assert entered.wait(5)
    assert not worker.stop(0.05)
    release.set()
    assert worker.stop(5)


def test_a_worker_that_never_started_stops_at_once() -> None:
    assert Worker(lambda _item: None, lambda _error: None).stop(0)


def test_tasks_are_done_in_order_before_the_next_item_and_errors_told() -> None:
    done: list[object] = []
    entered, release, finished = threading.Event(), threading.Event(), threading.Event()

    def process(item: int) -> None:
        entered.set()
        release.wait(5)
        done.append(item)
        if item == 2:
            finished.set()

    def fail() -> None:
        raise ValueError('bad task')

    worker = Worker(process, done.append)
    worker.start()
    worker.mailbox.put(1)
    assert entered.wait(5)
    worker.mailbox.put(2)
    for task in (lambda: done.append('a'), fail, lambda: done.append('b')):
        worker.call(task)
    release.set()
    assert finished.wait(5)
    assert [str(entry) for entry in done] == ['1', 'a', 'bad task', 'b', '2']
    assert worker.stop(5)


def test_tasks_given_before_the_end_are_done_and_a_waiting_item_is_not() -> None:
    done: list[object] = []
    entered, release = threading.Event(), threading.Event()

    def process(item: int) -> None:
        done.append(item)
        entered.set()
        release.wait(5)

    worker = Worker(process, done.append)
    worker.start()
    worker.mailbox.put(1)
    assert entered.wait(5)
    worker.mailbox.put(2)
    worker.call(lambda: done.append('last'))
    threading.Timer(0.05, release.set).start()
    assert worker.stop(5)
    assert done == [1, 'last']


def test_a_failure_to_tell_of_an_error_does_not_end_the_work(
    capsys: pytest.CaptureFixture[str]
) -> None:
    done = threading.Event()

    def process(item: int) -> None:
        if item == 0:
            raise ValueError('bad frame')
        done.set()

    def on_error(_error: Exception) -> None:
        worker.mailbox.put(1)
        raise OSError('disk full')

    worker = Worker(process, on_error)
    worker.start()
    worker.mailbox.put(0)
    assert done.wait(5)
    assert worker.stop(5)
    assert 'disk full' in capsys.readouterr().err
