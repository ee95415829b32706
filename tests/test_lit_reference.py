"""The lit reference against closed forms, a plain-numpy twin, and relations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_reference import KINKS, SIZE, STEPS, largest, noise, view_of
from tolerances import LIT_AT_1E_9, LIT_SURFACE, MIDPOINT_LIT, ROUNDING

from persp_sw import reference
from persp_sw.geometry.view import View
from persp_sw.optics.lighting import Light, Lighting
from persp_sw.optics.look import Look, Modulation
from persp_sw.optics.transfer import TransferFunction
from persp_sw.optics.transfer2d import Box, TransferFunction2D, Triangle
from persp_sw.volume.gradient import FAINTEST, largest_magnitude, world_from_differences
from persp_sw.volume.grid import Volume

LIGHTS = (Light((1, 2, -3), (0.9, 0.3, 0.2)), Light((-2, 1, -1), (0.1, 0.5, 1.0)), Light((0.2, -1, 3)))
MODULATION = Modulation(0.05, 0.3, opacity=0.8, colour=0.6)
LOOKS = {
    "headlight": Look(Lighting()),
    "lights": Look(Lighting(headlight=0.3, lights=LIGHTS, emissive=0.1)),
    "one side": Look(Lighting(lights=LIGHTS[:1], two_sided=False, power=5)),
    "blinn": Look(Lighting(lights=LIGHTS, model="blinn", power=30)),
    "modulated": Look(None, MODULATION),
    "both, wide": Look(Lighting(lights=LIGHTS[1:]), MODULATION, 1.5),
}
SHAPES = TransferFunction2D(
    [
        Box((60, 150), (20, 70), (1, 0.5, 0.2), 0.3, 0.0),
        Box((100, 240), (0, 90), (0.2, 0.5, 1), 0.05, 0.3),
        Triangle(120, (5, 110), 60, (0, 1, 1), 0.4, 0.0),
        Triangle(180, (10, 90), 60, (1, 1, 0), 0.4, 0.8),
    ],
    1.0,
)


# --- closed forms ------------------------------------------------------------------------------------------

TURN = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
BALLS = {  # linear parts of poses whose squares of lengths are whole numbers
    "plain": np.eye(3),
    "anisotropic": np.diag([1.0, 1.0, 2.0]),
    "mirrored": np.diag([1.0, -1.0, 1.0]),
    "turned": TURN * np.sign(np.linalg.det(TURN)) @ np.diag([1.0, 2.0, 1.0]),
    "sheared": np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 2.0]]),
}
RADIUS = 8.0


def ball(name, inverted=False):
    """−|p|² in world units about its middle voxel: its gradient, −2p, central differences have exactly."""
    linear = BALLS[name]
    half = np.ceil((RADIUS + 2) / np.linalg.svd(linear)[1].min()).astype(int)
    half = np.minimum(half, np.ceil((RADIUS + 2) * np.linalg.norm(np.linalg.inv(linear), axis=1)).astype(int))
    z, y, x = np.indices(2 * half[::-1] + 1)
    places = (np.stack([x, y, z], -1) - half) @ linear.T
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = linear, -linear @ half
    square = np.rint((places**2).sum(-1)).astype(np.float32)
    return Volume(square if inverted else -square, world_from_object=pose)


def interpolated(volume, points):
    """Trilinear, at world points."""
    inverse = np.linalg.inv(volume.world_from_object)
    places = points @ inverse[:3, :3].T + inverse[:3, 3]
    cell = np.clip(np.floor(places).astype(int), 0, np.array(volume.size) - 2)
    part, value = places - cell, 0.0
    for corner in np.ndindex(2, 2, 2):
        x, y, z = np.moveaxis(cell + corner, -1, 0)
        value = value + np.prod(np.where(corner, part, 1 - part), -1) * volume.data[z, y, x]
    return value


def hits(volume, view, level):
    """World points where the rays of a ball's picture first meet a level, and which do: in from outside."""
    directions = view.directions().reshape(-1, 3)
    directions = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    eye = view.eye.position
    nearest = eye + (-(directions @ eye))[:, None] * directions  # to the middle, the origin
    far = np.zeros(len(directions))
    near = -np.sqrt(np.maximum((RADIUS + 1) ** 2 - (nearest**2).sum(-1), 0))
    meets = interpolated(volume, nearest) > level
    for _ in range(60):
        middle = 0.5 * (near + far)
        inside = interpolated(volume, nearest + middle[:, None] * directions) > level
        near, far = np.where(inside, near, middle), np.where(inside, middle, far)
    return nearest + far[:, None] * directions, meets, -directions


def phong(lighting, colour, normal, sight):
    """Word for word as the docstring of `Lighting`."""
    if lighting.two_sided:
        normal = np.where((normal * sight).sum(-1, keepdims=True) < 0, -normal, normal)
    lights = [(np.broadcast_to(light.direction, sight.shape), light.colour) for light in lighting.lights]
    light = (lighting.emissive + lighting.ambient) * np.ones_like(normal)
    gloss = np.zeros_like(normal)
    for towards, shine in [*lights, (sight, lighting.headlight)]:
        cosine = (normal * towards).sum(-1, keepdims=True)
        if lighting.model == "blinn":
            half = towards + sight
            glance = (normal * half).sum(-1, keepdims=True) / np.linalg.norm(half, axis=-1, keepdims=True)
        else:
            mirrored = 2 * (normal * sight).sum(-1, keepdims=True) * normal
            mirrored = mirrored - (normal**2).sum(-1, keepdims=True) * sight
            glance = (mirrored * towards).sum(-1, keepdims=True)
        light = light + lighting.diffuse * np.array(shine) * np.maximum(cosine, 0)
        glance = np.where((normal * sight).sum(-1, keepdims=True) > 0, glance, 0)
        gloss = gloss + lighting.specular * np.array(shine) * np.maximum(glance, 0) ** lighting.power
    return light * colour + gloss


@pytest.mark.parametrize("pose", BALLS)
@pytest.mark.parametrize("look", ["headlight", "lights", "one side", "blinn"])
def test_phong_on_a_ball(look, pose):
    volume, look, colour = ball(pose), LOOKS[look], (0.9, 0.6, 0.3)
    level = -(RADIUS**2)
    opaque = TransferFunction([(level - 1, colour, 0), (level, colour, 0), (level, colour, 1)], 1e-4)
    view = View.look_at((9, 14, -30), (0, 0, 0), (0, 1, 0), 32, (24, 24))
    image = reference.render(volume, opaque, view, look=look, tolerance=1e-6)
    points, meets, sight = hits(volume, view, level)
    length = 2 * np.linalg.norm(points, axis=-1, keepdims=True)
    epsilon = FAINTEST * largest_magnitude(volume)
    normal = 2 * points / np.sqrt(length**2 + epsilon**2)
    steep = meets & ((normal * sight).sum(-1) > 0.05)  # elsewhere the layer of 1e-5 is not one place
    truth = phong(look.lighting, colour, normal, sight)[steep]
    found = image.reshape(-1, 4)[steep]
    assert steep.sum() > 150 and (found[:, 3] > 1 - 1e-9).all()
    assert np.ptp(truth, axis=0).min() > 0.2
    assert largest(found[:, :3] - truth) < LIT_SURFACE
    # The level of the interpolated ball lies up to ¾ · h² / 2R from the sphere, h the longest edge.
    off = np.abs(np.linalg.norm(points[steep], axis=-1) - RADIUS)
    assert off.max() < 0.75 * 4 * 2 / (2 * RADIUS)


@pytest.mark.parametrize("two_sided", [False, True])
def test_a_shell_from_within_is_lit_only_if_two_sided(two_sided):
    volume, colour = ball("plain"), (0.5, 0.5, 0.5)
    rows = [(-(RADIUS**2) - 1, 0), (-(RADIUS**2), 0), (-(RADIUS**2), 1), (-(RADIUS**2) + 1, 1)]
    rows += [(-(RADIUS**2) + 1, 0)]
    shell = TransferFunction([(value, colour, a) for value, a in rows], 1e-4)
    view = View.look_at((0, 0, 0), (0.2, 0.3, 1), (0, 1, 0), 60, (8, 8))
    lighting = Lighting(0.1, 0.8, 0.0, headlight=1.0, two_sided=two_sided)
    image = reference.render(volume, shell, view, look=Look(lighting), tolerance=1e-6)
    sight = -view.directions() / np.linalg.norm(view.directions(), axis=-1, keepdims=True)
    cosine = 2 * RADIUS / np.sqrt(4 * RADIUS**2 + (FAINTEST * largest_magnitude(volume)) ** 2)
    assert np.abs(np.linalg.norm(sight, axis=-1) - 1).max() < 1e-12  # normals from the centre run along rays
    expected = 0.5 * (0.1 + (0.8 * cosine if two_sided else 0))
    assert largest(image[..., :3] - expected) < LIT_SURFACE


def test_a_flat_place_is_not_lit_and_no_light_behind_shines_through_it():
    flat = Volume(np.full((6, 6, 6), 7, np.uint8))
    function = TransferFunction([(7, (0.8, 0.4, 0.2), 0.3)], 1.0)
    view = view_of(flat, "corner")
    behind = Light(view.direction_from_pixel @ (12, 9, 1))
    look = Look(Lighting(0.25, 0.8, 0.9, lights=(behind,)), Modulation(opacity=0.0, colour=0.5))
    image = reference.render(flat, function, view, look=look)
    plain = reference.render(flat, function, view)
    assert plain[..., 3].max() > 0.5
    np.testing.assert_allclose(image[..., :3], 0.25 * 0.5 * plain[..., :3], atol=ROUNDING)
    assert largest(image[..., 3] - plain[..., 3]) < ROUNDING


# --- a plain-numpy twin ------------------------------------------------------------------------------------


def midpoint_pixel(volume, transfer, look, view, row, column, count):
    """One pixel by a midpoint sum: slow, and word for word as the docstrings."""
    inverse = np.linalg.inv(volume.world_from_object)
    direction = view.directions()[row, column]
    direction = direction / np.linalg.norm(direction)
    start = inverse @ np.append(view.eye.position, 1)
    faces = np.array([0 - start[:3], np.array(volume.size) - 1 - start[:3]]) / (inverse[:3, :3] @ direction)
    near, far = faces.min(0).max(), faces.max(0).min()
    distance, step = np.linspace(near, far, count, endpoint=False, retstep=True)
    points = view.eye.position + (distance + step / 2)[:, None] * direction
    value = interpolated(volume, points)
    gradient = reference.gradients(volume, points, look.gradient_distance)
    magnitude = np.linalg.norm(gradient, axis=-1)
    if isinstance(transfer, TransferFunction2D):
        depth, colour = transfer.extinction(value, magnitude) * step, transfer.colour(value, magnitude)
    else:
        depth, colour = transfer.extinction(value) * step, transfer.colour(value)
    bound = largest_magnitude(volume, look.gradient_distance)
    if m := look.modulation:
        weight = np.clip((magnitude / bound - m.low) / (m.high - m.low), 0, 1)
        depth = depth * (1 - m.opacity + m.opacity * weight)
        colour = colour * (1 - m.colour + m.colour * weight)[:, None]
    if look.lighting:
        normal = -gradient / np.sqrt(magnitude**2 + (FAINTEST * bound) ** 2)[:, None]
        colour = phong(look.lighting, colour, normal, np.broadcast_to(-direction, normal.shape))
    before = np.exp(-(np.cumsum(depth) - depth))
    rgb = ((before * -np.expm1(-depth))[:, None] * colour).sum(0)
    return np.append(rgb, -np.expm1(-depth.sum()))


@pytest.mark.parametrize("eye", ["front", "corner"])
@pytest.mark.parametrize(
    ("look", "transfer"),
    [*((name, STEPS) for name in LOOKS), ("lights", KINKS), ("headlight", SHAPES), ("both, wide", SHAPES)],
)
def test_numpy_twin(look, transfer, eye):
    volume, look = noise(), LOOKS[look]
    view = view_of(volume, eye)
    image = reference.render(volume, transfer, view, look=look, tolerance=1e-7)
    for row, column in [(9, 12), (5, 9), (11, 15), (8, 14)]:
        twin = midpoint_pixel(volume, transfer, look, view, row, column, 100_000)
        assert twin[3] > 0.02
        assert largest(image[row, column] - twin) < MIDPOINT_LIT


def test_a_2d_function_without_a_look():
    volume = noise()
    view = view_of(volume, "corner")
    image = reference.render(volume, SHAPES, view, tolerance=1e-7)
    for row, column in [(9, 12), (5, 9)]:
        twin = midpoint_pixel(volume, SHAPES, Look(), view, row, column, 100_000)
        assert largest(image[row, column] - twin) < MIDPOINT_LIT


# --- relations ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("transfer", [STEPS, KINKS])
@pytest.mark.parametrize("eye", ["front", "inside"])
@pytest.mark.parametrize(
    "look",
    [
        Look(),
        Look(Lighting(1.0, 0.0, 0.0)),
        Look(Lighting(0.0, 0.0, 0.0, emissive=1.0)),
        Look(Lighting(1.0, headlight=0)),
        Look(None, Modulation(opacity=0.0)),
        Look(None, Modulation(opacity=0.0), 1.3),
    ],
)
def test_looks_that_change_nothing(look, eye, transfer):
    volume = noise()
    view = view_of(volume, eye)
    plain = reference.render(volume, transfer, view, tolerance=1e-9)
    image = reference.render(volume, transfer, view, look=look, tolerance=1e-9)
    assert largest(image - plain) < (LIT_AT_1E_9 if not look.is_plain else 1e-300)


@pytest.mark.parametrize("look", ["lights", "one side", "blinn", "both, wide"])
def test_lights_turned_with_volume_and_eye_give_the_same_picture(look):
    volume, look = noise(), LOOKS[look]
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, (3, -5, 7)
    turned = Volume(volume.data, world_from_object=pose @ volume.world_from_object)
    lights = tuple(replace(light, direction=tuple(turn @ light.direction)) for light in look.lighting.lights)
    other = replace(look, lighting=replace(look.lighting, lights=lights))
    eye, centre, up = np.array([12.0, 9, -14]), np.array([4.0, 4, 3]), np.array([0.0, 1, 0])
    view = View.look_at(eye, centre, up, 40, SIZE)
    again = View.look_at(pose[:3] @ [*eye, 1], pose[:3] @ [*centre, 1], turn @ up, 40, SIZE)
    image = reference.render(volume, STEPS, view, look=look, tolerance=1e-9)
    assert largest(image - reference.render(turned, STEPS, again, look=other, tolerance=1e-9)) < LIT_AT_1E_9
    unturned = reference.render(turned, STEPS, again, look=look, tolerance=1e-4)
    assert largest(image - unturned) > 0.01


@pytest.mark.parametrize("look", ["lights", "both, wide"])
@pytest.mark.parametrize("k", [1e-3, 1e4])
def test_a_scaled_world_gives_the_same_picture(look, k):
    volume, eye, centre = noise(), np.array([12.0, 9.0, -14.0]), np.array([4.0, 4.0, 3.0])
    scaled = Volume(volume.data, np.array(volume.spacing) * k)
    image = reference.render(
        volume, STEPS, View.look_at(eye, centre, (0, 1, 0), 40, SIZE), look=LOOKS[look], tolerance=1e-9
    )
    transfer, view = TransferFunction(STEPS.points, k), View.look_at(eye * k, centre * k, (0, 1, 0), 40, SIZE)
    again = reference.render(scaled, transfer, view, look=LOOKS[look], tolerance=1e-9)
    assert largest(image - again) < LIT_AT_1E_9


def test_a_box_over_all_magnitudes_is_the_function_with_its_steps():
    volume = noise()
    view = view_of(volume, "corner")
    colour = (0.9, 0.5, 0.2)
    rows = [(0, 0), (80, 0), (80, 0.3), (150, 0.3), (150, 0)]
    function = TransferFunction([(value, colour, a) for value, a in rows], 1.0)
    box = TransferFunction2D([Box((80, 150), (0, 1e4), colour, 0.3, 0.0)], 1.0)
    for look in (None, LOOKS["lights"]):
        image = reference.render(volume, function, view, look=look, tolerance=1e-9)
        assert image[..., 3].max() > 0.5
        assert largest(image - reference.render(volume, box, view, look=look, tolerance=1e-9)) < LIT_AT_1E_9


def test_extinctions_of_shapes_add():
    volume = noise()
    view = view_of(volume, "front")
    one, twice = (
        TransferFunction2D([Triangle(120, (5, 110), 60, (0, 1, 0.5), a)], 1.0) for a in (0.3, 1 - 0.7**2)
    )
    sharp = TransferFunction2D([replace(one.shapes[0], soft=0.0)] * 2, 1.0)
    once = TransferFunction2D([replace(twice.shapes[0], soft=0.0)], 1.0)
    image = reference.render(volume, sharp, view, tolerance=1e-9)
    assert image[..., 3].max() > 0.2
    assert largest(image - reference.render(volume, once, view, tolerance=1e-9)) < LIT_AT_1E_9


@pytest.mark.parametrize("magnitudes", [(0, 5.9), (5.9, 6.1), (6.1, 9)])
def test_magnitudes_are_per_world_unit(magnitudes):
    x, y, z = np.meshgrid(*[np.arange(8)] * 3)
    volume = Volume((4 * x + 4 * y + 2 * z).transpose(2, 0, 1).astype(np.uint8), (1.0, 1.0, 0.5))
    assert np.linalg.norm(world_from_differences(volume) @ (4, 4, 2)) == pytest.approx(np.sqrt(48))
    # 4, 4 and 2 / 0.5 per world unit: 6.93; at spacing 1, 6.
    scaled = tuple(m * np.sqrt(48) / 6 for m in magnitudes)
    box = TransferFunction2D([Box((-1, 100), scaled, (1, 1, 1), 0.5, 0.0)])
    image = reference.render(volume, box, view_of(volume))
    assert (image[..., 3].max() > 0.5) == (magnitudes[0] < 6 < magnitudes[1])


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize(
    ("look", "transfer"), [("lights", STEPS), ("both, wide", KINKS), ("blinn", SHAPES), ("one side", SHAPES)]
)
def test_a_tenth_of_the_tolerance_changes_less_than_the_tolerance(look, transfer, tolerance):
    volume, look = noise(), LOOKS[look]
    view = view_of(volume, "corner")
    image, report = reference.render_with_report(volume, transfer, view, look=look, tolerance=tolerance)
    finer = reference.render(volume, transfer, view, look=look, tolerance=tolerance / 10)
    assert report.unconverged == 0 and report.worst_change > 0
    assert largest(image - finer) < tolerance
