"""The worker thread: the newest task wins, nothing mixes, errors arrive, and it always ends."""

from __future__ import annotations

import gc
import logging
import traceback
import weakref
from queue import Queue
from threading import Event, Thread, current_thread
from time import monotonic

import pytest

import persp_sw as psw
from vr_plugin.worker import Worker

LONG = 60.0  # seconds; only a failure waits so long


class Gated:
    """Work that tells when it begins and goes on when it is let: all that a test needs to set the order."""

    def __init__(self, looks: bool = True):
        self.looks = looks
        self.begun: Queue = Queue()
        self.started: list = []
        self.go = Event()
        self.cancels: dict = {}

    def __call__(self, task, cancel):
        self.started.append(task)
        self.cancels[task] = cancel
        self.begun.put(task)
        assert self.go.wait(LONG)
        if self.looks:
            cancel.check()
        return f"result of {task}"


def test_the_newest_task_wins_and_replaced_ones_are_never_started():
    work = Gated()
    with Worker(work) as worker:
        assert worker.newest() is None and not worker.is_busy
        worker.ask(0)
        assert work.begun.get(timeout=LONG) == 0
        for task in (1, 2, 3):
            worker.ask(task)
        assert worker.is_busy and not worker.wait(0)
        assert worker.newest() is None  # without waiting for what is being done
        work.go.set()
        assert worker.wait(LONG) and not worker.is_busy
        assert work.started == [0, 3]
        assert worker.newest() is worker.newest() == "result of 3"
        assert not any(cancel.is_cancelled for cancel in work.cancels.values())


@pytest.mark.parametrize("looks", [True, False])
def test_cancelled_work_leaves_no_result(looks):
    begun, go = Queue(), {"old": Event(), "new": Event()}

    def work(task, cancel):
        begun.put((task, cancel))
        assert go[task].wait(LONG)
        if looks:
            cancel.check()
        return task

    with Worker(work) as worker:
        worker.ask("old")
        task, cancel = begun.get(timeout=LONG)
        worker.ask("new", cancel_running=True)
        assert task == "old" and cancel.is_cancelled
        go["old"].set()
        task, cancel = begun.get(timeout=LONG)
        assert task == "new" and worker.newest() is None  # so the old one has ended, and left nothing
        go["new"].set()
        assert worker.wait(LONG)
        assert worker.newest() == "new" and not cancel.is_cancelled


def test_a_cancel_with_nothing_running_harms_nobody():
    with Worker(lambda task, cancel: (task, cancel.is_cancelled)) as worker:
        worker.ask("first", cancel_running=True)
        assert worker.wait(LONG)
        assert worker.newest() == ("first", False)


def test_work_that_gives_up_by_itself_leaves_the_result_before():
    def work(task, cancel):
        if task == "given up":
            raise psw.Cancelled
        return task

    with Worker(work) as worker:
        for task in ("done", "given up"):
            worker.ask(task)
            assert worker.wait(LONG)
        assert worker.newest() == "done"


def test_what_the_work_raises_reaches_the_caller_once_with_its_traceback():
    def fails_here(task):
        raise KeyError(task)

    with Worker(lambda task, cancel: task if task != "bad" else fails_here(task)) as worker:
        for task in ("good", "bad"):
            worker.ask(task)
            assert worker.wait(LONG)
        with pytest.raises(KeyError, match="bad") as caught:
            worker.newest()
        assert "fails_here" in "".join(traceback.format_tb(caught.value.__traceback__))
        assert worker.newest() == "good"
        worker.ask("better")
        assert worker.wait(LONG)
        assert worker.newest() == "better"


def test_an_error_that_was_told_is_forgotten():
    class Failure(Exception):
        pass

    failures: weakref.WeakSet[Failure] = weakref.WeakSet()

    def work(task, cancel):
        failure = Failure()
        failures.add(failure)
        try:
            raise failure
        finally:
            del failure

    gc.disable()  # references alone must do: its traceback holds tasks and images
    try:
        with Worker(work) as worker:
            worker.ask(0)
            assert worker.wait(LONG)
            assert len(failures) == 1
            try:
                worker.newest()
            except Failure:
                pass
            else:
                pytest.fail("the error was not told")
        assert len(failures) == 0
    finally:
        gc.enable()


def test_the_first_of_several_errors_is_told():
    def work(task, cancel):
        raise ValueError(task)

    with Worker(work) as worker:
        for task in ("cause", "consequence"):
            worker.ask(task)
            assert worker.wait(LONG)
        with pytest.raises(ValueError, match="cause"):
            worker.newest()
        assert worker.newest() is None


def test_an_error_nobody_asked_for_is_told_at_the_end(caplog):
    def work(task, cancel):
        raise ValueError(task)

    with pytest.raises(ValueError, match="untold"), Worker(work) as worker:
        worker.ask("untold")
        assert worker.wait(LONG)
    # … unless there is one already, which it must not replace.
    with (
        caplog.at_level(logging.ERROR, "persp_sw"),
        pytest.raises(ZeroDivisionError),
        Worker(work) as worker,
    ):
        worker.ask("hidden")
        assert worker.wait(LONG)
        raise ZeroDivisionError
    assert [record.message.count("hidden") for record in caplog.records] == [1]


def test_close_cancels_what_is_done_and_drops_what_waits():
    begun, started = Event(), []

    def work(task, cancel):
        started.append(task)
        begun.set()
        while not cancel.is_cancelled:
            pass
        cancel.check()

    worker = Worker(work)
    worker.ask("endless")
    assert begun.wait(LONG)
    worker.ask("never")
    worker.close()
    worker.close()
    assert started == ["endless"] and not worker.is_busy and worker.newest() is None
    with pytest.raises(RuntimeError, match="closed"):
        worker.ask("late")


def test_close_leaves_work_behind_that_never_looks_and_says_so(caplog):
    work, thread = Gated(looks=False), []
    worker = Worker(lambda task, cancel: thread.append(current_thread()) or work(task, cancel), "deaf")
    worker.ask(1)
    assert work.begun.get(timeout=LONG) == 1
    with caplog.at_level(logging.WARNING, "persp_sw"):
        worker.close(patience=0)
    assert ["deaf does not stop" in record.message for record in caplog.records] == [True]
    work.go.set()
    thread[0].join(LONG)
    assert not thread[0].is_alive() and worker.newest() is None


def test_many_threads_may_ask_and_look():
    threads, tasks = 8, 400
    working, mixed, started = [], [], []

    def work(task, cancel):
        working.append(task)
        started.append(task)
        mixed.append(len(working) != 1)
        working.remove(task)
        return (task, ("of", task))

    with Worker(work) as worker:

        def ask(name):
            latest = {}
            for number in range(tasks):
                worker.ask((name, number), cancel_running=number % 3 == 0)
                if (result := worker.newest()) is not None:
                    (owner, done), (_, other) = result
                    mixed.append((owner, done) != other or done < latest.get(owner, 0))
                    latest[owner] = done

        askers = [Thread(target=ask, args=(name,)) for name in range(threads)]
        for asker in askers:
            asker.start()
        for asker in askers:
            asker.join()
        assert worker.wait(LONG)
        assert worker.newest()[0] == started[-1]
    assert not any(mixed)
    for name in range(threads):
        own = [number for owner, number in started if owner == name]
        assert own == sorted(set(own))


def test_ten_thousand_tasks_leave_one_result():
    class Thing:
        pass

    alive: weakref.WeakSet[Thing] = weakref.WeakSet()

    def work(task, cancel):
        result = Thing()
        alive.add(result)
        return result

    most = 0
    with Worker(work) as worker:
        gc.disable()  # references alone must do
        try:
            for number in range(10_000):
                task = Thing()
                alive.add(task)
                worker.ask(task)
                if number % 2:
                    assert worker.wait(LONG)
                most = max(most, len(alive))
            del task
            assert worker.wait(LONG)
            late = monotonic() + LONG
            while len(alive) > 1 and monotonic() < late:
                pass  # the thread, idle now, lets go of its task
            assert list(alive) == [worker.newest()]
        finally:
            gc.enable()
    # Shown, being done and waiting: a task each and two results; one more task was just replaced, or done.
    assert most <= 6
