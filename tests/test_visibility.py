"""Visible intervals: nothing that a look-up may fetch is left out, and little else is taken in."""

import numpy as np
import pytest
import twins

from persp_sw import TransferFunction, Volume
from persp_sw.optics.classification import Classification
from persp_sw.volume.lift import lift_exponent
from persp_sw.volume.visibility import EverythingVisible, visible_intervals


def volume_of(dtype, low=0, high=255):
    return Volume(np.array([[[low, high]]]).astype(dtype))


def comb(teeth, start=10.0, gap=10.0):
    """Visible in narrow teeth only."""
    points = [(start - 1, (1, 1, 1), 0)]
    for n in range(teeth):
        at = start + n * gap
        points += [(at - 0.4, (1, 1, 1), 0), (at, (1, 1, 1), 0.5), (at + 0.4, (1, 1, 1), 0)]
    return TransferFunction(points)


def is_visible(intervals, low, high):
    first, last = intervals
    return ((low[..., None] <= last) & (high[..., None] >= first)).any(-1)


def all_pairs(values):
    """All low ≤ high of the values."""
    low, high = np.meshgrid(values, values)
    return low[low <= high], high[low <= high]


@pytest.mark.parametrize("teeth", [1, 3, 8])
@pytest.mark.parametrize(
    ("dtype", "low", "high"),
    [(np.uint8, 0, 255), (np.int16, -1000, 3000), (np.uint16, 0, 65535), (np.float32, -3.5, 300)],
)
def test_intervals_say_what_the_table_says(dtype, low, high, teeth):
    volume = volume_of(dtype, low, high)
    classification = Classification.of(comb(teeth), volume)
    values = np.linspace(-3, 120, 124).astype(dtype) if dtype != np.uint8 else np.arange(256, dtype=dtype)
    pairs = all_pairs(np.unique(np.clip(values, low, high)))
    intervals = visible_intervals(classification, volume)
    assert [bound.dtype for bound in intervals] == [dtype, dtype]
    assert intervals[0].size == teeth
    expected = twins.visible_blocks(
        *(bound.astype(float) for bound in pairs),
        classification.table,
        classification.origin,
        classification.scale,
        largest=max(abs(low), abs(high)),
    )
    np.testing.assert_array_equal(is_visible(intervals, *pairs), expected)


def test_what_is_seen_between_two_integers_counts():
    volume = volume_of(np.uint8)
    classification = Classification.of(comb(1, start=50.5), volume)
    low, high = np.array([49, 50, 51, 50, 0]), np.array([50, 51, 52, 50, 255])
    seen = is_visible(visible_intervals(classification, volume), low, high)
    np.testing.assert_array_equal(seen, [False, True, False, False, True])


def test_a_hundredth_of_an_entry_is_allowed_for_rounding_and_a_tenth_is_not():
    volume = volume_of(np.float32)
    classification = Classification.of(comb(1, start=50), volume)
    entries = np.flatnonzero(classification.table[:, 3])
    scale = classification.scale
    # Where look-ups begin to round to the first seen entry, and end to round to the last.
    begin = classification.origin + (entries[0] - 1.5) / scale
    end = classification.origin + (entries[-1] - 0.5) / scale
    intervals = visible_intervals(classification, volume)
    rounding = 0.01 / scale + 1e-6 * 255
    for outside, seen in ((0.9 * rounding, True), (1.1 * rounding + 0.09 / scale, False)):
        below, above = np.array([begin - outside]), np.array([end + outside])
        assert is_visible(intervals, below, below) == seen
        assert is_visible(intervals, above, above) == seen


def test_beyond_eight_intervals_the_narrowest_gaps_are_closed():
    volume = volume_of(np.uint8)
    narrow = [(at, (1, 1, 1), 0.5 * (n % 2)) for n, at in enumerate(range(20, 40))]  # teeth at 21, 23 … 39
    wide = [(at + d, (1, 1, 1), 0.5 * (d == 1)) for at in range(60, 200, 20) for d in (0, 1, 2)]
    classification = Classification.of(TransferFunction([*narrow, (40, (1, 1, 1), 0), *wide]), volume)
    first, last = visible_intervals(classification, volume)
    np.testing.assert_array_equal(first, [21, *range(61, 200, 20)])
    np.testing.assert_array_equal(last, [39, *range(61, 200, 20)])


def test_nothing_and_everything():
    for dtype in (np.uint8, np.float32):
        volume = volume_of(dtype)
        clear = Classification.of(TransferFunction([(0, (1, 1, 1), 0)]), volume)
        assert visible_intervals(clear, volume)[0].size == 0
        values = np.array([0.0, 255.0])
        assert is_visible(visible_intervals(EverythingVisible(), volume), values, values).all()
    nothing_but_nan = np.array([np.inf]), np.array([-np.inf])
    assert not is_visible(visible_intervals(EverythingVisible(), volume), *nothing_but_nan).any()


def test_a_stray_value_does_not_make_all_visible():
    """Beside 1e30, float32 interpolation is off by more than the whole table; elsewhere it is not."""
    volume = volume_of(np.float32, 0, 1e30)
    intervals = visible_intervals(Classification.of(comb(1, start=50), volume), volume)
    low = np.ldexp([0, 0, 45, 60, 60, 1e30], lift_exponent(volume))
    high = np.ldexp([10, 50, 55, 70, 1e30, 1e30], lift_exponent(volume))
    np.testing.assert_array_equal(is_visible(intervals, low, high), [False, True, True, False, True, True])
