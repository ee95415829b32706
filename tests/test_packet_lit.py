"""Gradients and light of a packet: the vector and the portable functions against twins and each other."""

from __future__ import annotations

from typing import NamedTuple

import lit_twins
import numpy as np
import pytest
from test_packets import KINDS
from tolerances import PACKET_LIGHT, PACKET_SLOPES

from persp_sw import Light, Lighting, Look, Modulation, Volume
from persp_sw._jit import kernel
from persp_sw.kernels import packet_lit_portable, packet_lit_vector, phong
from persp_sw.kernels.packet import SCRATCH
from persp_sw.kernels.scanline import Level
from persp_sw.kernels.state import (
    ALPHA,
    ENOUGH,
    LEFT,
    LENGTH,
    LIGHT_OF_SECOND,
    LIGHT_SECTIONS,
    LIT_RED,
    NEIGHBOURS,
    SECOND,
    SECTIONS,
    SHINE_RED,
    SKIPPED,
    THICKER,
    TILE,
    VALUE,
)
from persp_sw.kernels.tables import LitTable
from persp_sw.optics.classification2d import classify
from persp_sw.optics.shading import shade_of
from persp_sw.optics.transfer2d import Box, TransferFunction2D
from persp_sw.volume.gradient import FAINTEST, largest_magnitude, world_from_differences
from persp_sw.volume.runs import RunStore
from persp_sw.volume.visibility import EverythingVisible

LIGHT = np.uint64(3 * TILE * SECTIONS)  # behind three tiles
AT = np.uint64(TILE * SECTIONS)  # the packet under test is the second of them
UNTOUCHED = np.float32(-7.5)

_vector_slopes, _portable_slopes = packet_lit_vector.find_slopes, packet_lit_portable.find_slopes
_vector_shade, _portable_shade = packet_lit_vector.shade, phong.shade
_vector_add, _portable_add = packet_lit_vector.add_light, phong.add_light
_vector_shows, _portable_shows = packet_lit_vector.shows_classified, packet_lit_portable.shows_classified


@kernel
def vector_slopes(n, start, cells_of, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes):
    begin, first, last = cells_of
    _vector_slopes(
        n, start, begin, first, last, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes,
        LIGHT + NEIGHBOURS,
    )  # fmt: skip


@kernel
def portable_slopes(n, start, cells_of, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes):
    begin, first, last = cells_of
    _portable_slopes(
        n, start, begin, first, last, y, z, reach, sides, x, step, low, high, level, scratch, cells, lanes,
        LIGHT + NEIGHBOURS,
    )  # fmt: skip


@kernel
def vector_shade(n, ray, shades, lanes, sample):
    _vector_shade(n, ray, LIGHT + NEIGHBOURS, shades, lanes, AT, LIGHT, sample)
    for number in range(shades.lights.shape[0]):
        _vector_add(n, number, shades, lanes, LIGHT, sample)


@kernel
def portable_shade(n, ray, shades, lanes, sample):
    _portable_shade(n, ray, LIGHT + NEIGHBOURS, shades, lanes, AT, LIGHT, sample)
    for number in range(shades.lights.shape[0]):
        _portable_add(n, number, shades, lanes, LIGHT, sample)


@kernel
def vector_shows(n, table, cells, lanes, section):
    return _vector_shows(n, table, cells, lanes, AT, section)


@kernel
def portable_shows(n, table, cells, lanes, section):
    return _portable_shows(n, table, cells, lanes, AT, section)


SLOPES = {"vector": vector_slopes, "portable": portable_slopes}
SHADE = {"vector": vector_shade, "portable": portable_shade}
SHOWS = {"vector": vector_shows, "portable": portable_shows}


def room():
    return np.empty(SCRATCH, np.float32), np.empty(TILE, np.int32)


def lanes_of(rng):
    return rng.random(int(LIGHT) + TILE * LIGHT_SECTIONS).astype(np.float32)


def lines(lanes, at, count):
    return lanes[int(at) : int(at) + TILE * count].reshape(count, TILE)


# --- Gradients --------------------------------------------------------------------------------------------


def level_of(data, reach, factor):
    """All of a volume [k, j, i] as runs for the principal axis z."""
    runs = RunStore(Volume(data), EverythingVisible()).axis(2, pairs=True, reach=int(np.ceil(reach)))
    factor = np.array(factor, float)
    size = np.array(runs.size, float)
    box = np.column_stack([np.zeros(3), size - 1])
    return Level(
        runs.visible, runs.pairs, runs.needed, runs.offsets, runs.voxels, factor, 1 / factor,
        box.ravel(), box[1:].ravel(), runs.size[2], runs.size[0],
    )  # fmt: skip


class Window(NamedTuple):
    """Samples at x + l·step on scanline y, slice z; cells begin … end − 1 of a row show something."""

    data: np.ndarray  # [k, j, i]
    reach: float
    y: float
    z: float
    x: float
    step: float
    low: float
    high: float
    begin: int
    end: int
    factor: tuple[float, float, float]

    def found(self, kind, rng):
        """[3, TILE]: along i, j and k; six lines may be written, and no other."""
        n_k, n_j, n_i = self.data.shape
        pad = int(np.ceil(self.reach))
        cells_of = np.array([self.begin, max(self.begin - pad, 0), min(self.end + pad, n_i - 1)], np.uint64)
        sides = (
            max(self.y - self.reach, 0.0), min(self.y + self.reach, n_j - 1.0),
            max(self.z - self.reach, 0.0), min(self.z + self.reach, n_k - 1.0),
        )  # fmt: skip
        lanes = np.full(int(LIGHT) + TILE * LIGHT_SECTIONS, UNTOUCHED)
        SLOPES[kind](
            TILE, float(self.begin), tuple(cells_of), self.y, self.z, self.reach, sides, self.x, self.step,
            self.low, self.high, level_of(self.data, self.reach, self.factor), *room(), lanes,
        )  # fmt: skip
        room_for = lines(lanes, LIGHT + NEIGHBOURS, 6)
        result = room_for[:3].copy()
        room_for[:] = UNTOUCHED
        assert (lanes == UNTOUCHED).all()
        return result[:, self.inside]

    @property
    def places(self):
        return np.clip(self.x + self.step * np.arange(TILE), self.low, self.high)

    @property
    def inside(self):
        """Lanes whose cell is one of these."""
        cell = np.minimum(np.floor(self.places), self.data.shape[2] - 2)
        return (cell >= self.begin) & (cell < self.end)

    def value(self, place):
        """Where a place lies on a slice, the next one has no say."""
        data = self.data
        if place[2] == np.floor(place[2]):
            data, place = data[[int(place[2])] * 2], (*place[:2], 0)
        return lit_twins.trilinear(data, place)

    def expected(self):
        result = []
        for place in np.column_stack([self.places, np.full(TILE, self.y), np.full(TILE, self.z)]):
            slopes = []
            for axis in range(3):
                ends = [max(place[axis] - self.reach, 0)]
                ends.append(min(place[axis] + self.reach, self.data.shape[2 - axis] - 1.0))
                values = [self.value((*place[:axis], end, *place[axis + 1 :])) for end in ends]
                slopes.append((values[1] - values[0]) / (ends[1] - ends[0]) / self.factor[axis])
            result.append(slopes)
        return np.array(result).T[:, self.inside]


def windows(rng, dtype, reach, wide, count=40):
    """Places along i are multiples of 1/64: float32 finds the same cells."""
    pad = int(np.ceil(reach))
    for _ in range(count):
        shape = (*rng.integers(2, 9, 2), int(rng.integers(60, 150)))
        data = rng.integers(0, 256, shape).astype(dtype)
        if dtype == np.float32:
            data = rng.normal(size=shape).astype(np.float32)
            data[rng.random(shape) < 0.005] = np.nan
        longest = 62 - 2 * pad if wide else 31 - 2 * pad
        width = int(rng.integers(max(1, 33 - 2 * pad) if wide else 1, longest + 1))
        begin = int(rng.choice([0, rng.integers(0, shape[2] - width), shape[2] - 1 - width]))
        step = rng.integers(1, 64 * (width + 4) // (TILE - 1) + 2) / 64
        x = begin - rng.integers(-64, 3 * 64) / 64
        y, z = rng.integers(0, 64 * (np.array(shape[1::-1]) - 1), 2, endpoint=True) / 64
        on_slices = rng.random(2) < 0.4
        y, z = (np.floor(v) if on else v for v, on in zip((y, z), on_slices, strict=True))
        low, high = (0.0, shape[2] - 1.0) if rng.random() < 0.5 else (begin + 0.25, begin + width - 0.5)
        factor = tuple(rng.choice([1.0, 2.0], 3))
        yield Window(data, reach, y, z, x, step, low, high, begin, begin + width, factor)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("reach", [0.5, 1.0, 1.3, 4.0])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_slopes_equal_the_twin(dtype, reach, wide, kind, rng):
    numbers = missing = 0
    for window in windows(rng, dtype, reach, wide):
        found, expected = window.found(kind, rng), window.expected()
        np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
        largest = 255 if dtype == np.uint8 else 4
        np.testing.assert_allclose(found, expected, rtol=0, atol=PACKET_SLOPES * largest)
        numbers += np.isfinite(expected).sum()
        missing += np.isnan(expected).sum()
    assert numbers > 300 and (missing > 10 or dtype == np.uint8)


# --- Light ------------------------------------------------------------------------------------------------

LIGHTS = (Light((1, 2, 3), (1, 0.6, 0.2)), Light((-2, -1, 1), (0.1, 0.3, 1)), Light((0, 0, -1)))
LOOKS = {
    "headlight": Look(Lighting()),
    "lights": Look(Lighting(headlight=(0.3, 0.2, 0.1), lights=LIGHTS, emissive=0.1, power=7.5)),
    "one side, blinn": Look(Lighting(lights=LIGHTS, two_sided=False, model="blinn", power=50)),
    "modulated": Look(Lighting(lights=LIGHTS[:1]), Modulation(0.02, 0.2, 0.8, 0.5), 1.5),
    "modulated alone": Look(None, Modulation(0.0, 0.2, 1.0, 1.0)),
}
SHAPES = TransferFunction2D([Box((40, 200), (0, 90), (1, 0.5, 0.2), 0.3)], 1.0)


def shaded(kind, shade, ray, lanes, sample):
    lanes = lanes.copy()
    SHADE[kind](TILE, ray, shade, lanes, sample)
    return lanes


@pytest.mark.parametrize("sample", [np.uint64(0), LIGHT_OF_SECOND])
@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("kind", KINDS)
def test_light_equals_the_twin(kind, look, sample, rng):
    volume = Volume(rng.integers(0, 256, (4, 5, 6)).astype(np.uint8), (0.7, 1.1, 1.6))
    look, axes = LOOKS[look], [1, 2, 0]
    classification = classify(SHAPES, volume)
    shade = shade_of(look, volume, axes, classification)
    largest = largest_magnitude(volume, look.gradient_distance)
    linear = volume.world_from_object[:3, axes]
    for _ in range(20):
        ray = tuple(np.float32(v) for v in (*rng.normal(size=3), rng.choice([-1, 1])))
        t = np.array([(ray[0] + lane * ray[1], *ray[2:]) for lane in range(TILE)], float)
        lanes = lanes_of(rng)
        lines(lanes, AT + LENGTH, 1)[0] = lengths = np.linalg.norm(t @ linear.T, axis=-1)
        slopes = lines(lanes, LIGHT + NEIGHBOURS, 3)
        slopes[:] = rng.normal(size=(3, TILE)) * 10.0 ** rng.uniform(-3, 1.8, TILE)
        slopes[:, 0], slopes[1, 1] = 0, np.nan
        given, left = slopes.copy(), lines(lanes, LIGHT + LEFT, 1)[0].copy()
        after = shaded(kind, shade, ray, lanes, sample)
        lit, shine = (lines(after, LIGHT + sample + at, 3) for at in (LIT_RED, SHINE_RED))
        for lane in range(TILE):
            g = given[:, lane].astype(float)
            g = world_from_differences(volume)[:, axes] @ (g if np.isfinite(g).all() else np.zeros(3))
            sight = -(linear @ t[lane]) / lengths[lane]
            thicker, tint = lit_twins.thickness(look.modulation, np.linalg.norm(g), largest)
            lights = look.lighting.lights if look.lighting else ()
            factor, bright = lit_twins.phong(
                look.lighting, g, sight, FAINTEST * largest, tint, np.repeat(left[lane], len(lights))
            )
            np.testing.assert_allclose(lit[:, lane], factor, rtol=0, atol=PACKET_LIGHT)
            np.testing.assert_allclose(shine[:, lane], bright, rtol=0, atol=PACKET_LIGHT)
            assert abs(lines(after, LIGHT + sample + THICKER, 1)[0, lane] - thicker) < PACKET_LIGHT
            row = lines(after, LIGHT + sample + SKIPPED, 1)[0, lane] / len(classification.table)
            exact = min(np.linalg.norm(g) * classification.per_magnitude, classification.magnitudes - 1.0)
            assert row == np.floor(row) and abs(row - exact) < 0.5 + 1e-4
        # All but the light's own sections is left alone, and so is the other sample's.
        np.testing.assert_array_equal(after[: int(LIGHT)], lanes[: int(LIGHT)])
        other = LIGHT + LIGHT_OF_SECOND - sample
        np.testing.assert_array_equal(lines(after, other, 8), lines(lanes, other, 8))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("section", [VALUE, SECOND])
def test_what_shows_is_told(kind, section, rng):
    """Any lane that has a value, goes on, and finds a row that shows something."""
    seen = np.zeros(42, np.uint8)
    none = np.zeros((0, 4), np.float32)
    table = LitTable(none, np.float32(1.0), np.float32(4.0), seen, none[:, 0], none, np.zeros(0, np.uint16))
    for _ in range(300):
        lanes = lanes_of(rng)
        values = rng.integers(-8, 60, TILE) / 4 + 0.0625
        values[rng.random(TILE) < 0.5] = np.nan
        lines(lanes, AT + section, 1)[0] = values
        seen[:] = rng.random(42) < 0.05
        seen[0] = 0
        goes_on = lines(lanes, AT + ALPHA, 1)[0] < lines(lanes, AT + ENOUGH, 1)[0]
        entry = np.clip(np.floor((np.nan_to_num(values) - 1) * 4 + 1.5), 1, 41).astype(int)
        expected = (seen[entry].astype(bool) & goes_on & np.isfinite(values)).any()
        assert SHOWS[kind](TILE, table, room()[1], lanes, section) == expected
