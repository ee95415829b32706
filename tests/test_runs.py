"""The run-length store: decoding is exact, nothing that is needed is missing, nothing else is stored."""

import numpy as np
import pytest
import twins

from persp_sw import TransferFunction, Volume
from persp_sw.kernels.encode import BLOCK
from persp_sw.optics.classification import Classification
from persp_sw.volume.levels import BlockBounds, standard_rows
from persp_sw.volume.runs import PADDING, RunStore
from persp_sw.volume.visibility import EverythingVisible

SHAPES = [(2, 2, 2), (5, 6, 7), (9, 40, 3), (4, 5, 270), (3, 2, 258), (2, 3, 257)]
DTYPES = [np.uint8, np.int16, np.uint16, np.float32]


def sparse_volume(shape, dtype, seed=0, share=0.02):
    rng = np.random.default_rng(seed)
    data = np.zeros(shape, dtype)
    spots = rng.random(shape) < share
    data[spots] = rng.integers(50, 100, spots.sum())
    return Volume(data)


def bump(low=40.0, high=60.0):
    """Visible between the two values only."""
    return TransferFunction([(low, (1, 1, 1), 0), (high - 1, (1, 1, 1), 0.5), (high, (1, 1, 1), 0)])


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", SHAPES)
def test_block_bounds_equal_their_twin(shape, dtype):
    volume = sparse_volume(shape, dtype, share=0.3)
    for axis in range(3):
        low, high = BlockBounds(volume).of(axis)
        expected_low, expected_high = twins.block_bounds(standard_rows(volume, axis))
        np.testing.assert_array_equal(low, expected_low)
        np.testing.assert_array_equal(high, expected_high)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", SHAPES)
def test_brick_bounds_equal_their_twin(shape, dtype):
    volume = sparse_volume(shape, dtype, share=0.1)
    low, high = BlockBounds(volume).bricks()
    expected_low, expected_high = twins.brick_bounds(volume.data)
    np.testing.assert_array_equal(low, expected_low)
    np.testing.assert_array_equal(high, expected_high)


def test_nan_moves_no_bound():
    data = np.random.default_rng(3).normal(size=(9, 11, 14)).astype(np.float32)
    data[data > 0.5] = np.nan
    data[:6, :6, :6] = np.nan  # whole blocks and a whole brick, which keep low > high
    bounds = BlockBounds(Volume(data))
    for axis in range(3):
        expected = twins.block_bounds(standard_rows(bounds.volume, axis))
        np.testing.assert_array_equal(bounds.of(axis), expected)
        assert (bounds.of(axis)[0] > bounds.of(axis)[1]).any()
    np.testing.assert_array_equal(bounds.bricks(), twins.brick_bounds(data))
    assert bounds.bricks()[0][0, 0, 0] > bounds.bricks()[1][0, 0, 0]


@pytest.mark.parametrize("pairs", [False, True])
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("shape", SHAPES)
def test_exactly_the_needed_voxels_are_stored_bit_for_bit(shape, dtype, pairs):
    volume = sparse_volume(shape, dtype)
    classification = Classification.of(bump(), volume)
    store = RunStore(volume, classification)
    for axis in range(3):
        rows = standard_rows(volume, axis)
        runs = store.axis(axis, pairs=pairs)
        low, high = twins.block_bounds(rows)
        if pairs:
            low, high = np.minimum(low[:, :-1], low[:, 1:]), np.maximum(high[:, :-1], high[:, 1:])
        visible = twins.visible_blocks(
            low, high, classification.table, classification.origin, classification.scale
        )
        expected = twins.stored_voxels(visible, rows.shape, pairs)
        mask = runs.pairs if pairs else runs.visible
        np.testing.assert_array_equal(twins.bits(mask, visible.shape[-1]), visible)
        decoded, stored = runs.decode()
        np.testing.assert_array_equal(stored, expected)
        np.testing.assert_array_equal(decoded[stored], rows[stored])
        assert runs.voxel_count == expected.sum()
        # A run of blocks ends where the next block is not needed.
        blocks = twins.bits(runs.needed, visible.shape[-1])
        ends = blocks & ~np.pad(blocks, ((0, 0), (0, 0), (0, 1)))[..., 1:]
        assert runs.run_count == ends.sum()


@pytest.mark.parametrize("reach", [1, 2, 4])
@pytest.mark.parametrize("pairs", [False, True])
@pytest.mark.parametrize("shape", [*SHAPES, (3, 12, 700), (12, 2, 515)])
def test_neighbours_within_reach_are_stored_and_little_more(shape, pairs, reach, rng):
    """Along each axis alone, for a gradient has no others; along i by whole blocks."""
    volume = sparse_volume(shape, np.uint8, share=0.004)
    store = RunStore(volume, Classification.of(bump(), volume))
    for axis in range(3):
        plain = RunStore(volume, Classification.of(bump(), volume)).axis(axis, pairs=pairs)
        runs = store.axis(axis, pairs=pairs, reach=reach)
        np.testing.assert_array_equal(runs.visible, plain.visible)
        n_i, n_j, n_k = runs.size
        blocks = -(-(n_i - 1) // BLOCK)
        visible = twins.bits(runs.pairs if pairs else runs.visible, blocks)
        touched = twins.stored_voxels(visible, (n_j, n_k, n_i), pairs)
        least, most = touched.copy(), touched.copy()
        for step in range(-reach, reach + 1):
            for along, grown in ((0, least), (1, least), (2, least), (0, most), (1, most)):
                grown |= moved(touched, step, along)
        for block in zip(*np.nonzero(visible), strict=True):
            j, k, m = block
            begin, end = BLOCK * (m - 1), BLOCK * (m + 2) + 1
            most[j : j + 2, k : k + (2 if pairs else 1), max(begin, 0) : end] = True
        decoded, stored = runs.decode()
        assert (stored >= least).all() and (stored <= most).all()
        rows = standard_rows(volume, axis)
        np.testing.assert_array_equal(decoded[stored], rows[stored])
        assert runs.voxel_count == stored.sum()


def moved(flags, step, axis):
    """`flags` a few places on along an axis; what leaves is lost."""
    result = np.zeros_like(flags)
    n = flags.shape[axis]
    if abs(step) < n:
        to, of = [slice(None)] * 3, [slice(None)] * 3
        to[axis], of[axis] = slice(max(step, 0), n + min(step, 0)), slice(max(-step, 0), n - max(step, 0))
        result[tuple(to)] = flags[tuple(of)]
    return result


def test_reach_is_encoded_when_first_asked_for_and_kept():
    store = RunStore(sparse_volume((9, 12, 30), np.uint8), EverythingVisible())
    near = store.axis(0)
    far = store.axis(0, reach=2)
    assert (near.reach, far.reach) == (0, 2)
    assert store.axis(0, reach=1) is store.axis(0) is far
    pairs = store.axis(0, pairs=True)
    assert pairs.has_pairs


@pytest.mark.parametrize("word", [0, 1, 2])
def test_reach_crosses_from_word_to_word(word):
    """The first and the last block of a word have neighbours in others; the row's ends have none."""
    data = np.zeros((2, 2, 4 * 64 * 3 + 1), np.uint8)
    for spot in (4 * 64 * word + 1, 4 * 64 * (word + 1) - 2):
        data[:] = 0
        data[0, 0, spot] = 50
        volume = Volume(data)
        runs = RunStore(volume, Classification.of(bump(), volume)).axis(2, reach=1)
        block = spot // 4
        needed = np.flatnonzero(twins.bits(runs.needed, 192)[0, 0])
        np.testing.assert_array_equal(needed, [m for m in (block - 1, block, block + 1) if 0 <= m < 192])


def test_a_value_between_two_invisible_voxels_is_seen():
    """0 beside 200 passes through the visible 50 … 100: the block is kept though no voxel is visible."""
    data = np.zeros((4, 4, 8), np.uint8)
    data[:, :, 4:] = 200
    volume = Volume(data)
    store = RunStore(volume, Classification.of(bump(50, 100), volume))
    assert store.axis(2).voxel_count > 0
    assert store.axis(0).voxel_count == 0  # in slices across x the values are all alike …
    assert store.axis(0, pairs=True).voxel_count > 0  # … but not between slices


def test_nothing_visible_and_everything_visible():
    volume = sparse_volume((6, 7, 9), np.uint8)
    clear = RunStore(volume, Classification.of(TransferFunction([(0, (1, 1, 1), 0)]), volume))
    full = RunStore(volume, EverythingVisible())
    for axis in range(3):
        assert clear.axis(axis).voxel_count == 0
        decoded, stored = full.axis(axis).decode()
        assert stored.all()
        np.testing.assert_array_equal(decoded, standard_rows(volume, axis))
    assert clear.visible_box() is None
    np.testing.assert_array_equal(full.visible_box(), [[0, 0, 0], [8, 6, 5]])


@pytest.mark.parametrize("visibility", [EverythingVisible(), None])
@pytest.mark.parametrize("dtype", DTYPES)
def test_vectors_may_be_read_beyond_both_ends_of_the_stored_voxels(dtype, visibility):
    volume = Volume(np.full((3, 4, 5), 50, dtype))
    clear = Classification.of(TransferFunction([(0, (1, 1, 1), 0)]), volume)
    runs = RunStore(volume, visibility or clear).axis(0)
    assert runs.voxels.size == runs.voxel_count + 2 * PADDING
    assert runs.offsets.flat[0] == PADDING == 128
    assert not runs.voxels[:PADDING].any() and not runs.voxels[-PADDING:].any()
    assert runs.voxels[PADDING:-PADDING].all()


def test_nan_voxels_hide_nothing_else():
    data = np.zeros((4, 4, 9), np.float32)
    data[1, 1, 1], data[2, 2, 6] = np.nan, 50
    volume = Volume(data)
    store = RunStore(volume, Classification.of(bump(), volume))
    _, stored = store.axis(2).decode()
    assert stored[2, 2, 6]
    assert not stored[0, 0, :4].any()


def test_visible_box_holds_what_is_visible_and_little_more():
    data = np.zeros((20, 30, 40), np.uint8)
    data[7:9, 11:15, 21:30] = 50
    volume = Volume(data)
    low, high = RunStore(volume, Classification.of(bump(), volume)).visible_box()
    tight_low, tight_high = np.array([20, 10, 6]), np.array([30, 15, 9])
    slack = 3  # bricks are four cells long
    assert (tight_low - slack <= low).all() and (low <= tight_low).all()
    assert (tight_high <= high).all() and (high <= tight_high + slack).all()


def test_a_new_transfer_function_re_encodes_but_keeps_the_bounds():
    volume = sparse_volume((5, 6, 7), np.uint8, share=0.2)
    store = RunStore(volume, Classification.of(bump(), volume))
    few = store.axis(0).voxel_count
    low, _ = store.bounds.of(0)
    store.classify(EverythingVisible())
    assert store.axis(0).voxel_count == volume.data.size > few
    assert store.bounds.of(0)[0] is low


def test_axes_are_encoded_only_when_asked_for():
    store = RunStore(sparse_volume((5, 6, 7), np.uint8), EverythingVisible())
    assert store.bytes == 0
    store.axis(1)
    assert 0 < store.bytes < 2 * store.report(1).bytes
    assert store.axis(1) is store.axis(1)
    assert store.axis(1, pairs=True) is store.axis(1)  # what serves pairs serves slices


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 5, 6), (5, 1, 6), (5, 6, 1)])
def test_thin_volumes_encode_to_a_report(shape):
    volume = Volume(np.full(shape, 50, np.uint8))
    store = RunStore(volume, EverythingVisible())
    assert store.visible_box() is None
    for axis in range(3):
        assert store.report(axis).dense_bytes == volume.data.nbytes


def test_the_box_of_what_is_visible_needs_no_axis():
    store = RunStore(sparse_volume((9, 6, 7), np.uint8), EverythingVisible())
    store.visible_box()
    assert store.bytes == 0
    assert store.bounds_bytes == 2 * 2 * 2 * 2  # two bounds of 2 × 2 × 2 bricks


def test_report_counts_runs_and_bytes():
    data = np.zeros((8, 8, 64), np.uint8)
    data[3, 3, 10:12] = 50
    volume = Volume(data)
    report = RunStore(volume, Classification.of(bump(), volume)).report(2)
    # Blocks 2 (voxels 8 … 12) of the rows j = 2, 3, 4 in slice 3.
    assert (report.axis, report.runs, report.voxels, report.mean_length) == ("z", 3, 15, 5.0)
    assert report.voxels_bytes == 15
    assert report.bytes == report.voxels_bytes + report.index_bytes
    assert report.bounds_bytes == 2 * (7 * 8 * 16)  # two bounds of 16 blocks of 7 scanline pairs in 8 slices
    assert report.dense_bytes == 8 * 8 * 64


def test_encoding_reports_its_steps():
    steps = []
    volume = sparse_volume((5, 6, 7), np.uint8)
    store = RunStore(volume, EverythingVisible(), lambda *step: steps.append(step))
    store.axis(1)
    assert steps == [(n, 3, "encoding y") for n in range(4)]
    store.axis(1)
    assert len(steps) == 4
