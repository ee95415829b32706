"""Compositing beside the display: a worker makes frames while the loop shows the newest one from where the
head is now."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import persp_sw as psw

from .frame import Frame
from .loop import Loop
from .moment import Moment
from .rest_watch import RestWatch
from .shown import Shown
from .worker import Worker

# Parts of walls' sizes by what they are fixed to. A head's: at the edge of a display of 90° that is 1.7°, as
# much as a head that turns by 100° a second goes in a period of 60 Hz; prediction leaves less. A room's: what
# one sees past the edges of a wall of 2 m, of things however far, when one moves by 20 mm.
_MARGINS = {"head": 0.03, "room": 0.01}
# Part of the way from the old mean to a new time of compositing.
_FOLLOW = 0.3


@dataclass(frozen=True, eq=False)
class Order:
    """A moment to composite; `resting`: with more time than a frame has.

    `wanted`: what the user wants of it, by which one asks for the same moment anew.
    """

    moment: Moment
    wanted: tuple[object, ...]
    resting: bool = False


class Beside:
    """Frames of a loop, one after another composited by a thread of its own.

    The thread always takes the newest moment; meanwhile the display goes on with the eye images that are
    there, warped for the newest head. Moments are composited for the time at which they will be seen.

    Parameters
    ----------
    loop
        Its eye images are made to be seen from elsewhere (`Settings.depth_slabs`, at least 1). Its tracker is
        polled by `show`, its renderer works in the thread: change its settings through `loop.steady.base`,
        its regions through `loop.regions`.
    period_s
        Of the display.
    """

    def __init__(self, loop: Loop, period_s: float):
        self.loop, self.period_s = loop, period_s
        steady, controller = loop.steady, loop.steady.controller
        steady.base = replace(steady.base, depth_slabs=max(steady.base.depth_slabs, 1))
        steady.refinement = None if controller is None else psw.Refinement(controller.ladder)
        self._rest = RestWatch()
        self._worker = Worker(self._work)
        self._making_s = period_s  # what a frame takes, smoothed
        self._asked: Order | None = None
        self._gave_up = False  # since the last frame
        self._shown: Frame | None = None

    def show(self, now: float) -> Shown | None:
        """What to draw for the display's next refresh; None before the first frame is finished.

        Raises
        ------
        Exception
            Whatever compositing raised.
        """
        loop = self.loop
        frame: Frame | None = self._worker.newest()
        loop.poll(now)
        moment = loop.moment(now + self.period_s)
        loop.look(moment)
        is_new = frame is not self._shown
        if is_new:
            cost = frame.made.cost
            self._making_s += _FOLLOW * (1e-3 * (cost.ms + cost.planning_ms) - self._making_s)
            self._shown, self._gave_up = frame, False
        self._ask(now)
        return None if frame is None else Shown(frame, moment, is_new)

    def drawn(self, shown: Shown, upload_ms: float, warp_ms: float, swap_ms: float) -> None:
        """Nothing: compositing does not wait for the display."""

    def wait(self, timeout_s: float | None = None) -> bool:
        """Until what was asked for is finished, at most so long; whether it is."""
        return self._worker.wait(timeout_s)

    def close(self) -> None:
        """Give up what is being composited, and end the thread."""
        self._worker.close()

    def __enter__(self) -> Beside:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, now: float) -> None:
        moment = self.loop.moment(now + self.period_s + self._making_s, _MARGINS)
        wanted = self.loop.steady.base, self.loop.steady.held
        if self._rest.look(moment, now):
            order = Order(self._rest.anchor, wanted, resting=True)
            if self._is_asked(order) and (self._worker.is_busy or self.loop.steady.is_refined):
                return
        else:
            order = Order(moment, wanted)
        self._worker.ask(order, cancel_running=self._is_useless(order))
        self._asked = order

    def _is_asked(self, order: Order) -> bool:
        asked = self._asked
        return asked is not None and (asked.moment, asked.wanted, asked.resting) == (
            order.moment,
            order.wanted,
            order.resting,
        )

    def _is_useless(self, order: Order) -> bool:
        """Whether what is being composited is not worth waiting for; never twice in a row without a frame."""
        asked = self._asked
        if asked is None or self._gave_up:
            return False
        other_scene = asked.moment.regions is not order.moment.regions or not np.array_equal(
            asked.moment.room_from_world, order.moment.room_from_world
        )
        self._gave_up = other_scene or (asked.resting and not order.resting)
        return self._gave_up

    def _work(self, order: Order, cancel: psw.Cancel) -> Frame:
        frame = self.loop.steady.make(order.moment, cancel, order.resting)
        self.loop.steady.drawn(frame)
        return frame
