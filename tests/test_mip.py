"""Levels of detail: where voxels lie, what they are, and that the mean stays."""

import numpy as np
import pytest
import twins
from tolerances import LEVEL, LEVEL_ROUNDING_DEVIATIONS

from persp_sw import TransferFunction, Volume
from persp_sw.errors import VolumeError
from persp_sw.optics.classification import Classification
from persp_sw.volume.levels import BlockBounds, standard_rows
from persp_sw.volume.mip import Levels
from persp_sw.volume.runs import RunStore
from persp_sw.volume.visibility import EverythingVisible

SIZES = [(2, 2, 2), (3, 4, 5), (6, 7, 2), (8, 9, 10), (33, 18, 7), (1, 12, 5)]  # z, y, x
DTYPES = [np.uint8, np.int16, np.uint16, np.float32]


def noise(shape, dtype=np.float32, seed=0):
    rng = np.random.default_rng(seed)
    if np.dtype(dtype).kind == "f":
        return rng.normal(size=shape).astype(dtype)
    limits = np.iinfo(dtype)
    return rng.integers(limits.min, limits.max, shape, dtype, endpoint=True)


def box_weights(level):
    """For x, y, z: the weight of each voxel in the mean of the interpolant over the volume's box."""
    weights = []
    for n, far in zip(level.size, level.far_corner, strict=True):
        tents = np.array([_tent_integral(n, voxel, far) for voxel in range(n)])
        weights.append(tents / far if far else np.ones(1))
    return weights


def _tent_integral(n, voxel, far):
    knots = np.unique([*np.arange(np.ceil(far)), far])
    at = np.interp(knots, range(n), np.eye(n)[voxel])
    return ((at[1:] + at[:-1]) / 2 * np.diff(knots)).sum()


def box_mean(level, values=None):
    """Mean of the trilinear interpolant over the volume's box, of the voxels or of `values` at them."""
    x, y, z = box_weights(level)
    return np.einsum("z,y,x,zyx->", z, y, x, level.data.astype(float) if values is None else values)


# --- Where voxels lie -------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SIZES)
def test_coarse_voxels_lie_on_fine_ones_in_the_world_and_cover_the_box(size):
    pose = np.array([[0, 2, 0, 5], [-3, 0, 0.5, 6], [0, 0, 7, 7], [0, 0, 0, 1]], float)
    volume = Volume(noise(size), world_from_object=pose)
    levels = Levels(volume)
    cells = np.array(volume.size) - 1
    for number in range(len(levels)):
        level = levels.level(number)
        assert level.factor.dtype == np.int64
        np.testing.assert_array_equal(level.factor, levels.factor(number))
        np.testing.assert_array_equal(level.size, -(-cells // level.factor) + 1)
        np.testing.assert_array_equal(level.far_corner * level.factor, cells)
        index = np.array([2, 1, 3])
        ours = level.world_from_object @ [*index, 1]
        np.testing.assert_allclose(ours, pose @ [*(index * level.factor), 1], rtol=1e-15)
    assert max(levels.level(len(levels) - 1).size) <= 2


def test_all_axes_of_more_than_two_voxels_are_halved():
    levels = Levels(Volume(np.zeros((5, 2, 17), np.uint8), (1, 1, 20)))
    factors = [levels.factor(n).tolist() for n in range(len(levels))]
    assert factors == [[1, 1, 1], [2, 1, 2], [4, 1, 4], [8, 1, 4], [16, 1, 4]]


def test_cubic_levels_wait_for_the_widest_spacing():
    volume = Volume(np.zeros((9, 65, 129), np.uint8), (1, 1, 20))
    factors = [Levels(volume, cubic=True).factor(n).tolist() for n in range(7)]
    assert factors[:6] == [[1, 1, 1], [2, 2, 1], [4, 4, 1], [8, 8, 1], [16, 16, 1], [32, 32, 2]]
    spacing = np.array([1, 1, 20]) * factors[5]
    assert spacing.max() / spacing.min() < 1.5
    same = Volume(volume.data, (1, 1, 1))
    cubic, even = Levels(same, cubic=True), Levels(same)
    assert [cubic.factor(n).tolist() for n in range(8)] == [even.factor(n).tolist() for n in range(8)]


def test_an_axis_too_short_to_halve_does_not_hold_up_the_others():
    levels = Levels(Volume(np.zeros((40, 3, 3), np.uint8), (1, 1, 20)), cubic=True)
    factors = [levels.factor(n).tolist() for n in range(len(levels))]
    assert factors == [[1, 1, 1], [2, 2, 1], *([2, 2, f] for f in (2, 4, 8, 16, 32, 64))]


# --- What they are ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", range(3, 18))
def test_levels_equal_their_twin_along_one_axis_at_every_depth(n):
    levels = Levels(Volume(noise((1, 1, n), seed=n)))
    for number in range(1, len(levels)):
        finer, level = levels.level(number - 1), levels.level(number)
        weights = twins.halving(finer.size[0], finer.far_corner[0])
        assert (weights > -1e-12).all()  # a mean; nothing is extrapolated
        np.testing.assert_allclose(level.data[0, 0], weights @ finer.data[0, 0], atol=4 * LEVEL)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("size", SIZES)
def test_levels_equal_their_twin(size, dtype):
    levels = Levels(Volume(noise(size, dtype)))
    for number in range(1, len(levels)):
        finer, level = levels.level(number - 1), levels.level(number)
        halved = level.factor > finer.factor
        weights = [
            twins.halving(n, far) if half else np.eye(n)
            for n, far, half in zip(finer.size, finer.far_corner, halved, strict=True)
        ]
        expected = twins.coarsen(finer.data.astype(float), weights)
        assert level.data.dtype == dtype
        error = np.abs(level.data - expected).max()
        assert error <= (0.5 if np.dtype(dtype).kind != "f" else 0) + LEVEL * np.abs(expected).max()


def test_rounding_is_to_the_nearest():
    data = np.zeros((5, 5, 5), np.uint8)
    data[2, 2, 2] = 5  # an eighth of it: 0.625
    assert Levels(Volume(data)).level(1).data[1, 1, 1] == 1
    data[2, 2, 2] = 3
    assert Levels(Volume(data)).level(1).data[1, 1, 1] == 0


@pytest.mark.parametrize(("dtype", "value"), [(np.uint8, 255), (np.int16, -32768), (np.float32, -0.1)])
@pytest.mark.parametrize("size", SIZES)
def test_what_is_constant_stays_so(size, dtype, value):
    levels = Levels(Volume(np.full(size, value, dtype)))
    for number in range(len(levels)):
        data = levels.level(number).data
        np.testing.assert_allclose(data, dtype(value), rtol=LEVEL if dtype is np.float32 else 0)


@pytest.mark.parametrize("size", [(17, 20, 23), (16, 32, 33)])
def test_a_linear_ramp_stays_linear_inside(size):
    slopes = np.array([3, -2, 5])
    data = np.einsum("a,azyx->zyx", slopes[::-1], np.indices(size)).astype(np.float32)
    levels = Levels(Volume(data))
    for number in (1, 2):
        level = levels.level(number)
        at = np.einsum("a,azyx->zyx", (slopes * level.factor)[::-1], np.indices(level.data.shape))
        inside = (slice(1, -2),) * 3  # of the last two, one may lie beyond the box and one be cut by its end
        assert level.data[inside].size
        np.testing.assert_array_equal(level.data[inside], at[inside])


# --- Means ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cubic", [False, True])
@pytest.mark.parametrize("size", [*SIZES, (31, 16, 13)])
def test_the_mean_over_the_box_stays(size, cubic):
    volume = Volume(noise(size), (1, 1.7, 4))
    levels = Levels(volume, cubic=cubic)
    for number in range(1, len(levels)):
        assert abs(box_mean(levels.level(number)) - box_mean(levels.level(0))) < number * LEVEL


@pytest.mark.parametrize("dtype", [np.uint8, np.int16])
def test_rounding_does_not_shift_the_mean(dtype):
    levels = Levels(Volume(noise((34, 29, 40), dtype)))
    variance = 0.0
    for number in range(1, 4):
        level = levels.level(number)
        x, y, z = (np.sum(w**2) for w in box_weights(level))
        variance += x * y * z / 12
        shift = box_mean(level) - box_mean(levels.level(0))
        assert abs(shift) < LEVEL_ROUNDING_DEVIATIONS * np.sqrt(variance)


def test_the_mean_extinction_stays_where_it_is_linear_in_the_value():
    """Thin fog: τ = −ln(1 − α) is α·(1 + α/2 …), linear but for α, the largest opacity."""
    opacity = 1e-3
    transfer = TransferFunction([(0, (1, 1, 1), 0), (255, (1, 1, 1), opacity)], opacity_unit=1.0)
    data = np.clip(128 + 60 * noise((33, 30, 27)), 0, 255)
    levels = Levels(Volume(data))
    mean = box_mean(levels.level(0), transfer.extinction(levels.level(0).data))
    for number in range(1, len(levels)):
        level = levels.level(number)
        assert box_mean(level, transfer.extinction(level.data)) == pytest.approx(mean, rel=opacity)


# --- Holes ------------------------------------------------------------------------------------------------


def test_nan_is_left_out_of_means():
    data = noise((9, 10, 12))
    data[np.random.default_rng(1).random(data.shape) < 0.3] = np.nan
    data[:4, :4, :4] = np.nan
    levels = Levels(Volume(data))
    finer, level = levels.level(0), levels.level(1)
    weights = [twins.halving(n, far) for n, far in zip(finer.size, finer.far_corner, strict=True)]
    expected = twins.coarsen(data.astype(float), weights)
    np.testing.assert_array_equal(np.isnan(level.data), np.isnan(expected))
    assert np.isnan(level.data[0, 0, 0])
    np.testing.assert_allclose(level.data, expected, atol=10 * LEVEL)  # shares as small as a tenth


def test_a_single_hole_is_filled_and_what_is_around_it_does_not_change():
    data = np.full((9, 9, 9), 7, np.float32)
    data[4, 4, 4] = np.nan
    np.testing.assert_allclose(Levels(Volume(data)).level(1).data, 7, rtol=LEVEL)


# --- Use --------------------------------------------------------------------------------------------------


def test_a_level_is_a_volume_like_any_other():
    volume = Volume(noise((20, 23, 37), np.uint8))
    level = Levels(volume).level(1)
    transfer = TransferFunction([(120, (1, 1, 1), 0), (130, (1, 1, 1), 0.5)])
    store = RunStore(level, Classification.of(transfer, volume))
    for axis in range(3):
        decoded, stored = store.axis(axis, pairs=True).decode()
        np.testing.assert_array_equal(decoded[stored], standard_rows(level, axis)[stored])
        np.testing.assert_array_equal(
            BlockBounds(level).of(axis), twins.block_bounds(standard_rows(level, axis))
        )
    assert RunStore(level, EverythingVisible()).visible_box() is not None


def test_levels_are_made_once_when_asked_for():
    steps = []
    volume = Volume(noise((9, 9, 9), np.uint8))
    levels = Levels(volume, lambda *step: steps.append(step))
    assert levels.level(0).data is volume.data
    assert levels.bytes == 0
    assert not steps
    second = levels.level(2)
    assert steps == [(n, 1, f"level {number}") for number in (1, 2) for n in (0, 1)]
    assert levels.bytes == 5**3 + 3**3
    assert levels.level(2) is second
    assert len(steps) == 4


@pytest.mark.parametrize("number", [-1, 4])
def test_a_level_that_does_not_exist(number):
    with pytest.raises(VolumeError, match=f"levels 0 … 3; given {number}"):
        Levels(Volume(np.zeros((9, 5, 2), np.uint8))).level(number)
