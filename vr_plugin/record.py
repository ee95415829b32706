"""What a frame's record says of a frame that was shown."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import numpy as np

import persp_sw as psw

from .moment import Moment
from .pose import Pose
from .shown import Shown

# Part of a period that a frame may be late and still be in time: displays queue a frame or two.
_LATE = 0.1


class Times(NamedTuple):
    """When and how long, by the loop's clock: seconds; the stages in milliseconds.

    On a display the clock is `time.monotonic`.
    """

    begin_s: float
    end_s: float
    upload_ms: float
    warp_ms: float
    swap_ms: float
    frame_ms: float


class FrameClock:
    """Times of frames on a display: each counts from the end of the one that it follows at once."""

    def __init__(self) -> None:
        self._end_s: float | None = None  # of the last frame, where the next one follows at once

    def take(self, begin_s: float, end_s: float, upload_ms: float, warp_ms: float, swap_ms: float) -> Times:
        """The times of the frame that ends now; after a pause it counts from its own begin."""
        frame_ms = 1e3 * (end_s - (begin_s if self._end_s is None else self._end_s))
        self._end_s = end_s
        return Times(begin_s, end_s, upload_ms, warp_ms, swap_ms, frame_ms)

    def pause(self) -> None:
        """The next frame does not follow the last one at once."""
        self._end_s = None


def record_of(
    number: int, shown: Shown, times: Times, target_ms: float, *, on_display: bool
) -> psw.FrameRecord:
    """The record of frame `number`.

    Parameters
    ----------
    on_display
        Whether it was swapped to a screen; else nobody saw it, and no latency is known.
    """
    frame, made = shown.frame, shown.frame.made
    choice = made.choice if made else None
    cost = made.cost if made and shown.is_new else None
    stamp = shown.moment.stamp
    moved = shown.moment is not frame.moment and not _is_same_place(shown.moment, frame.moment)
    return psw.FrameRecord(
        number,
        times.begin_s,
        shown_s=times.end_s if on_display else None,
        head=_numbers(frame.head),
        shown_head=_numbers(shown.moment.head) if moved else None,
        target_ms=target_ms,
        budget_ms=choice.budget_ms if choice else None,
        quality=made.quality if made else None,
        rung=choice.rung if choice else "",
        why=choice.why if choice else "",
        expected_ms=choice.expected_ms if choice else None,
        composite_ms=cost.ms if cost else None,
        planning_ms=cost.planning_ms if cost else None,
        upload_ms=times.upload_ms,
        warp_ms=times.warp_ms,
        swap_ms=times.swap_ms,
        frame_ms=times.frame_ms,
        missed=max(ceil(times.frame_ms / target_ms - _LATE) - 1, 0),
        latency_ms=1e3 * (times.end_s - stamp) if on_display and stamp is not None else None,
        samples=int(cost.samples) if cost else None,
        pixels=int(cost.pixels) if cost else None,
        faces=sum(len(image.faces) for image in frame.images.values()),
        compositings=frame.compositings if shown.is_new else 0,
        image_age_ms=1e3 * (times.end_s - made.begun_s) if made and on_display else None,
        rewarped=moved,
        refined=made is not None and made.refined,
    )


def _is_same_place(one: Moment, other: Moment) -> bool:
    """Whether images of one moment are just what is seen at the other."""
    places = ((m.room_from_world, m.head.position, m.head.orientation) for m in (one, other))
    return all(np.array_equal(a, b) for a, b in zip(*places, strict=True))


def _numbers(pose: Pose) -> Sequence[float]:
    return (*pose.position.tolist(), *pose.orientation.tolist())
