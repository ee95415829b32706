"""The panels of a trace's picture, one under the other, of the same seconds. Needs the package matplotlib."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .trace_bins import Bins
from .trace_reading import Trace
from .trace_summary import WITHIN, frame_ms, quality_limits

# Colours that most colour-blind people tell apart (Okabe and Ito).
_BLUE, _GREEN, _RED, _PINK, _SKY, _ORANGE = "#0072b2", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#e69f00"
_INK, _PALE = "#222222", "#888888"
_STAGES = {  # from below
    "planning_ms": ("planning", _PALE),
    "composite_ms": ("compositing", _BLUE),
    "upload_ms": ("upload", _ORANGE),
    "warp_ms": ("warp", _GREEN),
    "swap_ms": ("swap", _PINK),
}
_RUNGS = (_SKY, _ORANGE, _GREEN, _PINK, _BLUE, _RED, _PALE)
_BINS = 420  # a column of pixels and a half each
_HZ = (10, 15, 20, 30, 45, 60, 72, 90, 120, 144, 240)
_APART = 0.07  # of the axis: nearer rates would be written over each other


@dataclass(frozen=True)
class Common:
    """What all panels of a picture share.

    Attributes
    ----------
    top_ms
        The highest time of a frame that is drawn.
    rungs
        Of all traces: each has a colour.
    of_rates
        Whether the times have an axis of rates on their right.
    """

    top_ms: float
    rungs: tuple[str, ...]
    of_rates: bool


@dataclass(frozen=True)
class Panel:
    """One of the panels.

    Attributes
    ----------
    name, label, inches
        `label` is the vertical axis'; `inches` how high it is.
    fields
        Of frames; with none of them known there is nothing to draw. None at all: there always is.
    of_times
        Whether its scale is that of the target.
    draw
        Called with the axes, the trace, and what all share.
    """

    name: str
    label: str
    inches: float
    fields: Sequence[str]
    of_times: bool
    draw: Callable[[Axes, Trace, Common], None]

    def has(self, trace: Trace) -> bool:
        """Whether there is anything to draw."""
        return not self.fields or any(np.isfinite(trace[name]).any() for name in self.fields)


def percent(share: float) -> str:
    """93 %."""
    return f"{100 * share:.0f} %"


def _draw_time(axis: Axes, trace: Trace, common: Common) -> None:
    times, ms = _seconds(trace), frame_ms(trace)
    bins = Bins(times, _BINS)
    target = bins.median(trace["target_ms"])
    if np.isfinite(target).any():
        axis.fill_between(
            bins.times,
            target * (1 - WITHIN),
            target * (1 + WITHIN),
            color=_GREEN,
            alpha=0.2,
            linewidth=0,
            label=f"target ± {percent(WITHIN)}",
            zorder=1,
        )
        axis.plot(bins.times, target, color=_GREEN, linewidth=1, zorder=2)
    _envelope(axis, bins, ms, _BLUE, "frame, and its range")
    _tell_beyond(axis, times, ms, common.top_ms)
    missed = trace["missed"] > 0
    if missed.any():
        axis.vlines(
            times[missed],
            0,
            0.06,
            transform=axis.get_xaxis_transform(),
            color=_RED,
            linewidth=0.8,
            label="missed",
            zorder=4,
        )
    axis.set_ylim(0, common.top_ms)
    if common.of_rates:
        _draw_rates(axis, trace, common.top_ms)


def _tell_beyond(axis: Axes, times: np.ndarray, ms: np.ndarray, top: float) -> None:
    beyond = ms > top
    if not beyond.any():
        return
    high = np.full(beyond.sum(), 0.97 * top)
    axis.plot(times[beyond], high, "^", color=_RED, markersize=4, label="beyond", zorder=5)
    axis.annotate(
        f"{beyond.sum()} beyond, up to {np.nanmax(ms):.0f} ms",
        (0.995, 0.9),
        xycoords="axes fraction",
        ha="right",
        va="top",
        fontsize=8,
        color=_RED,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.6},
        zorder=6,
    )


def _draw_rates(axis: Axes, trace: Trace, top: float) -> None:
    targets = trace["target_ms"][trace["target_ms"] > 0]
    kept = [float(np.median(targets))] if len(targets) else []
    for ms in (1e3 / hz for hz in _HZ):
        if ms < top and all(abs(ms - other) > _APART * top for other in kept):
            kept.append(ms)
    beside = axis.secondary_yaxis("right")
    beside.set_yticks(kept, [f"{1e3 / ms:.3g}" for ms in kept])
    beside.set_ylabel("Hz")
    beside.spines["right"].set_visible(False)


def _draw_stages(axis: Axes, trace: Trace, common: Common) -> None:
    bins = Bins(_seconds(trace), _BINS)
    known = {name: stage for name, stage in _STAGES.items() if np.isfinite(trace[name]).any()}
    if known:
        axis.stackplot(
            bins.times,
            [np.nan_to_num(bins.mean(trace[name])) for name in known],
            colors=[colour for _, colour in known.values()],
            labels=[label for label, _ in known.values()],
            alpha=0.75,
            linewidth=0,
        )
    lines = {"budget_ms": ("budget of compositing", "-", 0.9), "expected_ms": ("expected", ":", 0.7)}
    for name, (label, style, width) in lines.items():
        if np.isfinite(trace[name]).any():
            median = bins.median(trace[name])
            axis.plot(bins.times, median, style, color=_INK, linewidth=width, label=label)


def _draw_quality(axis: Axes, trace: Trace, common: Common) -> None:
    times, quality = _seconds(trace), trace["quality"]
    bins = Bins(times, _BINS)
    for limit in quality_limits(trace) or ():
        axis.axhline(limit, color=_PALE, linewidth=0.8, linestyle="--", label="limits", zorder=1)
    _envelope(axis, bins, np.where(trace["refined"], np.nan, quality), _BLUE, "quality")
    if trace["refined"].any():
        refined = bins.median(np.where(trace["refined"], quality, np.nan))
        axis.plot(bins.times, refined, ".", color=_GREEN, markersize=3, label="at rest, refined", zorder=4)
    if len(common.rungs) > 1:
        _draw_rungs(axis, times, trace["rung"], common.rungs)
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def _draw_rungs(axis: Axes, times: np.ndarray, rung: np.ndarray, rungs: Sequence[str]) -> None:
    """A strip along the lower edge, in the colour of the rung."""
    starts = np.flatnonzero(np.append(True, rung[1:] != rung[:-1]))
    ends = np.append(times[starts[1:]], times[-1])
    for number, name in enumerate(rungs):
        spans = [(times[s], end - times[s]) for s, end in zip(starts, ends, strict=True) if rung[s] == name]
        if spans:
            axis.broken_barh(
                spans,
                (0, 0.07),
                transform=axis.get_xaxis_transform(),
                color=_RUNGS[number % len(_RUNGS)],
                linewidth=0,
                label=f"rung {name}" if name else "no rung",
                zorder=3,
            )


def _draw_latency(axis: Axes, trace: Trace, common: Common) -> None:
    bins = Bins(_seconds(trace), _BINS)
    _envelope(axis, bins, trace["image_age_ms"], _ORANGE, "age of the eye image")
    _envelope(axis, bins, trace["latency_ms"], _BLUE, "latency of the head")


def _seconds(trace: Trace) -> np.ndarray:
    return trace["time_s"] - trace["time_s"][0]


def _envelope(axis: Axes, bins: Bins, values: np.ndarray, colour: str, label: str) -> None:
    """The median, and from the least to the most of each bin."""
    if np.isfinite(values).any():
        low, middle, high = bins.spread(values)
        axis.fill_between(bins.times, low, high, color=colour, alpha=0.3, linewidth=0.7, zorder=2)
        axis.plot(bins.times, middle, color=colour, linewidth=1, label=label, zorder=3)


PANELS = (
    Panel("time", "frame, ms", 2.0, (), True, _draw_time),
    Panel("stages", "stages, ms", 1.5, tuple(_STAGES), True, _draw_stages),
    Panel("quality", "quality", 1.3, ("quality",), False, _draw_quality),
    Panel("latency", "latency, ms", 1.3, ("latency_ms", "image_age_ms"), True, _draw_latency),
)
