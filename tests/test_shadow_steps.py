"""Light that grazes hard surfaces: no steps from voxel to voxel; and what their voxels are lit by."""

from __future__ import annotations

from dataclasses import replace

import lit_twins
import numpy as np
import pytest
from test_shadows import WHITE, lit_from, parts
from tolerances import SHADOW_GRAZED, SHADOW_STEP, SHADOW_SWEEP
from views import direction

from persp_sw import Light, Lighting, Regions, Renderer, Settings, TransferFunction, View, Volume
from persp_sw.kernels import attenuate
from persp_sw.optics.classification2d import classify
from persp_sw.optics.shadows import Shadows

OPAQUE = TransferFunction([(127, WHITE, 0), (130, WHITE, 1)], 0.5)
RADIUS, OFFSET = 14.0, 2.0
LIGHTS = [direction(1, 0, 0), direction(1, 0.2, 0.3), direction(1, 0.9, 0.8), direction(0.5, 1, 0.1)]
SHAPES = {
    "even": ((40, 40, 40), (1.0, 1.0, 1.0)),
    "uneven": ((40, 32, 22), (1.0, 1.3, 2.0)),
    "coarser": ((162, 36, 36), (1.0, 1.0, 1.0)),
}


def hard_ball(name):
    size, spacing = SHAPES[name]
    z, y, x = (axis * step for axis, step in zip(np.indices(size[::-1]), spacing[::-1], strict=True))
    middle = (np.array(size) - 1) / 2 * spacing
    distance = np.sqrt((x - middle[0]) ** 2 + (y - middle[1]) ** 2 + (z - middle[2]) ** 2)
    return Volume(np.clip(np.round(128 + 40 * (RADIUS - distance)), 0, 255).astype(np.uint8), spacing=spacing)


def down_to_the_terminator(volume, light):
    """Diffuse light on 24 great circles of the ball, from where it is brightest to its end, and the truth."""
    shadows = Shadows(volume, classify(OPAQUE, volume), lit_from(light), Regions())
    aside = np.cross(light, direction(0.3, 0.5, 1.0))
    aside /= np.linalg.norm(aside)
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None, None]
    down = np.linspace(0, np.pi / 2, 91)[:, None]
    out = np.cos(around) * aside + np.sin(around) * np.cross(light, aside)
    normals = np.cos(down) * light + np.sin(down) * out
    places = volume.centre + RADIUS * normals + OFFSET * min(volume.spacing) * shadows.factor * light
    places = (places / volume.spacing / shadows.factor).reshape(-1, 3)
    left = np.array([lit_twins.trilinear(parts(shadows)[0], place) for place in places])
    return np.cos(down[:, 0]) * left.reshape(24, 91), np.cos(down[:, 0])


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("name", SHAPES)
def test_light_fades_towards_the_terminator_without_steps(name, light):
    """Nothing is in its way, so that it falls with the cosine; away from the light it may not rise again."""
    found, truth = down_to_the_terminator(hard_ball(name), light)
    lowest = np.minimum.accumulate(found, axis=1)
    assert (found - lowest).max() < SHADOW_STEP
    assert np.sqrt(np.mean((found - truth) ** 2)) < SHADOW_GRAZED


@pytest.mark.parametrize("name", SHAPES)
def test_pictures_of_a_ball_show_no_shadow_on_its_lit_side(name):
    """Quality 1, the default offset: what is seen is off the surface by up to half a slice, too."""
    volume, light = hard_ball(name), LIGHTS[1]
    view = View.look_at(volume.centre + (20, -90, 25), volume.centre, (0, 0, 1), 22, (96, 96))
    look = lit_from(light, ambient=0.1, diffuse=0.9, specular=0.0, shadow_offset=Lighting().shadow_offset)
    unshadowed = replace(look, lighting=replace(look.lighting, lights=(Light(light),)))
    image, plain = (Renderer(volume, OPAQUE, Settings(), look=one).render(view) for one in (look, unshadowed))
    off = np.linalg.norm(np.indices((96, 96)) - 47.5, axis=0)
    ball = off < 0.85 * np.sqrt(
        (plain[..., 3] > 0.5).sum() / np.pi
    )  # no silhouettes: normals turn over there
    assert ball.sum() > 1500 and plain[ball][:, 0].max() > 0.8 and plain[ball][:, 0].min() < 0.12
    assert np.sqrt(np.mean((image - plain)[ball][:, 0] ** 2)) < SHADOW_GRAZED


def beside(left, passing):
    out = np.full(left.shape, np.nan, np.float32)
    attenuate.light_beside(left, passing, out)
    return out


@pytest.mark.parametrize("shape", [(5, 6, 7), (2, 3, 2), (1, 4, 5)])
def test_light_from_beside_equals_its_twin(shape, rng):
    left = rng.random(shape, np.float32)
    for passing in (rng.random(shape), rng.random(shape).round(), rng.random(shape) ** 8):
        passing = passing.astype(np.float32)
        found = beside(left, passing)
        np.testing.assert_allclose(
            found, lit_twins.beside(left.astype(float), passing), rtol=0, atol=SHADOW_SWEEP
        )
        assert np.abs(found - left).max() > 0.01
        np.testing.assert_array_equal(found[passing == passing.max()], left[passing == passing.max()])


def test_where_extinction_is_the_same_light_stays():
    left = np.linspace(1, 0, 120, dtype=np.float32).reshape(4, 5, 6)
    for passing in (0.0, 0.3, 1.0):
        np.testing.assert_array_equal(beside(left, np.full(left.shape, passing, np.float32)), left)


def test_walls_keep_light_to_their_outermost_voxels():
    """Of three voxels in a row the middle one stays dark, and so does what lies behind."""
    left = np.zeros((9, 6, 6), np.float32)
    left[:3] = 1
    passing = np.ones_like(left)
    passing[3:6] = 0
    np.testing.assert_array_equal(beside(left, passing)[:, 2, 2], [1, 1, 1, 1, 0, 0, 0, 0, 0])
