"""Frames that keep to their time: composited as a frame-time controller chooses, or refined at rest."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from time import monotonic

import persp_sw as psw

from .frame import Frame, FrameMaker, Made
from .moment import Moment


class Steady:
    """Composites moments one after another, in whatever thread calls it, one at a time.

    Parameters
    ----------
    maker
        Its renderer's settings are the user's; a controller's choices are laid over them.
    controller
        A `FrameTimeController`, or another rule with its `next`. None: every frame with those settings.

    Attributes
    ----------
    base
        The user's settings, which may be assigned at any time.
    held
        Quality that every frame has, at rest, too; None: it is free, or as in `base`. May be assigned at any
        time, in any thread.
    refinement
        Of a resting viewer's pictures; None: rest changes nothing.
    """

    def __init__(self, maker: FrameMaker, controller: psw.FrameTimeController | None = None):
        self.maker, self.controller = maker, controller
        self.base = maker.renderer.settings
        self.held: float | None = None
        self.refinement: psw.Refinement | None = None
        self._controller_holds: float | None = None
        self._finished: deque[tuple[psw.FrameCost, psw.Choice]] = deque(maxlen=1)

    @property
    def is_refined(self) -> bool:
        """Whether a resting viewer's pictures would not become better than the last."""
        return self.refinement is None or self.held is not None or self.refinement.is_full

    def make(
        self,
        moment: Moment,
        cancel: psw.Cancel | None = None,
        resting: bool = False,
        begun_s: float | None = None,
    ) -> Frame:
        """The frame of a moment.

        Parameters
        ----------
        resting
            Nothing moves: take more time than a frame has, step by step up to full quality.
        begun_s
            When the work on this frame began, `time.monotonic`: all of it that is no compositing counts as
            planning. None: now.

        Raises
        ------
        Cancelled
            `cancel` was, meanwhile. The controller has made its step, refinement has not.
        """
        renderer = self.maker.renderer
        begun_s = monotonic() if begun_s is None else begun_s
        if moment.regions is not None and moment.regions is not renderer.regions:
            renderer.regions = moment.regions
        if self.controller is None:
            quality = self.held or self.base.quality
            renderer.settings = replace(self.base, quality=quality)
            return self._made(self.maker.composite(moment, cancel), quality, None, begun_s)
        plans = self.maker.plan(moment)
        features = renderer.features_of_plans(plans.values())
        measured, of = self._finished.pop() if self._finished else (None, None)
        self._hold_or_release()
        choice = self.controller.next(features, measured, of)
        if self.refinement is not None:
            choice = self.refinement.next(choice, resting)
        renderer.settings = choice.apply(self.base)
        frame = self.maker.composite(moment, cancel, plans)
        if self.refinement is not None:
            self.refinement.made(choice)
        return self._made(frame, choice.quality, choice, begun_s)

    def _hold_or_release(self) -> None:
        """Tell the controller, here, for it belongs to the thread that composites."""
        held = self.held
        if held == self._controller_holds:
            return
        if held is None:
            self.controller.release()
        else:
            self.controller.hold(held)
        self._controller_holds = held

    def _made(self, frame: Frame, quality: float, choice: psw.Choice | None, begun_s: float) -> Frame:
        names = ("composite_ms", "encode_ms", "compile_ms")
        known_ms = sum(statistics[name] for statistics in frame.statistics.values() for name in names)
        planning_ms = max(1e3 * (monotonic() - begun_s) - known_ms, 0.0)
        return replace(frame, made=Made(quality, choice, frame.cost(planning_ms), begun_s))

    def drawn(self, frame: Frame, upload_ms: float = 0.0, warp_ms: float = 0.0, swap_ms: float = 0.0) -> None:
        """What a frame took besides; the times that the same core cannot composite in."""
        each = frame.statistics.values()
        if any(s["encode_ms"] + s["compile_ms"] > 0 for s in each):
            return  # the caches were cold, too: it tells nothing of the next one
        if frame.made is not None and frame.made.choice is not None:
            cost = replace(frame.made.cost, upload_ms=upload_ms, warp_ms=warp_ms, swap_ms=swap_ms)
            self._finished.append((cost, frame.made.choice))
