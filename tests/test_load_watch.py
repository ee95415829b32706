"""What a series of residuals says: noise, steps, slow shifts; spikes and noise are none."""

import numpy as np
import pytest

from persp_sw.quality.load_watch import LoadWatch


def watch(residuals, watched=None):
    """Frames at which a shift was found, and the shifts."""
    watched = watched or LoadWatch()
    found = [(frame, watched.see(float(r), watched.noise)) for frame, r in enumerate(residuals)]
    return [(frame, shift) for frame, shift in found if shift is not None], watched


@pytest.mark.parametrize("deviation", [0.05, 0.1, 0.3])
def test_noise_is_measured_whatever_spikes_there_are(deviation, rng):
    residuals = deviation * rng.normal(size=500)
    residuals[::25] += 2
    _, watched = watch(residuals)
    # A median of 45 differences has a deviation of about 0.17 of it, and a tenth is added on purpose.
    assert 0.6 * deviation < watched.noise < 1.7 * deviation


@pytest.mark.parametrize("size", [0.7, -0.7])
def test_a_step_is_found_in_its_second_frame(size, rng):
    residuals = 0.05 * rng.normal(size=120)
    residuals[100:] += size
    found, _ = watch(residuals[:102])
    ((frame, shift),) = found
    assert frame == 101
    assert shift.size == pytest.approx(size, abs=0.15)
    assert shift.frames == 2


def test_a_shift_of_a_deviation_is_found_within_thirty_frames(rng):
    delays = []
    for _ in range(20):
        residuals = 0.1 * rng.normal(size=200)
        residuals[100:] += 0.1
        found, _ = watch(residuals)
        delays.append(min((frame - 100 for frame, _ in found if frame >= 100), default=100))
    assert np.median(delays) <= 30


@pytest.mark.parametrize("size", [0.5, 3.0])
def test_one_spike_is_no_shift(size, rng):
    residuals = 0.05 * rng.normal(size=200)
    residuals[100] += size
    assert watch(residuals)[0] == []


def test_alarms_at_noise_alone_are_rare_and_ever_rarer():
    counts = np.zeros(2, int)
    for seed in range(10):
        found, _ = watch(0.3 * np.random.default_rng(seed).normal(size=4000))
        frames = np.array([frame for frame, _ in found])
        counts += [np.sum(frames < 1000), np.sum(frames >= 1000)]
    assert counts[0] <= 10
    assert counts[1] <= counts[0] + 3  # of three times as many frames


def test_frequent_spikes_do_not_become_a_step(rng):
    residuals = 0.05 * rng.normal(size=4000)
    residuals[rng.random(4000) < 0.05] += 0.8
    found, _ = watch(residuals)
    assert sum(frame > 500 for frame, _ in found) <= 3
