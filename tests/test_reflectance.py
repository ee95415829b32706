"""Maps of many lights: against closed form within their bound, both kernels against a twin, pictures."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import lit_twins
import numpy as np
import pytest
from test_composite import smooth_volume
from test_lit import HAZE, rendered
from test_packets import KINDS
from tolerances import FLOAT32_LIT, MAP_LOOK_UP, MAP_ORDER, PACKET_LIGHT
from views import DIRECTIONS, view_of

from persp_sw import Light, Lighting, Look, Modulation, Renderer, View, Volume
from persp_sw._jit import kernel
from persp_sw.kernels import packet_lit_vector, phong, reflect, reflect_vector
from persp_sw.kernels.state import (
    COSINE,
    DIRECTION,
    LEFT,
    LENGTH,
    LIGHT_OF_SECOND,
    LIGHT_SECTIONS,
    LIT_RED,
    NEIGHBOURS,
    NORMAL,
    SECTIONS,
    SHINE_RED,
    SQUARE,
    TILE,
    TINT,
)
from persp_sw.optics import reflectance
from persp_sw.optics.classification import Classification
from persp_sw.optics.reflectance import LARGEST_ERROR, built, reflectance_of
from persp_sw.optics.shading import shade_of
from persp_sw.volume.gradient import FAINTEST, largest_magnitude, world_from_differences

LIGHT = np.uint64(TILE * SECTIONS)  # behind a tile
_vector, _portable = reflect_vector.reflect, reflect.reflect


def random_directions(rng, count):
    found = rng.normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def random_lights(rng, count, brightness=1.0, **every):
    """All of them together as bright as this."""
    colours = rng.random((count, 3)) * 2 * brightness / count
    return tuple(
        Light(tuple(towards), tuple(colour), **every)
        for towards, colour in zip(random_directions(rng, count), colours, strict=True)
    )


def arrays(lights):
    return np.array([light.direction for light in lights]), np.array([light.colour for light in lights])


def tricky_directions(rng, lights, count=20000):
    """Any, and many near where lights stand and where they set."""
    towards = arrays(lights)[0]
    some = towards[rng.integers(0, len(towards), count)]
    near = some + 0.2 * rng.random((count, 1)) * rng.normal(size=(count, 3))
    off = random_directions(rng, count)
    level = off - (off * some).sum(1, keepdims=True) * some + 0.02 * rng.normal(size=(count, 1)) * some
    found = np.concatenate([random_directions(rng, count), near, level])
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def closed_form(directions, lights, strength, power):
    towards, colours = arrays(lights)
    return np.maximum(directions @ towards.T, 0) ** power @ colours * strength


def interpolated(texels, half, directions):
    """(n, 3): a map [row, column] of any directions, |q|₁ = 1; from the layout that `reflect` tells."""
    texels = texels.reshape(2 * half + 1, 2 * half + 1, 4)[..., :3].astype(float)
    x, y, z = (directions / np.abs(directions).sum(1, keepdims=True)).T
    sign_x, sign_y = np.where(x < 0, -1, 1), np.where(y < 0, -1, 1)
    u = np.where(z < 0, sign_x * (1 - abs(y)), x)
    v = np.where(z < 0, sign_y * (1 - abs(x)), y)
    column, row = ((np.clip(along, -1, 1) + 1) * half for along in (u, v))
    left, top = (np.minimum(along.astype(int), 2 * half - 1) for along in (column, row))
    a, b = column - left, row - top
    # The diagonal runs as |u| + |v| = const: between the lower left and the upper right corner, or not.
    turned = (left < half) != (top < half)
    b, top, down = np.where(turned, 1 - b, b), np.where(turned, top + 1, top), np.where(turned, -1, 1)
    beyond = a + b > 1
    corner = np.where(beyond[:, None], texels[top + down, left + 1], texels[top, left])
    weight_a, weight_b = np.where(beyond, 1 - b, a), np.where(beyond, 1 - a, b)
    weights = [weight[:, None] for weight in (1 - weight_a - weight_b, weight_a, weight_b)]
    found = (corner, texels[top, left + 1], texels[top + down, left])
    return sum(weight * one for weight, one in zip(weights, found, strict=True))


def diffuse_of(texels, half, directions):
    return interpolated(texels, half, directions) * np.abs(directions).sum(1, keepdims=True)


def parts(maps):
    """(diffuse, mirrored) texels."""
    first = (2 * maps.halves[0] + 1) ** 2
    assert len(maps.texels) == first + (maps.halves[1] > 0) * (2 * maps.halves[1] + 1) ** 2
    return maps.texels[:first], maps.texels[first:]


# --- Maps against closed form ------------------------------------------------------------------------------


def test_texels_lie_on_the_octahedron_and_fold_as_told():
    q = reflectance.octahedron(4)
    np.testing.assert_allclose(np.abs(q).sum(1), 1, rtol=0, atol=1e-15)
    square = q.reshape(9, 9, 3)
    np.testing.assert_array_equal(square[4, 4], (0, 0, 1))
    np.testing.assert_array_equal(square[4, 8], (1, 0, 0))
    np.testing.assert_array_equal(square[8, 4], (0, 1, 0))
    np.testing.assert_array_equal(np.abs(square[[0, 0, 8, 8], [0, 8, 0, 8]]), [(0, 0, 1)] * 4)
    assert (square[[0, 0, 8, 8], [0, 8, 0, 8], 2] == -1).all()
    np.testing.assert_allclose(square[1, 7], (0.25, -0.25, -0.5))


@pytest.mark.parametrize("power", [2.0, 7.5, 20.0, 100.0])
@pytest.mark.parametrize("count", [1, 3, 12, 40])
def test_errors_stay_below_their_bound(count, power, rng):
    for _ in range(3):
        lights = random_lights(rng, count)
        towards, colours = arrays(lights)
        directions = tricky_directions(rng, lights)
        diffuse, mirrored = (
            closed_form(directions, lights, 0.8, 1),
            closed_form(directions, lights, 0.3, power),
        )
        bounds = (
            reflectance.diffuse_errors(towards, 0.8 * colours),
            reflectance.mirrored_errors(towards, 0.3 * colours, power),
        )
        for half in (16, 64):
            texels = reflectance.diffuse_map(towards, 0.8 * colours, half)
            errors = diffuse_of(texels, half, directions) - diffuse
            bound = bounds[0][reflectance.HALVES.index(half)]
            assert errors.max() < bound and errors.min() > -MAP_LOOK_UP
            assert errors.max() > bound / 12
            texels = reflectance.mirrored_map(towards, 0.3 * colours, power, half)
            error = np.abs(interpolated(texels, half, directions) - mirrored).max()
            bound = bounds[1][reflectance.HALVES.index(half)]
            assert bound / 12 < error < bound


def test_lights_that_set_at_one_place_are_bounded_too(rng):
    """Their kinks all meet at the axis about which they stand, in the middle of three coarse texels."""
    turn = np.linalg.qr(np.column_stack([np.ones(3), *rng.normal(size=(2, 3))]))[0]
    angles = rng.uniform(0, 2 * np.pi, 12)
    ring = np.column_stack([np.zeros(12), np.cos(angles), np.sin(angles)]) @ turn.T
    colours = np.full((12, 3), 0.1)
    lights = tuple(Light(tuple(one), tuple(c)) for one, c in zip(ring, colours, strict=True))
    bounds = reflectance.diffuse_errors(ring, colours)
    for half in (16, 64, 256):
        near = turn[:, 0] + 2 / half * rng.normal(size=(50000, 3))
        near /= np.linalg.norm(near, axis=1, keepdims=True)
        errors = diffuse_of(reflectance.diffuse_map(ring, colours, half), half, near)
        errors = errors - closed_form(near, lights, 1, 1)
        bound = bounds[reflectance.HALVES.index(half)]
        assert bound == pytest.approx(1.2 * np.sqrt(6) / 4 / half)
        assert bound / 12 < errors.max() < bound


def test_maps_gain_with_their_resolution_as_their_bounds_do(rng):
    halves, errors = np.array([16, 32, 64, 128, 256]), []
    lights = random_lights(rng, 3)
    towards, colours = arrays(lights)
    directions = tricky_directions(rng, lights, 150_000)
    diffuse, mirrored = closed_form(directions, lights, 1, 1), closed_form(directions, lights, 1, 30)
    for half in halves:
        found = diffuse_of(reflectance.diffuse_map(towards, colours, half), half, directions) - diffuse
        other = interpolated(reflectance.mirrored_map(towards, colours, 30.0, half), half, directions)
        errors.append([np.abs(found).max(), np.abs(other - mirrored).max()])
    slopes = np.polyfit(np.log(halves), np.log(errors), 1)[0]
    np.testing.assert_allclose(slopes, [-1, -2], rtol=0, atol=MAP_ORDER)
    for bounds, order in (
        (reflectance.diffuse_errors(towards, colours), 1),
        (reflectance.mirrored_errors(towards, colours, 30.0), 2),
    ):
        # To the first order or better: fewer lights set in a smaller triangle.
        assert bounds[-1] <= bounds[0] * (reflectance.HALVES[0] / reflectance.HALVES[-1]) ** order * 1.0001


@pytest.mark.parametrize("power", [5.0, 60.0])
@pytest.mark.parametrize("count", [8, 12, 64])
def test_the_size_is_chosen_by_the_bound(count, power, rng):
    lights = random_lights(rng, count)
    maps = reflectance_of(Lighting(lights=lights, power=power))
    assert 0.3 * LARGEST_ERROR < maps.error <= LARGEST_ERROR
    directions = tricky_directions(rng, lights)
    diffuse, mirrored = parts(maps)
    off = np.abs(diffuse_of(diffuse, maps.halves[0], directions) - closed_form(directions, lights, 0.8, 1))
    bright = interpolated(mirrored, maps.halves[1], directions) - closed_form(directions, lights, 0.3, power)
    assert off.max() + np.abs(bright).max() < maps.error


# --- When there is a map -----------------------------------------------------------------------------------


def test_maps_are_for_many_lights_that_cast_no_shadows(rng):
    plain, casting = random_lights(rng, 8), random_lights(rng, 4, shadows=True)
    assert reflectance_of(Lighting(lights=plain[:7] + casting)) is None
    maps = reflectance_of(Lighting(lights=casting[:2] + plain + casting[2:]))
    assert maps.lights == plain
    assert maps is reflectance_of(Lighting(0.7, headlight=0, lights=plain, two_sided=False))


def test_lights_stay_direct_where_no_map_is_right_enough(rng):
    lights = random_lights(rng, 12)
    assert reflectance_of(Lighting(lights=lights)) is not None
    assert reflectance_of(Lighting(lights=lights, model="blinn")) is None
    assert reflectance_of(Lighting(lights=lights, specular=0.01, power=1.9)) is None
    assert reflectance_of(Lighting(lights=lights, power=1e4)) is None  # highlights too small for any map
    assert reflectance_of(Lighting(lights=lights, diffuse=8.0)) is None  # too bright
    for dull in (
        Lighting(lights=lights, specular=0, model="blinn"),
        Lighting(lights=lights, specular=0, power=1),
    ):
        assert reflectance_of(dull).halves[1] == 0


def shade_for(lighting, volume=None):
    volume = volume or smooth_volume()
    return shade_of(Look(lighting), volume, [1, 2, 0], Classification.of(HAZE, volume))


def test_shades_hold_the_map_and_the_lights_that_are_left(rng):
    plain, casting = random_lights(rng, 9), random_lights(rng, 2, shadows=True)
    lighting = Lighting(lights=(casting[0], *plain, casting[1]))
    shade = shade_for(lighting)
    maps = reflectance_of(Lighting(lights=plain))
    assert (shade.numbers[[phong.HALF_DIFFUSE, phong.HALF_MIRRORED]] == maps.halves).all()
    np.testing.assert_array_equal(shade.numbers[phong.NUMBERS :], maps.texels.ravel())
    np.testing.assert_array_equal(shade.lights[:, phong.SHADOW], [0, 1])
    np.testing.assert_allclose(shade.lights[:, :3], arrays(casting)[0], rtol=1e-6)
    # The maps are copied once, not for each picture; what else changes is no map's.
    assert shade_for(lighting).numbers is shade.numbers
    other = shade_for(replace(lighting, ambient=0.9)).numbers
    assert other[phong.OWN] == np.float32(0.9) and shade.numbers[phong.OWN] == np.float32(0.2)
    np.testing.assert_array_equal(other[phong.NUMBERS :], maps.texels.ravel())
    few = shade_for(Lighting(lights=(casting[0], *plain[:7], casting[1])))
    assert len(few.numbers) == phong.NUMBERS and len(few.lights) == 9
    assert not few.numbers[[phong.HALF_DIFFUSE, phong.HALF_MIRRORED]].any()


# --- Kernels -----------------------------------------------------------------------------------------------


@kernel
def vector_reflect(n, numbers, lanes, sample):
    _vector(n, numbers, lanes, LIGHT, sample)


@kernel
def portable_reflect(n, numbers, lanes, sample):
    _portable(n, numbers, lanes, LIGHT, sample)


REFLECT = {"vector": vector_reflect, "portable": portable_reflect}


def lines(lanes, section, count=1):
    at = int(LIGHT + section)
    return lanes[at : at + TILE * count].reshape(count, TILE)


def corners_and_edges():
    """Axes, folds and their corners, with both zeros; and nothing at all."""
    some = np.array(np.meshgrid(*[[0.0, -0.0, 1.0, -1.0, 0.5, 1e-6]] * 3)).reshape(3, -1).T
    return np.concatenate([some, [(0, 0, 0), (3e-15, -2e-15, 1e-15), (1e-30, 0, 0), (0, -1e-38, 1e-38)]])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sample", [np.uint64(0), LIGHT_OF_SECOND])
@pytest.mark.parametrize(("specular", "power"), [(0.3, 100.0), (0.3, 4.0), (0.0, 4.0)])
def test_look_ups_equal_the_twin(specular, power, sample, kind, rng):
    lighting = Lighting(lights=random_lights(rng, 12), specular=specular, power=power)
    shade, maps = shade_for(lighting), reflectance_of(lighting)
    texels = parts(maps)
    every = np.concatenate([corners_and_edges(), rng.normal(size=(3000, 3))])
    every /= np.maximum(np.linalg.norm(every, axis=1, keepdims=True), 1)
    every *= np.where(rng.random((len(every), 1)) < 0.3, 10.0 ** rng.uniform(-9, 0, (len(every), 1)), 1)
    every = np.resize(every, (len(every) // TILE * TILE, 3)).astype(np.float32)
    lit_at_all = 0
    for normals in every.reshape(-1, TILE, 3):
        lanes = rng.random(int(LIGHT) + TILE * LIGHT_SECTIONS).astype(np.float32)
        sights = random_directions(rng, TILE).astype(np.float32)
        lines(lanes, NORMAL, 3)[:], lines(lanes, DIRECTION, 3)[:] = normals.T, -sights.T
        lines(lanes, COSINE)[0] = (normals * sights).sum(1)
        lines(lanes, SQUARE)[0] = (normals * normals).sum(1)
        before, tint = lanes.copy(), lines(lanes, TINT)[0].astype(float)[:, None]
        REFLECT[kind](TILE, shade.numbers, lanes, sample)
        n, v = normals.astype(float), sights.astype(float)
        cosine, square = lines(lanes, COSINE)[0].astype(float), lines(lanes, SQUARE)[0].astype(float)
        lit, shine = (
            (lines(lanes, sample + at, 3) - lines(before, sample + at, 3)).T for at in (LIT_RED, SHINE_RED)
        )
        length = np.abs(n).sum(1, keepdims=True)
        expected = tint * length * interpolated(texels[0], maps.halves[0], n + (length == 0) * [0, 0, 1.0])
        np.testing.assert_allclose(lit, expected, rtol=0, atol=MAP_LOOK_UP)
        if not specular:
            assert not shine.any()
            continue
        mirrored = 2 * cosine[:, None] * n - square[:, None] * v
        mirrored += (np.abs(mirrored).sum(1, keepdims=True) == 0) * [0, 0, 1.0]
        strength = np.where(cosine > 0, square**power, 0)[:, None]
        expected = strength * interpolated(texels[1], maps.halves[1], mirrored)
        np.testing.assert_allclose(shine, expected, rtol=0, atol=MAP_LOOK_UP)
        lit_at_all += (expected.max(1) > 0.01).sum()
        # All but the sample's own six sections is left alone.
        for at in (LIT_RED, SHINE_RED):
            lines(before, sample + at, 3)[:] = lines(lanes, sample + at, 3)
        np.testing.assert_array_equal(lanes, before)
    assert lit_at_all > 50 or not specular


_vector_shade, _portable_shade = packet_lit_vector.shade, phong.shade
_vector_add, _portable_add = packet_lit_vector.add_light, phong.add_light


@kernel
def vector_light(n, ray, shades, lanes):
    _vector_shade(n, ray, LIGHT + NEIGHBOURS, shades, lanes, np.uint64(0), LIGHT, np.uint64(0))
    for number in range(shades.lights.shape[0]):
        _vector_add(n, number, shades, lanes, LIGHT, np.uint64(0))
    _vector(n, shades.numbers, lanes, LIGHT, np.uint64(0))


@kernel
def portable_light(n, ray, shades, lanes):
    _portable_shade(n, ray, LIGHT + NEIGHBOURS, shades, lanes, np.uint64(0), LIGHT, np.uint64(0))
    for number in range(shades.lights.shape[0]):
        _portable_add(n, number, shades, lanes, LIGHT, np.uint64(0))
    _portable(n, shades.numbers, lanes, LIGHT, np.uint64(0))


LIGHT_UP = {"vector": vector_light, "portable": portable_light}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("two_sided", [False, True])
def test_all_light_equals_the_twin_within_the_bound(two_sided, kind, rng):
    """Of gradients from the faintest on; lights that cast shadows count as far as these leave them."""
    volume = Volume(rng.integers(0, 256, (4, 5, 6)).astype(np.uint8), (0.7, 1.1, 1.6))
    lights = (*random_lights(rng, 12, 0.8), *random_lights(rng, 2, 0.3, shadows=True))
    lighting = Lighting(lights=lights, two_sided=two_sided, power=30.0)
    look, axes = Look(lighting, Modulation(0.0, 0.2, 0.0, 0.5)), [1, 2, 0]
    shade = shade_of(look, volume, axes, Classification.of(HAZE, volume))
    assert len(shade.lights) == 2
    largest, linear = largest_magnitude(volume), volume.world_from_object[:3, axes]
    shone = 0
    for _ in range(60):
        ray = tuple(np.float32(v) for v in (*rng.normal(size=3), rng.choice([-1, 1])))
        t = np.array([(ray[0] + lane * ray[1], *ray[2:]) for lane in range(TILE)], float)
        lanes = rng.random(int(LIGHT) + TILE * LIGHT_SECTIONS).astype(np.float32)
        lanes[int(LENGTH) : int(LENGTH) + TILE] = lengths = np.linalg.norm(t @ linear.T, axis=-1)
        slopes = lines(lanes, NEIGHBOURS, 3)
        slopes[:] = rng.normal(size=(3, TILE)) * 10.0 ** rng.uniform(-3, 1.8, TILE)
        slopes[:, 0], slopes[1, 1] = 0, np.nan
        given, left = slopes.astype(float), lines(lanes, LEFT)[0].copy()
        LIGHT_UP[kind](TILE, ray, shade, lanes)
        for lane in range(TILE):
            g = given[:, lane]
            g = world_from_differences(volume)[:, axes] @ (g if np.isfinite(g).all() else np.zeros(3))
            sight = -(linear @ t[lane]) / lengths[lane]
            tint = lit_twins.thickness(look.modulation, np.linalg.norm(g), largest)[1]
            parts_left = np.append(np.ones(12), np.repeat(left[lane], 2))
            factor, bright = lit_twins.phong(lighting, g, sight, FAINTEST * largest, tint, parts_left)
            lit, shine = (lines(lanes, at, 3)[:, lane] for at in (LIT_RED, SHINE_RED))
            off = np.abs(lit - factor).max() + np.abs(shine - bright).max()
            assert off < LARGEST_ERROR + 2 * PACKET_LIGHT
            shone += (bright > 0.005).any()
    assert shone > 50


# --- Pictures ----------------------------------------------------------------------------------------------


@pytest.fixture
def one_by_one(monkeypatch):
    """Turn maps off, until the end of the test or until they are turned on again."""

    def turn(off):
        monkeypatch.setattr(reflectance, "LIGHTS_THAT_PAY", inf if off else 8)

    return turn


PICTURES = {
    "two sides": Lighting(),
    "one side": Lighting(two_sided=False, power=60.0),
    "no highlights": Lighting(specular=0),
}


@pytest.mark.parametrize("preintegrated", [False, True])
@pytest.mark.parametrize("name", PICTURES)
def test_pictures_differ_from_lights_one_by_one_within_the_bound(name, preintegrated, one_by_one, rng):
    volume = smooth_volume((20, 20, 20))
    lighting = replace(PICTURES[name], lights=random_lights(rng, 12), headlight=0.2)
    assert reflectance_of(lighting) is not None
    view = view_of(volume, DIRECTIONS[1], size=(64, 48))
    found = {}
    for off in (False, True):
        one_by_one(off)
        image = rendered(volume, HAZE, view, Look(lighting), preintegrated=preintegrated)
        found[off] = image.pixels
    assert found[True][..., :3].max() > 0.3
    difference = np.abs(found[False] - found[True])
    assert 1e-6 < difference[..., :3].max() < LARGEST_ERROR + FLOAT32_LIT
    assert not difference[..., 3].any()


def test_shadows_are_those_of_lights_one_by_one(one_by_one, rng):
    volume = smooth_volume((20, 20, 20))
    casting = (
        Light((1, 2, 3), (0.8, 0.7, 0.3), shadows=True),
        Light((-1, 0, 1), (0.2, 0.2, 0.5), shadows=True),
    )
    lights = (casting[0], *random_lights(rng, 10, 0.4), casting[1])
    view = view_of(volume, DIRECTIONS[1], size=(64, 48))
    found = {}
    for off in (False, True):
        one_by_one(off)
        found[off] = rendered(volume, HAZE, view, Look(Lighting(lights=lights))).pixels
    without = tuple(replace(light, shadows=False) for light in lights)
    unshadowed = rendered(volume, HAZE, view, Look(Lighting(lights=without))).pixels
    assert 1e-6 < np.abs(found[False] - found[True]).max() < LARGEST_ERROR + FLOAT32_LIT
    assert np.abs(unshadowed - found[True]).max() > 0.05


def test_few_lights_are_not_touched(one_by_one, rng):
    volume = smooth_volume()
    view, look = view_of(volume, DIRECTIONS[1]), Look(Lighting(lights=random_lights(rng, 7)))
    pictures = []
    for off in (False, True):
        one_by_one(off)
        pictures.append(rendered(volume, HAZE, view, look).pixels)
    np.testing.assert_array_equal(*pictures)


def test_maps_are_made_when_lights_change_and_not_when_the_view_does(rng):
    volume = smooth_volume()
    lighting = Lighting(lights=random_lights(rng, 9))
    renderer = Renderer(volume, HAZE, look=Look(lighting))

    def made(**view):
        before = built.cache_info().misses
        renderer.render(View.look_at(**{"eye": (30, 9, 4), "centre": volume.centre, "up": (0, 0, 1),
                                        "fovy_deg": 30.0, "size": (24, 16), **view}))  # fmt: skip
        return built.cache_info().misses - before

    assert made() == 1
    for eye in [(-30, 5, 4), (4, 40, 4), (5, 6, -35)]:  # along all three axes
        assert made(eye=eye) == 0
    assert made(size=(32, 20), fovy_deg=40.0) == 0
    renderer.look = Look(replace(lighting, ambient=0.5, headlight=0.0, two_sided=False), Modulation())
    assert made() == 0
    for change in ({"diffuse": 0.5}, {"specular": 0.1}, {"power": 9.0}, {"lights": random_lights(rng, 9)}):
        renderer.look = Look(replace(lighting, **change))
        assert made() == 1
