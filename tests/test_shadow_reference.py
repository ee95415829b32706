"""The reference's shadows against closed forms, geometry, and a plain-numpy twin."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from test_lit_reference import LIGHTS, MODULATION, interpolated, phong
from test_reference import KINKS, STEPS, largest, noise, pose_of, view_of
from tolerances import LIT_AT_1E_9, LIT_SURFACE, MIDPOINT_SHADOW, SHADOW_EDGE

from persp_sw import reference
from persp_sw.geometry.regions import Cut, Regions
from persp_sw.geometry.view import View
from persp_sw.optics.lighting import Light, Lighting
from persp_sw.optics.look import Look, Modulation
from persp_sw.optics.transfer import TransferFunction
from persp_sw.optics.transfer2d import Box, TransferFunction2D
from persp_sw.volume.gradient import FAINTEST, largest_magnitude
from persp_sw.volume.grid import Volume

COLOUR, TAU = (0.9, 0.6, 0.3), 0.2
HAZE = TransferFunction([(0, COLOUR, -np.expm1(-TAU))], 1.0)  # the same extinction at every value
SLOPING = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)  # the gradient's direction, world


def haze(spacing=(1.0, 1.0, 1.0)):
    """Extinction everywhere the same, and one normal, −SLOPING, everywhere."""
    size = (np.array([12, 6, 10]) / spacing).astype(int) + 1
    z, _, x = np.indices(size[::-1])
    return Volume((x * spacing[0] + z * spacing[2]).astype(np.float32), spacing)


def haze_view(size=(8, 4)):
    """Along +z, 9 by 4.5 wide about x = 6; x of its pixels' columns."""
    view = View.parallel((6, 2.5, -50), (6, 2.5, 0), (0, 1, 0), 4.5, size)
    return view, view.starts()[0, :, 0]


def cosine(volume, towards):
    epsilon = FAINTEST * largest_magnitude(volume)
    return -SLOPING @ towards * np.sqrt(2) / np.sqrt(2 + epsilon**2)


def matt(towards, shadows=True):
    light = Light(tuple(towards), shadows=shadows)
    return Look(Lighting(0.25, 0.8, 0.0, headlight=0, lights=(light,), two_sided=False, shadow_offset=0))


def lit_haze(volume, towards, depths):
    """∫ τ e^(−τ z) (0.25 + 0.8 N·L e^(−τ d(z))) dz over 10 units of the ray; d at (x, z)."""
    z = np.polynomial.legendre.leggauss(60)
    _, x = haze_view()
    total = 0
    breaks = np.unique(np.concatenate([[0, 10], x[(x > 0) & (x < 10)], [3, 4, 7]]))  # where d may bend
    for low, high in pairwise(breaks):
        place = 0.5 * (low + high) + 0.5 * (high - low) * z[0]
        weight = 0.5 * (high - low) * z[1] * TAU * np.exp(-TAU * place)
        shadow = np.exp(-TAU * depths(x[:, None], place))
        total = total + (weight * (0.25 + 0.8 * cosine(volume, towards) * shadow)).sum(-1)
    return total[:, None] * COLOUR


@pytest.mark.parametrize("spacing", [(1, 1, 1), (0.5, 1, 2)])
@pytest.mark.parametrize(
    ("towards", "depths"),
    [
        ((-1, 0, 0), lambda x, z: x + 0 * z),  # across the rays: one distance along each
        ((0, 0, -1), lambda x, z: z + 0 * x),  # along them
        ((-1, 0, -1), lambda x, z: np.sqrt(2) * np.minimum(x, z)),
    ],
)
def test_a_homogeneous_medium(towards, depths, spacing):
    volume, (view, _) = haze(spacing), haze_view()
    towards = np.array(towards) / np.linalg.norm(towards)
    image = reference.render(volume, HAZE, view, look=matt(towards), tolerance=1e-9)
    truth = lit_haze(volume, towards, depths)
    unshadowed = reference.render(volume, HAZE, view, look=matt(towards, False), tolerance=1e-9)
    assert largest(image - unshadowed) > 0.05
    assert largest(image[..., :3] - truth) < LIT_AT_1E_9


@pytest.mark.parametrize(
    ("shown", "hidden"),
    [
        # Light comes along −x; each hides what lies between x = 1 and 3 of the light's way.
        (Regions(cut=[Cut((1, 0, 0, -2), 2, "outside")]), lambda x: np.clip(x - 1, 0, 2)),
        (Regions((1, 3, -1, 99, -1, 99), crop_flags=((1 << 27) - 1) & ~sum(1 << 1 + 3 * n for n in range(9))),
         lambda x: np.clip(x - 1, 0, 2)),
        (Regions(clip=[(1, 0, 0, -3)]), lambda x: np.minimum(x, 3)),
        (Regions((3, 99, -1, 99, -1, 99)), lambda x: np.minimum(x, 3)),
    ],
)  # fmt: skip
def test_what_is_cut_away_casts_no_shadow(shown, hidden):
    volume, (view, x) = haze(), haze_view()
    look = matt((-1, 0, 0))
    image = reference.render(volume, HAZE, view, regions=shown, look=look, tolerance=1e-9)
    seen = image[0, :, 3] > 0
    truth = lit_haze(volume, np.array([-1.0, 0, 0]), lambda x, z: x - hidden(x) + 0 * z)
    assert seen.sum() > 4 and (hidden(x)[seen] > 0).any()
    assert largest((image[..., :3] - truth)[:, seen]) < LIT_AT_1E_9


def test_the_near_distance_hides_from_the_eye_only():
    volume = haze()
    eye, centre = (6, 2.5, -20), (6, 2.5, 0)
    whole, part = (
        reference.render(
            volume, HAZE, View.look_at(eye, centre, (0, 1, 0), 8, (5, 3), near), look=matt((0, 0, -1))
        )
        for near in (0.0, 26.0)
    )
    # The middle ray: 4 of its 10 units are left, whose shadows still begin at z = 0.
    shadow = cosine(volume, np.array([0, 0, -1])) * np.exp(-TAU * 6) * -np.expm1(-2 * TAU * 4) / 2
    expected = 0.25 * -np.expm1(-TAU * 4) + 0.8 * shadow
    assert abs(part[1, 2, 0] - 0.9 * expected) < 1e-5 < largest(whole - part)


def test_the_headlight_casts_none():
    volume = noise()
    view = view_of(volume, "front")
    lighting = Lighting(lights=(), headlight=0.7, shadow_offset=0)
    parallel = View.parallel(view.eye.position, volume.centre, (0, 1, 0), 12, (16, 12))
    at_the_eye = tuple(parallel.eye.position)
    alone = reference.render(volume, STEPS, parallel, look=Look(lighting), tolerance=1e-9)
    images = [
        reference.render(
            volume,
            STEPS,
            parallel,
            look=Look(replace(lighting, headlight=0.0, lights=(Light(at_the_eye, (0.7,) * 3, shadows),))),
            tolerance=1e-9 if not shadows else 1e-4,
        )
        for shadows in (False, True)
    ]
    assert largest(alone - images[0]) < LIT_AT_1E_9
    assert largest(alone - images[1]) > 0.02


# --- a ball over a plane -----------------------------------------------------------------------------------

BALL, BALL_RADIUS, PLANE = np.array([14.0, 11.0, 12.0]), 4.0, 3.25
SUN = np.array([1.0, 0.2, 1.6]) / np.linalg.norm([1.0, 0.2, 1.6])


def ball_over_plane():
    z, y, x = np.indices((20, 23, 24))
    distance = np.sqrt((x - BALL[0]) ** 2 + (y - BALL[1]) ** 2 + (z - BALL[2]) ** 2)
    return Volume(np.maximum(BALL_RADIUS - distance, PLANE - z).astype(np.float32))


def seen_from_above(**changes):
    """The picture from above, where its rays meet the plane, and which rays pass the ball."""
    volume = ball_over_plane()
    opaque = TransferFunction([(-1, COLOUR, 0), (0, COLOUR, 0), (0, COLOUR, 1)], 1e-4)
    view = View.parallel((11.5, 11, 60), (11.5, 11, 0), (0, 1, 0), 20, (48, 48))
    look = Look(
        Lighting(0.2, 0.8, 0.0, headlight=0, lights=(Light(tuple(SUN), shadows=True),), shadow_offset=0)
    )
    image = reference.render(volume, opaque, view, look=look, tolerance=1e-4, **changes)
    places = view.starts() * (1, 1, 0) + (0, 0, PLANE)
    beside = np.hypot(*(places - BALL)[..., :2].transpose(2, 0, 1)) > BALL_RADIUS + 0.2
    normal = 1 / np.sqrt(1 + (FAINTEST * largest_magnitude(volume)) ** 2)
    # A layer without end, seen along its normal: ∫ e^(−t) e^(−t / cos) dt of the light comes through to it.
    lit = 0.2 + 0.8 * normal * SUN[2] * SUN[2] / (SUN[2] + 1)
    return image, places, beside, lit


def test_a_ball_darkens_the_plane_below_it_where_geometry_says():
    image, places, beside, lit = seen_from_above()
    away = places - BALL
    off = np.linalg.norm(away - (away @ SUN)[..., None] * SUN, axis=-1)  # light's line from the ball's middle
    dark, bright = beside & (off < BALL_RADIUS - SHADOW_EDGE), beside & (off > BALL_RADIUS + SHADOW_EDGE)
    inner = np.abs(places - (11.5, 11, PLANE)).max(-1) < 9  # all in the picture; far from the volume's faces
    assert dark.sum() > 80 and (bright & inner).sum() > 800
    assert largest(image[dark][:, :3] - 0.2 * np.array(COLOUR)) < 1e-3
    assert largest(image[bright & inner][:, :3] - lit * np.array(COLOUR)) < LIT_SURFACE + 1e-4
    edge = beside & ~dark & ~bright
    between = image[edge][:, 0] / COLOUR[0]
    assert edge.any() and (between > 0.2 - 1e-3).all() and (between < lit + 1e-3).all()


def test_a_ball_that_is_cut_away_casts_no_shadow():
    image, _, _, lit = seen_from_above(regions=Regions(clip=[(0, 0, -1, 6)]))
    assert largest(image[..., :3] - lit * np.array(COLOUR)) < LIT_SURFACE + 1e-4


# --- a plain-numpy twin ------------------------------------------------------------------------------------


def extinction_and_colour(volume, transfer, look, points):
    value = interpolated(volume, points)
    gradient = reference.gradients(volume, points, look.gradient_distance)
    magnitude = np.linalg.norm(gradient, axis=-1)
    if isinstance(transfer, TransferFunction2D):
        extinction, colour = transfer.extinction(value, magnitude), transfer.colour(value, magnitude)
    else:
        extinction, colour = transfer.extinction(value), transfer.colour(value)
    bound = largest_magnitude(volume, look.gradient_distance)
    if m := look.modulation:
        weight = np.clip((magnitude / bound - m.low) / (m.high - m.low), 0, 1)
        extinction = extinction * (1 - m.opacity + m.opacity * weight)
        colour = colour * (1 - m.colour + m.colour * weight)[..., None]
    return extinction, colour, -gradient / np.sqrt(magnitude**2 + (FAINTEST * bound) ** 2)[..., None]


def span(volume, points, direction):
    """Distances at which lines enter and leave the volume."""
    inverse = np.linalg.inv(volume.world_from_object)
    start, step = points @ inverse[:3, :3].T + inverse[:3, 3], inverse[:3, :3] @ direction
    with np.errstate(divide="ignore"):
        faces = np.array([(0 - start) / step, (np.array(volume.size) - 1 - start) / step])
    return faces.min(0).max(-1), faces.max(0).min(-1)


def midpoint_pixel(volume, transfer, look, view, row, column, count, shadow_count):
    direction = view.directions()[row, column]
    direction = direction / np.linalg.norm(direction)
    near, far = span(volume, view.eye.position[None], direction)
    step = (far - near) / count
    points = view.eye.position + (near + (np.arange(count)[:, None] + 0.5) * step) * direction
    extinction, colour, normal = extinction_and_colour(volume, transfer, look, points)
    sight = np.broadcast_to(-direction, points.shape)
    lighting = look.lighting
    none = replace(lighting, lights=(), headlight=0.0)
    shine = phong(replace(lighting, lights=()), colour, normal, sight)
    dark = phong(none, colour, normal, sight)
    for light in lighting.lights:
        left = np.ones(count)
        if light.shadows:
            towards = np.array(light.direction)
            starts = points + lighting.shadow_offset * min(volume.spacing) * towards
            out = np.maximum(span(volume, starts, towards)[1], 0)  # 0 where the way begins outside
            part = (np.arange(shadow_count) + 0.5) / shadow_count
            places = starts[:, None] + (out[:, None] * part)[..., None] * towards
            depth = extinction_and_colour(volume, transfer, look, places.reshape(-1, 3))[0]
            left = np.exp(-(depth.reshape(count, -1).sum(-1) * out / shadow_count))
        lit = phong(replace(none, lights=(light,)), colour, normal, sight)
        shine = shine + (lit - dark) * left[:, None]
    depth = extinction * step
    before = np.exp(-(np.cumsum(depth) - depth))
    return ((before * -np.expm1(-depth))[:, None] * shine).sum(0)


SOFT = TransferFunction2D([Box((40, 220), (0, 110), (1, 0.5, 0.2), 0.3, 1.0)], 1.0)


@pytest.mark.parametrize(
    ("transfer", "modulation", "distance", "pose", "offset"),
    [
        (KINKS, None, 1.0, "sheared", 1.7),
        (KINKS, Modulation(0.0, 0.5, 0.9), 1.5, "mirrored", 0.0),
        (SOFT, None, 1.0, "rotated", 2.0),
    ],
)
def test_numpy_twin(transfer, modulation, distance, pose, offset):
    volume = Volume(noise().data, world_from_object=pose_of(pose))
    lights = (replace(LIGHTS[0], shadows=True), LIGHTS[1], replace(LIGHTS[2], shadows=True))
    lighting = Lighting(lights=lights, headlight=0.2, power=8, shadow_offset=offset)
    look = Look(lighting, modulation, distance)
    view = view_of(volume, "corner", (8, 6))
    image = reference.render(volume, transfer, view, look=look, tolerance=1e-4)
    unshadowed = replace(look, lighting=replace(look.lighting, lights=LIGHTS))
    assert largest(image - reference.render(volume, transfer, view, look=unshadowed, tolerance=1e-4)) > 0.05
    for row, column in [(3, 4), (2, 3)]:
        twin = midpoint_pixel(volume, transfer, look, view, row, column, 400, 120)
        assert largest(image[row, column, :3] - twin) < MIDPOINT_SHADOW


@pytest.mark.parametrize(("transfer", "modulation"), [(STEPS, None), (KINKS, MODULATION), (SOFT, None)])
def test_a_tenth_of_the_tolerance_changes_less_than_the_tolerance(transfer, modulation):
    volume = noise()
    view = view_of(volume, "front", (8, 6))
    look = Look(Lighting(lights=(replace(LIGHTS[0], shadows=True),), shadow_offset=0), modulation)
    images = [reference.render(volume, transfer, view, look=look, tolerance=t) for t in (3e-3, 3e-4)]
    assert largest(images[0] - images[1]) < 3e-3
