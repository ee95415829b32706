"""Compositing beside the display: a worker makes frames while the loop shows the newest one from where the
head is now."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import TracebackType

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

    def is_same(self, other: Order) -> bool:
        """Whether the same is to be composited, but for what refinement adds."""
        same = self.moment is other.moment and self.resting == other.resting
        return same and self.wanted == other.wanted

    def is_useless_for(self, other: Order) -> bool:
        """Whether nobody would wait for this any more who now asks for `other`."""
        return (
            self.wanted != other.wanted
            or self.moment.regions is not other.moment.regions
            or not np.array_equal(self.moment.room_from_world, other.moment.room_from_world)
            or (self.resting and not other.resting)
        )


class Beside:
    """Frames of a loop, one after another composited by a thread of its own.

    The thread always takes the newest moment; meanwhile the display goes on with the eye images that are
    there, warped for the newest head. Moments are composited for the time at which they will be seen.

    Parameters
    ----------
    loop
        Its eye images are made to be seen from elsewhere (`Settings.depth_slabs`, at least 1). Its tracker is
        polled by `show`, its renderer works in the thread: change its settings through `loop.steady`, its
        regions through `loop.regions`.
    period_s
        Of the display.
    """

    def __init__(self, loop: Loop, period_s: float):
        self.loop, self.period_s = loop, period_s
        steady, controller = loop.steady, loop.steady.controller
        steady.base = replace(steady.base, depth_slabs=max(steady.base.depth_slabs, 1))
        steady.refinement = None if controller is None else psw.Refinement(controller.ladder)
        self._rest = RestWatch()
        self._at_rest: tuple[Moment, Moment] | None = None  # the rest's anchor, and what is refined for it
        self._worker: Worker[Order, Frame] = Worker(self._work)
        self._making_s = period_s  # what a frame of a moving head takes, smoothed
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
        loop, frame = self.loop, self._worker.newest()
        loop.poll(now)
        is_new = frame is not self._shown
        if is_new:
            self._take(frame)
        # Walls show what the frame has eyes for, until one of a new mode is finished.
        moment = loop.moment(now + self.period_s, stereo=frame.moment.stereo if frame else None)
        self._ask(moment, now)
        if frame is None:
            return None
        loop.look(moment)
        return Shown(frame, moment, is_new)

    def drawn(self, shown: Shown, upload_ms: float, warp_ms: float) -> None:
        """Nothing: compositing does not wait for the display."""

    def wait(self, timeout_s: float | None = None) -> bool:
        """Until what was asked for is finished, at most so long; whether it is."""
        return self._worker.wait(timeout_s)

    def close(self) -> None:
        """Give up what is being composited, and end the thread."""
        self._worker.close()

    def __enter__(self) -> Beside:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._worker.__exit__(kind, error, trace)

    def _take(self, frame: Frame) -> None:
        self._shown, self._gave_up = frame, False
        if not frame.made.refined:
            spent_s = 1e-3 * (frame.made.cost.ms + frame.made.cost.planning_ms)
            self._making_s += _FOLLOW * (spent_s - self._making_s)

    def _ask(self, seen: Moment, now: float) -> None:
        wanted = self.loop.steady.base, self.loop.steady.held, self.loop.modes
        if self._rest.look(seen, now):
            order = Order(self._resting(now), wanted, resting=True)
            same = self._asked is not None and self._asked.is_same(order)
            if same and (self._worker.is_busy or self.loop.steady.is_refined):
                return
        else:
            order = Order(self._ahead(now), wanted)
        doing = self._worker.doing
        useless = doing is not None and not self._gave_up and doing.is_useless_for(order)
        self._gave_up |= self._worker.ask(order, cancel_running=useless)
        self._asked = order

    def _resting(self, now: float) -> Moment:
        """One moment for all of a rest: of its anchor's time, with the eyes that walls show now."""
        anchor = self._rest.anchor
        known = self._at_rest
        if known is None or known[0] is not anchor or known[1].stereo != self.loop.stereo:
            self._at_rest = anchor, self._ahead(now)
        return self._at_rest[1]

    def _ahead(self, now: float) -> Moment:
        """When an image begun now will be seen, as far as a head's motion can be foreseen."""
        ahead_s = min(self.period_s + self._making_s, self.loop.head.settings.look_ahead)
        return self.loop.moment(now + ahead_s, _MARGINS)

    def _work(self, order: Order, cancel: psw.Cancel) -> Frame:
        frame = self.loop.steady.make(order.moment, cancel, order.resting)
        self.loop.steady.drawn(frame)
        return frame
