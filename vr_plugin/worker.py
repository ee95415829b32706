"""A thread that does the newest thing it was asked for, while its owner goes on with what is done."""

from __future__ import annotations

import atexit
import logging
from collections.abc import Callable
from threading import Condition, Thread
from types import TracebackType
from typing import Generic, TypeVar

import persp_sw as psw

_log = logging.getLogger("persp_sw")

Task = TypeVar("Task")
Result = TypeVar("Result")
# Seconds that a task may go on after it was cancelled before `close` leaves it behind.
PATIENCE = 10.0


class Worker(Generic[Task, Result]):
    """Does one task at a time, in a thread of its own: always the newest.

    At most three things exist: the result shown, the task being done, and one that waits. Results are handed
    over by reference, so let them be immutable: the owner may draw one for as long as it likes. The only lock
    is held for a few assignments, never while `work` runs.

    Parameters
    ----------
    work
        work(task, cancel) → result, called in the thread. It should look at `cancel` often, as
        `Renderer.composite` does; what never looks is waited for, and its result is dropped.
    name
        Of the thread.

    Use it as a context manager, or `close` it. The thread ends with the process in any case: work under way
    is cancelled at exit, so an interrupt (Ctrl-C), which Python raises in the main thread alone, leaves no
    thread behind.
    """

    def __init__(self, work: Callable[[Task, psw.Cancel], Result], name: str = "worker"):
        self._work = work
        self._changed = Condition()
        self._waiting: tuple[Task, psw.Cancel] | None = None
        self._running: tuple[Task, psw.Cancel] | None = None
        self._result: Result | None = None
        self._error: BaseException | None = None
        self._closed = False
        # A daemon, or the interpreter would wait for it before it calls what `atexit` was told.
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()
        atexit.register(self._give_up, PATIENCE)

    def ask(self, task: Task, cancel_running: bool = False) -> bool:
        """Have `task` done as soon as the thread is free; one that still waits is never started.

        `cancel_running`: the one being done is not worth finishing. Cancelled work leaves no result; so if
        every task is cancelled by the next, there never is one. Returns whether one was cancelled.

        Raises
        ------
        RuntimeError
            The worker is closed.
        """
        with self._changed:
            if self._closed:
                raise RuntimeError("this worker is closed")
            self._waiting = task, psw.Cancel()
            cancelled = cancel_running and self._running is not None
            if cancelled:
                self._running[1].cancel()
            self._changed.notify_all()
        return cancelled

    @property
    def doing(self) -> Task | None:
        """The task being done; None while there is none."""
        with self._changed:
            return None if self._running is None else self._running[0]

    def newest(self) -> Result | None:
        """The result of the newest finished task, the same until there is a newer one; None before the first.

        Does not wait.

        Raises
        ------
        Whatever `work` raised since the last call: the first of it, once, with its traceback. The thread goes
        on, and so may the caller.
        """
        with self._changed:
            error, self._error = self._error, None
            if error is None:
                return self._result
        try:
            raise error
        finally:
            del error  # it holds this frame, which would hold it

    @property
    def is_busy(self) -> bool:
        """Whether a task is being done or waits."""
        with self._changed:
            return self._running is not None or self._waiting is not None

    def wait(self, timeout: float | None = None) -> bool:
        """Wait, at most `timeout` seconds, until nothing is left to do; returns whether nothing is."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.is_busy, timeout)

    def close(self, patience: float = PATIENCE) -> None:
        """Cancel all work, and wait for the thread to end; done twice, it does nothing.

        Work that does not look at its `Cancel` within `patience` seconds is left behind, with a warning: it
        may go on to its end, but nothing comes of it.

        Raises
        ------
        Whatever `work` raised since the last `newest`.
        """
        atexit.unregister(self._give_up)
        self._give_up(patience)
        self.newest()

    def __enter__(self) -> Worker[Task, Result]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
            return
        try:
            self.close()
        except BaseException as second:  # the first is what the caller must hear of
            _log.error("besides, the worker failed: %r", second, exc_info=second)

    def _give_up(self, patience: float) -> None:
        with self._changed:
            self._closed, self._waiting = True, None
            if self._running is not None:
                self._running[1].cancel()
            self._changed.notify_all()
        self._thread.join(patience)
        if self._thread.is_alive():
            _log.warning("%s does not stop within %g s of being cancelled", self._thread.name, patience)

    def _run(self) -> None:
        while (job := self._next()) is not None:
            self._do(*job)
            del job  # or the task would live until the next one comes

    def _next(self) -> tuple[Task, psw.Cancel] | None:
        """The next task to do; None when closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._waiting is not None)
            job, self._waiting = self._waiting, None
            self._running = job
            return job

    def _do(self, task: Task, cancel: psw.Cancel) -> None:
        result = error = None
        try:
            result = self._work(task, cancel)
        except psw.Cancelled:
            cancel.cancel()
        except BaseException as raised:
            error = raised
        with self._changed:
            self._running = None
            if error is not None:
                self._error = self._error or error
            elif not cancel.is_cancelled:
                self._result = result
            self._changed.notify_all()
        del error  # its traceback holds this frame
