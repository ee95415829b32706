"""How much of a light reaches each place: kernels against twins, closed forms, regions, and pictures."""

from __future__ import annotations

from dataclasses import replace

import lit_twins
import numpy as np
import pytest
from test_composite import smooth_volume
from tolerances import (
    SHADOW_BESIDE,
    SHADOW_BYTES,
    SHADOW_COARSE,
    SHADOW_FACTOR,
    SHADOW_FADE,
    SHADOW_LOOK_UP,
    SHADOW_SPREAD,
    SHADOW_SWEEP,
)
from views import DIRECTIONS, random_pose

from persp_sw import (
    Cut,
    Light,
    Lighting,
    Look,
    Modulation,
    Regions,
    TransferFunction,
    Volume,
)
from persp_sw._jit import kernel
from persp_sw.kernels import attenuate, packet_lit, phong
from persp_sw.kernels.packet import SCRATCH
from persp_sw.kernels.scanline import Level
from persp_sw.kernels.state import LEFT, LIGHT_SECTIONS, SECTIONS, TILE
from persp_sw.optics.classification2d import classify
from persp_sw.optics.shading import shade_of
from persp_sw.optics.shadows import Shadows
from persp_sw.optics.transfer2d import Box, TransferFunction2D, Triangle
from persp_sw.volume.runs import PADDING

WHITE, TAU = (1.0, 1.0, 1.0), 0.2
HAZE = TransferFunction([(60, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.5)], 1.0)
EVEN = TransferFunction([(0, WHITE, -np.expm1(-TAU))], 1.0)  # the same extinction at every value
CLOUD = TransferFunction([(40, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.8)], 1.0)
SHAPES = TransferFunction2D(
    [Box((40, 200), (0, 30), (1, 0.5, 0.2), 0.3), Triangle(120, (5, 70), 90, (0.2, 0.5, 1), 0.6)], 1.0
)


def blobs(finer=1, spacing=(1.0, 1.0, 1.0), **pose):
    """Two soft balls; the far one of DIRECTIONS[1] lies in the other's shadow. Nothing at the sides."""
    z, y, x = np.indices((13 * finer, 14 * finer, 15 * finer)) / finer

    def blob(at, radius):
        off = (x - at[0]) ** 2 + (y - at[1]) ** 2 + (z - at[2]) ** 2
        return np.exp(-off / radius**2)

    data = 250 * (blob((9.5, 9, 8.6), 2.4) + 0.9 * blob((4.7, 4.8, 4.2), 2.6))
    if not pose:
        pose = {"spacing": np.array(spacing) / finer}
    return Volume(np.clip(data, 0, 255).astype(np.uint8), **pose)


def lit_from(*directions, **keys):
    keys = {"headlight": 0.0, "shadow_offset": 0.0} | keys
    return Look(Lighting(lights=tuple(Light(towards, shadows=True) for towards in directions), **keys))


def shadows_of(volume, transfer, look, regions=None, factor=1):
    return Shadows(volume, classify(transfer, volume), look, regions or Regions(), factor)


def parts(shadows):
    return shadows.left / 65535.0


# --- Extinction -------------------------------------------------------------------------------------------


def extinction_of(volume, transfer, look):
    """Voxel by voxel, from the table."""
    classification = classify(transfer, volume)
    shade = shade_of(look, volume, [0, 1, 2], classification)
    numbers, result = shade.numbers.astype(float), np.zeros(volume.data.shape)
    for z, y, x in np.ndindex(result.shape):
        value = float(volume.data[z, y, x])
        if np.isnan(value):
            continue
        row = (value - classification.origin) * classification.scale + 1.5
        row = int(np.clip(row, 1, len(classification.table) - 1))
        slopes = lit_twins.slopes(volume.data, (x, y, z), look.gradient_distance)
        linear = shade.numbers[phong.NORMAL_FROM_SLOPES :][:9].reshape(3, 3).astype(float)
        magnitude = np.linalg.norm(linear @ slopes)
        weight = np.clip((magnitude - numbers[phong.LOW]) * numbers[phong.PER_WEIGHT], 0, 1)
        thicker = 1 - numbers[phong.THICKENED] + numbers[phong.THICKENED] * weight
        skipped = np.floor(magnitude * classification.per_magnitude + 0.5)
        row += int(min(skipped, classification.magnitudes - 1)) * len(classification.table)
        result[z, y, x] = classification.rows[row, 3] * thicker
    return result


LENGTH = 1.3


def coarse_extinction(volume, transfer, look, factor):
    classification = classify(transfer, volume)
    shade = shade_of(look, volume, [0, 1, 2], classification)
    out = np.full([-(-(n - 1) // factor) + 1 for n in volume.data.shape], np.nan, np.float32)
    attenuate.coarse_extinction(
        volume.data, classification.rows, classification.origin, classification.scale,
        len(classification.table) - 1, shade.numbers.astype(float), factor, LENGTH, out,
    )  # fmt: skip
    return out


@pytest.mark.parametrize("factor", [1, 2, 4])
@pytest.mark.parametrize("shape", [(9, 6, 11), (2, 3, 8), (5, 4, 7)])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_extinction_is_the_mean_around_every_coarse_voxel(dtype, shape, factor):
    data = smooth_volume(shape, dtype).data.copy()
    if dtype == np.float32:
        data[1, 2, 3] = data[-1, -1, -1] = np.nan
    volume = Volume(data, (1, 0.7, 1.6))
    found = coarse_extinction(volume, HAZE, Look(), factor)
    expected = lit_twins.coarse(extinction_of(volume, HAZE, Look()), factor, LENGTH)
    assert expected.max() > 0.1
    np.testing.assert_allclose(found, expected, rtol=SHADOW_COARSE, atol=0)


@pytest.mark.parametrize(
    ("transfer", "look"),
    [
        (HAZE, Look(None, Modulation(0.02, 0.2, 0.8, 0.5), 1.5)),
        (SHAPES, Look(None, None, 1.0)),
        (SHAPES, Look(None, Modulation(0.0, 0.3, 1.0), 0.5)),
    ],
)
@pytest.mark.parametrize("factor", [1, 2])
def test_magnitudes_change_the_extinction(factor, transfer, look, rng):
    data = smooth_volume((6, 7, 8), np.float32).data.copy()
    data[3, 3, 3] = np.nan  # neighbours have no gradient
    volume = Volume(data, world_from_object=random_pose(rng, spacing=(0.7, 1.1, 1.5), shear=0.3))
    expected = extinction_of(volume, transfer, look)
    found = coarse_extinction(volume, transfer, look, factor)
    assert np.abs(
        expected - extinction_of(volume, transfer, replace(look, modulation=None))
    ).max() > 0.02 or (transfer is SHAPES and look.modulation is None)
    np.testing.assert_allclose(
        found, lit_twins.coarse(expected, factor, LENGTH), rtol=SHADOW_COARSE, atol=1e-7
    )


# --- Sweeping ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("from_end", [False, True])
@pytest.mark.parametrize(
    "shift", [(0.0, 0.0), (0.3, 0.0), (0.0, -0.77), (1.0, 1.0), (-1.0, 0.4), (0.05, -1.0)]
)
def test_sweeping_equals_its_twin(shift, from_end, rng):
    for shape in ((6, 5, 7), (2, 3, 2), (9, 2, 4)):
        extinction = (rng.random(shape) * 0.8).astype(np.float32)
        left = np.full(shape, np.nan, np.float32)
        attenuate.sweep(extinction, from_end, *shift, 1.3, left)
        expected = lit_twins.swept(extinction.astype(float), from_end, shift, 1.3)
        np.testing.assert_allclose(left, expected, rtol=SHADOW_SWEEP, atol=0)
        assert (left[-1 if from_end else 0] == 1).all() and left.min() < 0.75


def way_out(volume, towards):
    """World length from each voxel [z, y, x] to where the volume ends."""
    z, y, x = np.indices(volume.data.shape)
    places = np.stack([x, y, z], -1).astype(float)
    step = np.linalg.solve(volume.world_from_object[:3, :3], np.array(towards) / np.linalg.norm(towards))
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.where(step > 0, (np.array(volume.size) - 1 - places) / step, places / -step)
    return np.where(np.abs(step) > 1e-12, ends, np.inf).min(-1)


POSES = {"identity": {}, "anisotropic": {"spacing": (0.5, 1.0, 2.0)}, "sheared": {"shear": 0.4}}


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_homogeneous_medium_along_its_axes_is_exact(sign, axis, pose, rng):
    world_from_object = random_pose(rng, **POSES[pose])
    volume = Volume(np.full((7, 8, 9), 50, np.uint8), world_from_object=world_from_object)
    towards = sign * world_from_object[:3, axis]
    left = parts(shadows_of(volume, EVEN, lit_from(towards)))[0]
    assert np.abs(left - np.exp(-TAU * way_out(volume, towards))).max() < SHADOW_BYTES


def homogeneous(towards, cells, pose=None):
    """What is left in 8 units of fog a side, the truth, and where it is exact: all light came in in front.

    From slice to slice light is carried on from the four voxels around a place, at most one further along
    each axis than the place itself.
    """
    pose = np.eye(4) if pose is None else pose
    pose = pose @ np.diag([8 / cells] * 3 + [1])
    volume = Volume(np.full((cells + 1,) * 3, 50, np.uint8), world_from_object=pose)
    left = parts(shadows_of(volume, EVEN, lit_from(towards)))[0]
    step = np.linalg.solve(pose[:3, :3], towards)
    axis = int(np.argmax(np.abs(step)))
    places = np.stack(np.indices(left.shape)[::-1], -1)
    beyond = np.where(step > 0, cells - places, places).astype(float)
    slices = beyond[..., axis].copy()
    beyond[..., np.abs(step) < 1e-9 * np.abs(step).max()] = np.inf
    beyond[..., axis] = np.inf
    return left, np.exp(-TAU * way_out(volume, towards)), beyond.min(-1) >= slices


@pytest.mark.parametrize("towards", DIRECTIONS)
def test_fog_is_right_from_any_side_and_never_too_dark(towards, rng):
    """Light that came in through a side is carried on to neighbours; errors shrink with the voxels."""
    turned = random_pose(rng, shear=0.3)
    for pose in (np.eye(4), turned):
        errors = []
        for cells in (8, 16, 32):
            left, truth, exact = homogeneous(towards, cells, pose)
            assert exact.mean() > 0.1 and truth.min() < 0.5
            assert np.abs(left - truth)[exact].max() < SHADOW_BYTES
            assert (left - truth).min() > -SHADOW_BYTES
            errors.append((left - truth).mean())
        assert max(errors) < SHADOW_SPREAD
        assert errors[2] < max(0.8 * errors[1], SHADOW_SPREAD / 4)


# --- Look-ups ---------------------------------------------------------------------------------------------


def level_with(factor):
    """Of a level a look-up needs no more than this; a type of its own would end in the program's cache."""
    bits, voxels, none = np.zeros((1, 1, 1), np.uint64), np.zeros(1, np.uint8), np.zeros(3)
    return Level(bits, bits, bits, bits, voxels, np.array(factor, float), none, none, none, 1, 1)


_find_left = packet_lit._find_left


@kernel
def found_left(number, y, z, x, step, low, high, level, shades, scratch, cells, lanes, light):
    _find_left(TILE, number, y, z, x, step, low, high, level, shades, scratch, cells, lanes, light)


def looked_up(shade, number, y, z, x, step, low, high, factor=(1.0, 1.0, 1.0)):
    lanes = np.full(TILE * SECTIONS + int(LIGHT_SECTIONS) * TILE, np.nan, np.float32)
    light = np.uint64(TILE * SECTIONS)
    room = np.empty(SCRATCH, np.float32), np.empty(TILE, np.int32)
    level = level_with(factor)
    found_left(number, y, z, x, step, low, high, level, shade, *room, lanes, light)
    at = int(light + LEFT)
    return lanes[at : at + TILE].astype(float)


STARTS = (0, (0.7, -1.3, 0.4)), (1, (0, 0, 0)), (-1, (0, 0, 0))  # a shadow's number, and where it counts from


def random_shade(rng, size=(150, 5, 6), lights=STARTS, per=1.0):
    """Two shadows of noise and three lights, the last without one; size and starts along i, j and k."""
    left = rng.integers(0, 65536, (2, *size[::-1])).astype(np.uint16)
    numbers, columns = np.zeros(phong.NUMBERS, np.float32), np.zeros((3, phong.LIGHT_COLUMNS), np.float32)
    numbers[phong.PER_SHADOW], numbers[phong.SHADOW_SIZE :][:3] = per, size
    for column, (number, start) in zip(columns, lights, strict=True):
        column[phong.SHADOW], column[phong.START :] = number, start
    shade = phong.Shade(numbers, columns, np.pad(left.transpose(0, 2, 1, 3).ravel(), PADDING))
    return shade, left  # [light, k, j, i]


def expected_left(shade, left, number, y, z, x, step, low, high, factor=(1.0, 1.0, 1.0)):
    shadow, per = int(shade.lights[number, phong.SHADOW]), float(shade.numbers[phong.PER_SHADOW])
    if shadow < 0:
        return np.ones(TILE)
    places = np.clip(x + step * np.arange(TILE), low, high)
    start = shade.lights[number, phong.START :].astype(float)
    return np.array([
        lit_twins.trilinear(left[shadow] / 65535, (np.array([place, y, z]) * factor + start) * per)
        for place in places
    ])  # fmt: skip


@pytest.mark.parametrize("per", [1.0, 0.5])
def test_look_ups_equal_their_twin(per, rng):
    for _ in range(200):
        shade, left = random_shade(rng, per=per)
        size = np.array([150, 5, 6]) / per
        low, high = np.sort(rng.uniform(-2, size[0] + 2, 2))
        place = rng.uniform(-1, size[1]), rng.uniform(-1, size[2]), rng.uniform(-5, size[0])
        step = rng.choice([0.01, 0.4, 1.0, 3.7, 9.3, 25.0])
        factor = rng.choice([1.0, 2.0], 3)
        for number in range(3):
            given = (number, *place, step, low, high, factor)
            found, expected = looked_up(shade, *given), expected_left(shade, left, *given)
            np.testing.assert_allclose(found, expected, rtol=0, atol=SHADOW_LOOK_UP)


@pytest.mark.parametrize("step", [1.0, 4.0, 8.0])
def test_places_a_breath_before_a_voxel_are_in_shadow_too(step, rng):
    """float32 rounds them up, beyond the last cell that is looked at, or from one window to the next."""
    shade, _ = random_shade(rng, lights=((0, (0, 0, 0)),) * 3)
    shade.shadows[:] = 0
    for first in range(0, 30):
        for breath in (0.0, 1e-12, 1e-8, 3e-8, 2e-7, 1e-6):
            found = looked_up(shade, 0, 1.5, 2.5, first - breath, step, 0.0, 149.0)
            assert (found == 0).all(), (first, breath, found)


# --- What is cut away -------------------------------------------------------------------------------------

LONG = (12, 8, 9)  # x, y, z


def fog(**pose):
    return Volume(np.full(LONG[::-1], 50, np.uint8), **pose)


WALL = Cut((1, 0, 0, -5.2), 2.6, "outside")  # x = 3.9 … 6.5
INSIDE_ONLY = ((1 << 27) - 1) & ~sum(1 << 1 + 3 * n for n in range(9))  # all but the middle along x
ALONG_X = {
    "whole": (Regions(), [(0, 11)]),
    "clip": (Regions(clip=[(-1, 0, 0, 8.3)]), [(0, 8.3)]),
    "two clips": (Regions(clip=[(-1, 0, 0, 8.0), (2, 0, 0, -5)]), [(2.5, 8)]),
    "crop": (Regions((1.3, 7.6, -9, 99, -9, 99)), [(1.3, 7.6)]),
    "inverted crop": (Regions((2.7, 8.1, -9, 99, -9, 99), crop_flags=INSIDE_ONLY), [(0, 2.7), (8.1, 11)]),
    "wall": (Regions(cut=[WALL]), [(0, 3.9), (6.5, 11)]),
    "slab": (Regions(cut=[replace(WALL, show="inside")]), [(3.9, 6.5)]),
    "wall and clip": (Regions(cut=[WALL], clip=[(-1, 0, 0, 9.4)]), [(0, 3.9), (6.5, 9.4)]),
}


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("name", ALONG_X)
def test_what_is_cut_away_casts_no_shadow(name, sign):
    """Borders across the light, at any place in a cell: all voxels half a one from them are right.

    Those with no clear neighbour are exact.
    """
    regions, shown = ALONG_X[name]
    left = parts(shadows_of(fog(), EVEN, lit_from((sign, 0, 0)), regions))[0]
    x = np.arange(LONG[0])
    off = np.full(LONG[0], np.inf)
    depth = np.zeros(LONG[0])
    for low, high in shown:
        on_the_way = (max(low, 0), high) if sign > 0 else (low, high)
        begin = np.maximum(x, on_the_way[0]) if sign > 0 else np.full(LONG[0], low)
        end = np.full(LONG[0], high) if sign > 0 else np.minimum(x, on_the_way[1])
        depth += np.maximum(end - begin, 0)
        for border in (low, high):
            if border not in (0, 11):
                off = np.minimum(off, np.abs(x - border))
    far, near = off >= 1.5, (off >= 0.5) & (off < 1.5)
    assert far.sum() >= 2 and near.sum() + far.sum() >= 6
    truth = np.broadcast_to(np.exp(-TAU * depth), left.shape)  # the volume's sides along the light as well
    assert np.abs(left - truth)[..., far].max() < SHADOW_BYTES
    assert np.abs(left - truth)[..., near].max(initial=0) < SHADOW_BESIDE
    assert (np.diff(left, axis=2) * sign > -SHADOW_BYTES).all()


def test_borders_fade_so_that_shadows_move_with_a_plane_without_steps():
    """The depth behind a slanted plane, as it moves by a tenth of a voxel at a time, grows evenly."""
    normal = np.array([-1, 0.3, 0.2])
    depths = []
    for offset in np.arange(6, 8.05, 0.1):
        regions = Regions(clip=[(*normal, offset)])
        left = parts(shadows_of(fog(), EVEN, lit_from((1, 0, 0)), regions))[0]
        depths.append(-np.log(left[4, 4, 1]) / TAU)
    expected = np.arange(6, 8.05, 0.1) + 0.3 * 4 + 0.2 * 4 - 1
    assert np.abs(np.array(depths) - expected).max() < SHADOW_FADE


def test_two_lights_have_a_shadow_each():
    look = lit_from((1, 0, 0), (0, -1, 0.5))
    look = replace(look, lighting=replace(look.lighting, lights=(
        look.lighting.lights[0], Light((0, 0, 1)), look.lighting.lights[1]
    )))  # fmt: skip
    both = shadows_of(fog(), EVEN, look)
    assert both.left.shape == (2, *LONG[::-1])
    for found, towards in zip(both.left, ((1, 0, 0), (0, -1, 0.5)), strict=True):
        np.testing.assert_array_equal(found, shadows_of(fog(), EVEN, lit_from(towards)).left[0])
    assert not np.array_equal(*both.left)


def test_coarser_shadows_are_near_the_finer_ones():
    volume = blobs(finer=2)
    for towards in DIRECTIONS[1:4]:
        fine, coarse = (shadows_of(volume, CLOUD, lit_from(towards), factor=factor) for factor in (1, 2))
        where = np.stack(np.indices(fine.left.shape[1:]), -1)[::3, ::3, ::3]  # z, y, x
        off = [
            lit_twins.trilinear(parts(coarse)[0], place[::-1] / 2) - parts(fine)[0][tuple(place)]
            for place in where.reshape(-1, 3)
        ]
        assert parts(fine)[0].min() < 0.3
        assert np.abs(off).max() < SHADOW_FACTOR and np.abs(off).mean() < SHADOW_FACTOR / 6


@pytest.mark.parametrize("shape", [(1, 5, 6), (5, 1, 6), (5, 6, 1), (2, 2, 2), (1, 1, 1)])
def test_thin_volumes_have_shadows_without_numbers_gone_wrong(shape):
    volume = Volume(np.full(shape, 50, np.uint8))
    for towards in DIRECTIONS:
        left = shadows_of(volume, EVEN, lit_from(towards), factor=2).left
        assert left.max() == 65535 and left.min() > 0


def test_far_larger_volumes_have_coarser_shadows():
    for longest, factor in ((100, 1), (160, 1), (161, 2), (321, 4)):
        volume = Volume(np.zeros((2, 3, longest), np.uint8))
        shadows = Shadows(volume, classify(EVEN, volume), lit_from((1, 1, 1)), Regions())
        assert shadows.factor == factor
        assert shadows.left.shape[3] == -(-(longest - 1) // factor) + 1
