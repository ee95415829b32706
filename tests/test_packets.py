"""Packets of 16 pixels: the vector and the portable functions against a plain float64 twin and each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from tolerances import PACKET_BLEND, PACKET_SAMPLE

from persp_sw._jit import VECTORS, kernel
from persp_sw.kernels import packet_portable, packet_vector
from persp_sw.kernels.state import (
    ALPHA,
    BLUE,
    ENOUGH,
    LENGTH,
    RAY_FAR,
    RAY_NEAR,
    RED,
    SECOND,
    SECTIONS,
    TILE,
    VALUE,
)

DTYPES = [np.uint8, np.int16, np.uint16, np.float32]
NEEDS_VECTORS = pytest.mark.skipif(not VECTORS, reason="this processor, or PERSP_SW_KERNELS, has no AVX-512")
KINDS = ["portable", pytest.param("vector", marks=NEEDS_VECTORS)]
AT = 2 * TILE * SECTIONS  # the packet under test is the third of a row of tiles
UNTOUCHED = np.float32(-7.5)

_vector_sample, _vector_blend = packet_vector.sample, packet_vector.blend
_portable_sample, _portable_blend = packet_portable.sample, packet_portable.blend


@kernel
def vector_sample(
    n, width, voxels, starts, weights, x, step, low, high, last_cell, begin, end, scratch, cells, lanes, at
):
    _vector_sample(
        n, width, voxels, starts[0], starts[1], starts[2], starts[3], weights[0], weights[1], x, step, low,
        high, last_cell, begin, end, scratch, cells, lanes, at,
    )  # fmt: skip


@kernel
def portable_sample(
    n, width, voxels, starts, weights, x, step, low, high, last_cell, begin, end, scratch, cells, lanes, at
):
    _portable_sample(
        n, width, voxels, starts[0], starts[1], starts[2], starts[3], weights[0], weights[1], x, step, low,
        high, last_cell, begin, end, scratch, cells, lanes, at,
    )  # fmt: skip


@kernel
def vector_blend(n, table, origin, scale, slots, scratch, cells, lanes, at):
    return _vector_blend(n, table, origin, scale, slots, scratch, cells, lanes, at)


@kernel
def portable_blend(n, table, origin, scale, slots, scratch, cells, lanes, at):
    return _portable_blend(n, table, origin, scale, slots, scratch, cells, lanes, at)


SAMPLE = {"vector": vector_sample, "portable": portable_sample}
BLEND = {"vector": vector_blend, "portable": portable_blend}


def room():
    return np.empty(packet_portable.SCRATCH, np.float32), np.empty(TILE, np.int32)


# --- Samples ----------------------------------------------------------------------------------------------


class Window(NamedTuple):
    """A packet on four rows; places along i count from anywhere, rows are stored from `begin` on."""

    voxels: np.ndarray
    starts: np.ndarray
    weights: np.ndarray  # along j and k
    x: float
    step: float
    low: float
    high: float
    begin: int
    end: int

    @property
    def last_cell(self):
        return np.ceil(self.high) - 1

    def taken(self, kind):
        """What a kernel makes of it; nothing but its 16 results may be written."""
        lanes = np.full(AT + 2 * TILE * SECTIONS, UNTOUCHED)
        scalars = (self.x, self.step, self.low, self.high, self.last_cell, self.begin, self.end)
        at = AT + int(SECOND)
        SAMPLE[kind](
            TILE, self.end - self.begin + 1, self.voxels, self.starts, self.weights,
            *np.array(scalars, np.float32), *room(), lanes, at,
        )  # fmt: skip
        result = lanes[at : at + TILE].copy()
        lanes[at : at + TILE] = UNTOUCHED
        assert (lanes == UNTOUCHED).all()
        return result

    def expected(self):
        count = self.end - self.begin + 1
        rows = np.array([self.voxels[s : s + count] for s in self.starts], np.float64)
        j, k = self.weights.astype(np.float64)
        line = rows[0] + j * (rows[1] - rows[0])
        if k != 0:
            line = line + k * (rows[2] + j * (rows[3] - rows[2]) - line)
        place = np.clip(self.x + self.step * np.arange(TILE), self.low, self.high)
        cell = np.minimum(np.floor(place), self.last_cell).astype(int)
        result = np.full(TILE, np.nan)
        for lane in np.nonzero((cell >= self.begin) & (cell < self.end))[0]:
            left, right = line[cell[lane] - self.begin :][:2]
            result[lane] = left + (place[lane] - cell[lane]) * (right - left)
        return result


def values(rng, dtype, count):
    if dtype == np.float32:
        data = rng.normal(size=count).astype(np.float32)
        data[rng.random(count) < 0.05] = np.nan
        return data
    limits = np.iinfo(dtype)
    return rng.integers(limits.min, limits.max, count, dtype, endpoint=True)


def windows(rng, dtype, widest, between, count=60):
    """Random ones. All places are multiples of 1/64, so float32 and float64 find the same cells."""
    narrowest = 2 if widest == 32 else 33
    voxels = values(rng, dtype, 600)
    for _ in range(count):
        width = int(rng.integers(narrowest, widest + 1))
        begin = int(rng.integers(0, 5))
        end = begin + width - 1
        low = begin - 6 + rng.integers(0, 8 * 64) / 64
        high = max(end + 3 - rng.integers(0, 5 * 64) / 64, low + 0.25)
        step = rng.integers(1, 64 * (width + 6) // (TILE - 1)) / 64
        if rng.random() < 0.3:
            step = max(np.floor(step), 1.0)
        x = begin - 8 + rng.integers(0, 10 * 64) / 64
        if rng.random() < 0.3:
            x = np.floor(x)  # with a whole step: every lane on a border of cells
        starts = rng.integers(0, 600 - 2 * packet_portable.SCRATCH, 4)
        weights = np.array([rng.random(), rng.random() if between else 0], np.float32)
        yield Window(voxels, starts, weights, x, step, low, high, begin, end)


def assert_same(value, expected, dtype):
    largest = 4.0 if dtype == np.float32 else float(np.iinfo(dtype).max)
    np.testing.assert_array_equal(np.isnan(value), np.isnan(expected))
    np.testing.assert_allclose(value, expected, rtol=0, atol=PACKET_SAMPLE * largest)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("between", [False, True])
@pytest.mark.parametrize("widest", [32, 64])
@pytest.mark.parametrize("dtype", DTYPES)
def test_samples_equal_the_twin(kind, dtype, widest, between, rng):
    inside = outside = 0
    for window in windows(rng, dtype, widest, between):
        expected = window.expected()
        assert_same(window.taken(kind), expected, dtype)
        inside += np.isfinite(expected).sum()
        outside += np.isnan(expected).sum()
    assert min(inside, outside) > 100


@NEEDS_VECTORS
@pytest.mark.parametrize("between", [False, True])
@pytest.mark.parametrize("widest", [32, 64])
@pytest.mark.parametrize("dtype", DTYPES)
def test_both_kinds_sample_alike(dtype, widest, between, rng):
    for window in windows(rng, dtype, widest, between):
        assert_same(window.taken("vector"), window.taken("portable"), dtype)


def ramp(**changes):
    """Row n holds 10·n, 10·n + 1000 in scanline j + 1; the box is cells 0 … 19, all of it stored."""
    voxels = np.concatenate([10 * np.arange(200), 10 * np.arange(200) + 1000]).astype(np.float32)
    whole = Window(voxels, np.array([0, 200, 0, 200]), np.zeros(2, np.float32), 0.0, 1.0, 0.0, 20.0, 0, 20)
    return whole._replace(**changes)


@pytest.mark.parametrize("kind", KINDS)
def test_places_beyond_the_box_are_at_its_border(kind):
    taken = ramp(x=-4.0, step=2.0, low=0.5, high=19.25).taken(kind)
    np.testing.assert_array_equal(taken, 10 * np.clip(2.0 * np.arange(TILE) - 4, 0.5, 19.25))
    # The box's end belongs to its last cell, also where it is on a voxel.
    np.testing.assert_array_equal(ramp(x=19.5, step=0.25).taken(kind)[2:], np.full(TILE - 2, 200.0))


@pytest.mark.parametrize("kind", KINDS)
def test_a_border_of_cells_belongs_to_the_cell_behind_it(kind):
    """Whole places: those of `begin` are in the run, those of `end` are not, though both are stored."""
    taken = ramp(begin=3, end=9).taken(kind)
    shown = np.arange(TILE)
    shown = (shown >= 3) & (shown < 9)
    np.testing.assert_array_equal(taken[shown], 10 * np.arange(3, 9) - 30)  # rows begin at `begin`
    assert np.isnan(taken[~shown]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_on_a_slice_the_next_one_is_not_read(kind):
    window = ramp()
    voxels = np.append(window.voxels, np.full(200, np.nan, np.float32))
    taken = window._replace(voxels=voxels, starts=np.array([0, 200, 400, 400])).taken(kind)
    np.testing.assert_array_equal(taken, 10.0 * np.arange(TILE))


# --- Blending ---------------------------------------------------------------------------------------------


class Packet(NamedTuple):
    """Sections [SECTIONS, TILE] of a tile, what its samples stand for, and a transfer function."""

    sections: np.ndarray
    slots: np.ndarray
    table: np.ndarray
    origin: float
    scale: float

    def blended(self, kind):
        """Sections afterwards, and whether all is opaque; no other tile may be written."""
        lanes = np.full(AT + 2 * TILE * SECTIONS, UNTOUCHED)
        mine = slice(AT, AT + TILE * SECTIONS)
        lanes[mine] = self.sections.ravel()
        done = BLEND[kind](
            TILE, self.table, np.float32(self.origin), np.float32(self.scale), self.slots, *room(), lanes, AT
        )
        result = lanes[mine].reshape(SECTIONS, TILE).copy()
        lanes[mine] = UNTOUCHED
        assert (lanes == UNTOUCHED).all()
        return result, done

    def expected(self):
        state = self.sections.astype(np.float64)
        last = len(self.table) - 1
        for slot, section in zip(self.slots.astype(np.float64), (VALUE, SECOND), strict=True):
            near, far, share, slope = slot
            value = row(state, section)
            number = np.nan_to_num(value)
            entry = np.clip(np.floor((number - self.origin) * self.scale + 1.5), 1, last).astype(int)
            entry[np.isnan(value)] = 0
            *colour, extinction = self.table[entry].astype(np.float64).T
            begin, end = np.maximum(row(state, RAY_NEAR), near), np.minimum(row(state, RAY_FAR), far)
            length = row(state, LENGTH) * np.maximum(end - begin, 0)
            alpha = -np.expm1(-extinction * length * (share + slope * (begin + end) / 2))
            covered = (1 - row(state, ALPHA)) * alpha
            for channel, part in zip((RED, BLUE - TILE, BLUE), colour, strict=True):
                row(state, channel)[:] += covered * part
            row(state, ALPHA)[:] += covered
        return state, (row(state, ALPHA) >= row(state, ENOUGH)).all()


def row(sections, at):
    return sections[int(at) // TILE]


def packet(rng, extinction, values_=None):
    """A random one; entries are told apart by quarters, so that float32 and float64 find the same."""
    table = np.zeros((41, 4), np.float32)
    table[1:, :3] = rng.random((40, 3))
    table[1:, 3] = extinction * rng.random(40)
    sections = rng.random((SECTIONS, TILE)).astype(np.float32)
    near = rng.integers(0, 64, TILE) / 64
    row(sections, RAY_NEAR)[:] = near
    row(sections, RAY_FAR)[:] = near + rng.integers(0, 128, TILE) / 64
    row(sections, LENGTH)[:] += 1
    for section in (VALUE, SECOND):
        drawn = rng.integers(-4, 50, TILE) / 4 + 0.0625
        drawn[rng.random(TILE) < 0.2] = np.nan
        row(sections, section)[:] = drawn if values_ is None else values_
    row(sections, ENOUGH)[:] = 0.99
    slots = np.array([[0.25, 0.75, 0.2, 0.3], [0.75, 1.5, 0.7, -0.1]], np.float32)
    return Packet(sections, slots, table, 1.0, 4.0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("extinction", [1e-6, 1e-2, 1.0, 30.0, 1e6])
def test_two_samples_are_blended_as_in_the_twin(kind, extinction, rng):
    for _ in range(40):
        drawn = packet(rng, extinction)
        expected, all_opaque = drawn.expected()
        taken, done = drawn.blended(kind)
        np.testing.assert_allclose(taken[:4], expected[:4], rtol=0, atol=PACKET_BLEND)
        np.testing.assert_array_equal(taken[4:], drawn.sections[4:])
        assert done == all_opaque


@NEEDS_VECTORS
@pytest.mark.parametrize("extinction", [1e-6, 1.0, 1e6])
def test_both_kinds_blend_alike(extinction, rng):
    for _ in range(40):
        drawn = packet(rng, extinction)
        (vector, done), (portable, portable_done) = (drawn.blended(kind) for kind in ("vector", "portable"))
        np.testing.assert_allclose(vector, portable, rtol=0, atol=PACKET_BLEND)
        assert done == portable_done


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("extinction", [1e-30, 1e-12, 1e-6])
def test_the_faintest_media_keep_their_relative_accuracy(kind, extinction, rng):
    drawn = packet(rng, extinction, 3.0)
    drawn.sections[:4] = 0
    expected, _ = drawn.expected()
    taken, _ = drawn.blended(kind)
    assert (row(expected, ALPHA) > 0).sum() > TILE / 2
    np.testing.assert_allclose(taken[:4], expected[:4], rtol=PACKET_BLEND)


@pytest.mark.parametrize("kind", KINDS)
def test_nan_and_rays_that_are_elsewhere_change_no_bit(kind, rng):
    drawn = packet(rng, 1e6, np.nan)
    np.testing.assert_array_equal(drawn.blended(kind)[0][:4], drawn.sections[:4])
    drawn = packet(rng, 1e6, 3.0)
    row(drawn.sections, RAY_NEAR)[:8], row(drawn.sections, RAY_FAR)[:8] = 2.0, 3.0  # behind both samples
    row(drawn.sections, RAY_NEAR)[8:], row(drawn.sections, RAY_FAR)[8:] = 0.5, 0.5  # empty
    np.testing.assert_array_equal(drawn.blended(kind)[0][:4], drawn.sections[:4])


@pytest.mark.parametrize("kind", KINDS)
def test_one_lane_that_lets_light_through_keeps_the_packet_going(kind, rng):
    drawn = packet(rng, 1.0, np.nan)
    row(drawn.sections, ALPHA)[:] = 0.995
    assert drawn.blended(kind)[1]
    for lane in range(TILE):
        row(drawn.sections, ALPHA)[lane] = 0.9
        assert not drawn.blended(kind)[1]
        row(drawn.sections, ENOUGH)[lane] = -1  # a ray that shows nothing
        assert drawn.blended(kind)[1]
        row(drawn.sections, ALPHA)[lane], row(drawn.sections, ENOUGH)[lane] = 0.995, 0.99
