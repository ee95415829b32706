"""Foreign time stamps on our clock: offsets, delays, drift, clocks that are set."""

from __future__ import annotations

import numpy as np
import pytest

from vr_plugin.trackers.clock import ClockMap

FAR = 1.7e9  # seconds of the day's clock; ours begins elsewhere


def test_a_constant_delay_is_no_error_of_the_steps():
    clock = ClockMap()
    mapped = [clock.ours(FAR + i / 128, 50 + i / 128) for i in range(1000)]
    np.testing.assert_array_equal(mapped, [50 + i / 128 for i in range(1000)])


def test_jitter_is_filtered_out(rng):
    clock = ClockMap()
    times = np.arange(2000) / 100
    delays = 0.002 + rng.exponential(0.01, len(times))
    delays[::50] = 0.002
    mapped = np.array([clock.ours(FAR + t, t + d) for t, d in zip(times, delays, strict=True)])
    # From the first of the fastest messages on, all stamps are late by its delay, not by their own.
    np.testing.assert_allclose(mapped, times + 0.002, atol=1e-6)
    assert delays.std() > 0.008


def test_drift_is_followed():
    clock, drift = ClockMap(window=10.0), 1e-4
    late = [clock.ours(FAR + t * (1 - drift), t) - t for t in np.arange(0, 300, 0.01)]
    # Old offsets are forgotten within two windows; the foreign clock loses 1e-4 · 20 s in that time
    # (and a step or two of the loop).
    assert -2 * 10.02 * drift <= min(late)
    assert max(late) <= 0


def test_no_stamp_comes_after_its_arrival(rng):
    clock = ClockMap()
    for t in np.arange(0, 60, 0.02):
        arrival = float(t + rng.exponential(0.02))
        stamp = float(
            rng.choice([FAR + t, FAR + t, FAR + t + rng.normal(0, 3), np.nan, np.inf, 1e300, -1e300])
        )
        assert clock.ours(stamp, arrival) <= arrival


def test_a_clock_that_is_set_begins_anew_after_five():
    clock = ClockMap()
    for i in range(100):
        clock.ours(86390 + i / 100, i / 100 + 0.01)
    # Midnight: the foreign second of the day starts again.
    mapped = [clock.ours(i / 100, 1 + i / 100 + 0.01 + (i == 0) * 0.005) for i in range(20)]
    arrivals = [1 + i / 100 + 0.01 + (i == 0) * 0.005 for i in range(20)]
    assert mapped[:4] == arrivals[:4]
    np.testing.assert_allclose(mapped[5:], arrivals[5:], atol=1e-9)
    assert clock.jumps == 1
    assert clock.offset == pytest.approx(1.01)


def test_a_single_strange_stamp_changes_nothing():
    clock = ClockMap()
    clock.ours(FAR, 10.0)
    assert clock.ours(FAR + 5000, 10.5) == 10.5
    assert clock.ours(FAR + 1.0, 11.2) == 11.0
    assert clock.jumps == 0


def test_a_network_that_stalls_is_no_clock_that_is_set():
    clock = ClockMap()
    for i in range(100):
        clock.ours(FAR + i / 100, i / 100)
    # 3 s of messages arrive at once, 0 … 3 s late.
    mapped = [clock.ours(FAR + 1 + i / 100, 4.0) for i in range(300)]
    np.testing.assert_allclose(mapped, 1 + np.arange(300) / 100, atol=1e-6)
    assert clock.jumps == 0


def test_a_clock_set_back_a_little_is_found_out_too():
    clock = ClockMap()
    for i in range(100):
        clock.ours(FAR + i / 128, i / 128)
    late = [i / 128 - clock.ours(FAR - 3 + i / 128, i / 128) for i in range(100, 120)]
    np.testing.assert_allclose(late, [3] * 4 + [0] * 16, atol=1e-6)
