"""How steady a session was, in figures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..errors import TraceError
from .trace_reading import Trace

# A frame is in time within so much of its target.
WITHIN = 0.1
# Two qualities this near are the same: traces keep six decimals.
_SAME_QUALITY = 1e-4
_PERCENTILES = (50, 95, 99)
# Frames whose median is a load without its noise.
_RUNNING = 9


def summary(trace: Trace) -> dict[str, Any]:
    """The figures of a trace; None where it does not tell.

    Parameters
    ----------
    trace
        Its header's `min_quality` and `max_quality` tell which frames were free to be better and worse.

    Returns
    -------
    dict
        frames, seconds, hz
            Of the session, from the first frame's beginning to the last one's end.
        target_ms
            The median, if it changed.
        frame_ms_p50, _p95, _p99, _max; of_target_p50, _p95, _p99
            Times of whole frames, and these over their targets.
        running_p50, _p95, _p99; within_running
            The same of running medians of nine frames: what a rule makes of the load, without the noise of
            single frames, which it cannot know before.
        within, within_free
            Share of the frames within ±10 % of their target; the same of the free frames.
        within_budget
            Share of the compositings (with planning) within ±10 % of their budget.
        free
            Share of frames at neither limit of quality, refined ones left out.
        missed, missed_most
            Refreshes that had to show an old picture: in all, and in a row.
        quality_least, _median, _most
            Of the controller's quality, refined frames left out.
        quality_step
            Its largest change from frame to frame, as a factor ≥ 1; of frames on the same rung, both or none
            refined, as a change of rung keeps the cost and a refined picture takes its own steps.
        quality_energy
            Mean of (Δ ln quality)² of the same frames.
        rung_changes
            From frame to frame.
        latency_ms_p50, _p95, _p99
            From the tracker's stamp to the end of the swap.
        rewarped, refined
            Shares of frames.

    Raises
    ------
    TraceError
        A trace without a frame.
    """
    if not len(trace):
        raise TraceError(f"{trace.name} has a header, but no frames: the session ended before the first")
    ms = frame_ms(trace)
    target = trace["target_ms"]
    of_target = ms / np.where(target > 0, target, math.nan)
    running = _running_median(of_target)
    compositing = trace["composite_ms"] + np.nan_to_num(trace["planning_ms"])
    of_budget = compositing / np.where(trace["budget_ms"] > 0, trace["budget_ms"], math.nan)
    free = _free(trace)
    seconds = float(trace["time_s"][-1] - trace["time_s"][0] + np.nan_to_num(ms[-1]) / 1e3)
    quality = np.where(trace["refined"], math.nan, trace["quality"])
    return {
        "frames": len(trace),
        "seconds": seconds,
        "hz": len(trace) / seconds if seconds > 0 else None,
        "target_ms": _percentile(target, 50),
        **_percentiles("frame_ms", ms),
        "frame_ms_max": _percentile(ms, 100),
        **_percentiles("of_target", of_target),
        **_percentiles("running", running),
        "within_running": _share_within(running),
        "within": _share_within(of_target),
        "within_free": None if free is None else _share_within(of_target[free == 1]),
        "within_budget": _share_within(of_budget),
        "free": None if free is None else _mean(free),
        "missed": int(trace["missed"].sum()),
        "missed_most": int(trace["missed"].max()),
        "quality_least": _percentile(quality, 0),
        "quality_median": _percentile(quality, 50),
        "quality_most": _percentile(quality, 100),
        **_steps(trace),
        **_percentiles("latency_ms", trace["latency_ms"]),
        "rewarped": _mean(trace["rewarped"]),
        "refined": _mean(trace["refined"]),
    }


def frame_ms(trace: Trace) -> np.ndarray:
    """(n,) what each frame took; where it does not say, the time to the next one's beginning."""
    gaps = np.append(np.diff(trace["time_s"]) * 1e3, math.nan)
    return np.where(np.isnan(trace["frame_ms"]), gaps, trace["frame_ms"])


def _running_median(values: np.ndarray) -> np.ndarray:
    """(n,) of the nine values around each, at the ends of those there are; NaN values do not count."""
    padded = np.pad(values, _RUNNING // 2, constant_values=math.nan)
    around = np.lib.stride_tricks.sliding_window_view(padded, _RUNNING)
    known = ~np.isnan(around).all(1)
    median = np.full(len(values), math.nan)
    median[known] = np.nanmedian(around[known], axis=1)
    return median


def quality_limits(trace: Trace) -> tuple[float, float] | None:
    """The controller's limits as the header has them."""
    limits = [trace.header.get(name) for name in ("min_quality", "max_quality")]
    if not all(isinstance(limit, int | float) and limit > 0 for limit in limits):
        return None
    return float(limits[0]), float(limits[1])


def _free(trace: Trace) -> np.ndarray | None:
    """(n,) 1 at neither limit of quality, 0 at one, NaN where unknown or refined; None without limits."""
    limits = quality_limits(trace)
    if limits is None:
        return None
    quality = np.where(trace["refined"], math.nan, trace["quality"])
    inside = (quality > limits[0] * (1 + _SAME_QUALITY)) & (quality < limits[1] * (1 - _SAME_QUALITY))
    return np.where(np.isnan(quality), math.nan, inside)


def _steps(trace: Trace) -> dict[str, Any]:
    same_rung = trace["rung"][1:] == trace["rung"][:-1]
    alike = same_rung & (trace["refined"][1:] == trace["refined"][:-1])
    quality = np.where(trace["quality"] > 0, trace["quality"], math.nan)
    steps = np.diff(np.log(quality))[alike.astype(bool)]
    steps = steps[np.isfinite(steps)]
    return {
        "quality_step": float(np.exp(np.abs(steps).max())) if len(steps) else None,
        "quality_energy": float((steps**2).mean()) if len(steps) else None,
        "rung_changes": int((~same_rung.astype(bool)).sum()),
    }


def _share_within(ratios: np.ndarray) -> float | None:
    known = ratios[np.isfinite(ratios)]
    # 1.1 and 0.9 themselves count, which rounding must not deny them.
    return float((np.abs(known - 1) <= WITHIN + 1e-9).mean()) if len(known) else None


def _percentiles(name: str, values: np.ndarray) -> dict[str, float | None]:
    return {f"{name}_p{share}": _percentile(values, share) for share in _PERCENTILES}


def _percentile(values: np.ndarray, share: float) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.percentile(known, share)) if len(known) else None


def _mean(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None
