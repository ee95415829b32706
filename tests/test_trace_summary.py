"""A trace's figures against ones worked out by hand, and bins that lose no spike."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tolerances import METRIC, TRACE_DECIMALS
from traces import LIMITS, session, write

import persp_sw as psw
from persp_sw.errors import TraceError
from persp_sw.measure.trace_bins import Bins
from persp_sw.measure.trace_summary import frame_ms, summary

TIMES_MS = (9.0, 11.0, 8.9, 11.1, 10.0, 10.0, 20.0, 10.0, 10.0, 10.0)
QUALITIES = (1.0, 1.0, 2.0, 2.0, 2.0, 0.25, 0.5, 0.5, 1.0, 2.0)
COMPOSITE_MS = (4.0, 4.0, 4.0, 4.0, 5.0, None, None, None, None, None)
MISSED = (0, 0, 0, 0, 0, 0, 0, 2, 0, 1)


def ten_frames() -> list[psw.FrameRecord]:
    """100 frames a second, a target of 10 ms; a change of rung before frame 5."""
    return [
        psw.FrameRecord(
            i,
            100 + i / 100,
            target_ms=10.0,
            budget_ms=5.0,
            quality=QUALITIES[i],
            rung="a" if i < 5 else "b",
            composite_ms=COMPOSITE_MS[i],
            planning_ms=1.0,
            frame_ms=TIMES_MS[i],
            missed=MISSED[i],
            latency_ms=10.0 * (i + 1) if i < 5 else None,
            rewarped=i in (2, 3, 4),
        )
        for i in range(10)
    ]


def figures_of(tmp_path: Path, records: list[psw.FrameRecord], header: dict | None = None) -> dict:
    return summary(psw.read_trace(write(tmp_path / "a.jsonl", records, header)))


def test_ten_frames_by_hand(tmp_path: Path):
    # Sorted: 8.9 9 10 10 10 10 10 11 11.1 20. Percentile p lies at 9·p: 4.5, 8.55, 8.91.
    expected = {
        "frames": 10,
        "seconds": 0.1,  # nine gaps of 10 ms and the last frame's own 10 ms
        "hz": 100,
        "target_ms": 10,
        # All windows of nine, shorter ones at the ends, have 10 ms in their middle: the spike is none's.
        **dict.fromkeys(("running_p50", "running_p95", "running_p99", "within_running"), 1.0),
        "frame_ms_p50": 10,
        "frame_ms_p95": 11.1 + 0.55 * 8.9,
        "frame_ms_p99": 11.1 + 0.91 * 8.9,
        "frame_ms_max": 20,
        "of_target_p50": 1,
        "of_target_p95": 1.11 + 0.55 * 0.89,
        "of_target_p99": 1.11 + 0.91 * 0.89,
        "within": 0.7,  # all but 8.9, 11.1 and 20: the edges 9 and 11 are within
        "within_free": 4 / 5,  # frames 0, 1, 6, 7, 8, of which 6 took 20 ms
        "within_budget": 4 / 5,  # 4 + 1 of 5 ms, but once 5 + 1
        "free": 0.5,
        "missed": 3,
        "missed_most": 2,
        "quality_least": 0.25,
        "quality_median": 1,
        "quality_most": 2,
        "quality_step": 2,  # on the same rung: that from 2 to 0.25 is a change of rung
        "quality_energy": 4 * math.log(2) ** 2 / 8,
        "rung_changes": 1,
        "latency_ms_p50": 30,
        "latency_ms_p95": 48,
        "latency_ms_p99": 49.6,
        "rewarped": 0.3,
        "refined": 0,
    }
    figures = figures_of(tmp_path, ten_frames(), LIMITS)
    assert figures == pytest.approx(expected, abs=METRIC, rel=METRIC)


def test_a_refined_picture_is_not_the_controllers_doing(tmp_path: Path):
    records = [replace(r, rung="a", quality=1.0, refined=False) for r in ten_frames()]
    records[4:7] = [replace(r, quality=q, refined=True) for r, q in zip(records[4:7], (4, 5, 5), strict=True)]
    figures = figures_of(tmp_path, records, LIMITS)
    assert figures["refined"] == 0.3
    assert figures["quality_most"] == 1
    assert figures["free"] == 1
    # 4 to 5 is a step of the refinement; 1 to 4 and 5 to 1 are its beginning and end.
    assert figures["quality_step"] == pytest.approx(1.25, abs=METRIC)
    assert figures["quality_energy"] == pytest.approx(math.log(1.25) ** 2 / 7, abs=METRIC)


def test_what_a_trace_does_not_tell_is_none(tmp_path: Path):
    figures = figures_of(tmp_path, [psw.FrameRecord(0, 5.0)])
    known = {name: value for name, value in figures.items() if value is not None}
    assert known == {
        "frames": 1,
        "seconds": 0.0,
        "missed": 0,
        "missed_most": 0,
        "rung_changes": 0,
        "rewarped": 0.0,
        "refined": 0.0,
    }


def test_a_frame_without_a_time_took_until_the_next(tmp_path: Path):
    times = (1.0, 1.01, 1.03, 1.06)
    records = [psw.FrameRecord(i, t, frame_ms=7.0 if i == 1 else None) for i, t in enumerate(times)]
    ms = frame_ms(psw.read_trace(write(tmp_path / "a.jsonl", records)))
    assert ms[:3] == pytest.approx([10, 7, 30], abs=TRACE_DECIMALS)
    assert np.isnan(ms[3])


def test_limits_that_are_none_tell_nothing(tmp_path: Path):
    for header in ({"min_quality": 0.25}, {"min_quality": "a", "max_quality": 2}, {}):
        assert figures_of(tmp_path, ten_frames(), header)["free"] is None


def test_a_trace_without_frames_has_no_figures(tmp_path: Path):
    with pytest.raises(TraceError, match=r"a\.jsonl has a header, but no frames"):
        figures_of(tmp_path, [])


# --- bins --------------------------------------------------------------------------------------------------


def test_bins_by_hand():
    times = np.array([0.0, 1.0, 2.0, 3.0, 7.0, 8.0, 10.0])
    values = np.array([5.0, 1.0, np.nan, 2.0, np.nan, np.nan, 9.0])
    bins = Bins(times, 5)  # 2 s each: [0 1] [2 3] [] [7] [8 10]
    assert bins.times.tolist() == [0.5, 2.5, 7.0, 9.0]
    low, middle, high = bins.spread(values)
    assert low[[0, 1, 3]].tolist() == [1.0, 2.0, 9.0]
    assert middle[[0, 1, 3]].tolist() == [3.0, 2.0, 9.0]
    assert high[[0, 1, 3]].tolist() == [5.0, 2.0, 9.0]
    assert bins.mean(values)[[0, 1, 3]].tolist() == [3.0, 2.0, 9.0]
    assert all(np.isnan(line[2]) for line in (low, middle, high, bins.mean(values)))


def test_few_frames_are_each_a_bin():
    times = np.array([3.0, 3.0, 5.0, 4.0])
    assert Bins(times, 4).times.tolist() == [3.0, 3.0, 4.0, 5.0]
    assert Bins(times, 4).median(np.arange(4.0)).tolist() == [0.0, 1.0, 3.0, 2.0]
    assert Bins(np.zeros(9), 4).spread(np.arange(9.0)) == ([0.0], [4.0], [8.0])  # no time passed


@pytest.mark.parametrize("seed", range(5))
def test_bins_are_those_of_a_loop(seed: int):
    random = np.random.default_rng(seed)
    times = np.cumsum(random.exponential(1, 997))
    values = np.where(random.random(997) < 0.2, np.nan, random.normal(size=997))
    bins = Bins(times, 50)
    edges = np.linspace(times[0], times[-1], 51)
    pieces = [values[(times >= a) & (times < b)] for a, b in pairwise(edges)]
    pieces[-1] = values[times >= edges[-2]]
    pieces = [piece[np.isfinite(piece)] for piece in pieces]
    low, middle, high = bins.spread(values)
    assert low.tolist() == [piece.min() for piece in pieces]
    assert high.tolist() == [piece.max() for piece in pieces]
    assert middle.tolist() == [np.median(piece) for piece in pieces]
    assert bins.mean(values) == pytest.approx([piece.mean() for piece in pieces], abs=METRIC)


def test_no_spike_is_lost():
    times, values = np.arange(5400) / 90, np.ones(5400)
    for frame in (0, 1234, 5399):
        spiked = values.copy()
        spiked[frame] = 80.0
        low, middle, high = Bins(times, 420).spread(spiked)
        assert (high == 80.0).sum() == 1
        assert (middle == 1.0).all()
        assert (low == 1.0).all()


def test_a_long_session_by_numpy(tmp_path: Path):
    records = session(900)
    figures = figures_of(tmp_path, records, LIMITS)
    ms = np.array([r.frame_ms for r in records])
    assert figures["frame_ms_p99"] == pytest.approx(np.percentile(ms, 99), abs=TRACE_DECIMALS)
    assert figures["missed"] == 4
    assert figures["rung_changes"] == 1
    assert figures["refined"] == pytest.approx(89 / 900, abs=METRIC)
    assert figures["hz"] == pytest.approx(
        900 / sum(max(r.frame_ms, 1e3 / 90) / 1e3 for r in records), rel=1e-3
    )


def test_a_step_of_the_load_stays_where_it_is_without_noise(tmp_path: Path):
    records = [
        psw.FrameRecord(i, i / 100, target_ms=10.0, frame_ms=10.0 if i < 10 else 20.0) for i in range(20)
    ]
    figures = figures_of(tmp_path, records)
    assert (figures["within_running"], figures["running_p50"]) == (0.5, 1.5)
    assert figures["running_p95"] == figures["running_p99"] == 2.0
