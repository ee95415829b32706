"""The gradient against fields whose own is known, in every pose, and the lit caster's against plain numpy."""

import numpy as np
import pytest
from test_reference import POSES, noise, pose_of
from tolerances import GRADIENT, GRADIENT_ORDER

from persp_sw import reference
from persp_sw.errors import LookError
from persp_sw.reference import _stretch as stretch
from persp_sw.volume.gradient import largest_magnitude
from persp_sw.volume.grid import Volume

POSES = {**POSES, "1:20": np.diag([1.0, 20.0, 1.0])}


def pose(name):
    matrix = np.eye(4)
    matrix[:3, :3] = POSES[name]
    matrix[:3, 3] = (10, -20, 5)
    return matrix


def indices(size=(9, 8, 7)):
    """x, y, z of all voxels, [z, y, x]."""
    z, y, x = np.indices(size[::-1])
    return x, y, z


def world_points(volume, count=200, margin=0.0, seed=1):
    """Inside the box of voxel centres, off its sides by `margin` voxels; object places too."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(margin, np.array(volume.size) - 1 - margin, (count, 3))
    return places @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3], places


def in_world(volume, differences):
    """(∂s/∂x, …) per voxel as a vector of the world: d(s) = g · dp for every step dp along a voxel axis."""
    return np.linalg.solve(volume.world_from_object[:3, :3].T, np.asarray(differences, float)[..., None])[
        ..., 0
    ]


@pytest.mark.parametrize("distance", [0.5, 1, 1.3, 2, 4])
@pytest.mark.parametrize("name", POSES)
def test_a_linear_field_is_exact_up_to_the_faces(name, distance):
    x, y, z = indices()
    volume = Volume((3 * x - 2 * y + 5 * z).astype(np.int16), world_from_object=pose(name))
    points, _ = world_points(volume)
    truth = in_world(volume, (3, -2, 5))
    assert np.abs(reference.gradients(volume, points, distance) - truth).max() < GRADIENT


@pytest.mark.parametrize("distance", [1, 2])
@pytest.mark.parametrize("name", POSES)
def test_a_quadratic_field_is_exact_between_whole_voxels(name, distance):
    """Interpolation exceeds x² by f·(1 − f), the same at both places; products of two axes it has exactly."""
    x, y, z = indices()
    field = 2 * x * x - y * y + 3 * z * z + x * y - 4 * y * z + 2 * z * x
    volume = Volume(field.astype(np.int16), world_from_object=pose(name))
    points, places = world_points(volume, margin=distance)
    x, y, z = places.T
    truth = np.stack([4 * x + y + 2 * z, -2 * y + x - 4 * z, 6 * z - 4 * y + 2 * x], -1)
    found = reference.gradients(volume, points, distance)
    assert np.abs(found - in_world(volume, truth)).max() < GRADIENT


@pytest.mark.parametrize("name", POSES)
def test_a_wave_has_order_two_in_the_distance(name):
    volume = Volume(np.zeros((12, 12, 12), np.float32), world_from_object=pose(name))
    wave = in_world(volume, (0.12, 0.07, -0.09))  # world, so many radians a voxel along the three axes
    z, y, x = np.indices((12, 12, 12))
    places = np.stack([x, y, z], -1) @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3]
    volume = Volume(np.sin(places @ wave).astype(np.float32), world_from_object=pose(name))
    inner = places[4:8, 4:8, 4:8].reshape(-1, 3)
    truth = np.cos(inner @ wave)[:, None] * wave
    distances = np.array([1, 2, 3, 4])
    errors = [np.linalg.norm(reference.gradients(volume, inner, r) - truth, axis=-1).max() for r in distances]
    order = np.polyfit(np.log(distances), np.log(errors), 1)[0]
    assert abs(order - 2) < GRADIENT_ORDER, errors
    assert errors[0] < 0.12**2 / 6 * np.linalg.norm(wave)  # 1 − sin(k·r) / (k·r) < (k·r)² / 6


def test_no_central_difference_is_longer_than_the_largest_possible_one():
    x, y, z = indices((8, 8, 8))
    corners = Volume(
        (255 * ((x // 2 + y // 2 + z // 2) % 2)).astype(np.uint8), world_from_object=pose("sheared")
    )
    points, _ = world_points(corners, 4000, 1.0)
    lengths = np.linalg.norm(reference.gradients(corners, points), axis=-1)
    assert 0.5 < lengths.max() / largest_magnitude(corners) <= 1


def test_a_nan_among_the_voxels_leaves_no_gradient():
    data = noise().data.astype(np.float32)
    data[3, 4, 5] = np.nan  # x = 5, y = 4, z = 3
    volume = Volume(data)
    touched = reference.gradients(volume, [(5.5, 4.5, 2.5), (6.5, 4.5, 3.5), (3.5, 3.5, 3.5), (5, 4, 4.5)])
    assert not touched.any()
    free = reference.gradients(volume, [(7.5, 4.5, 3.5), (5, 3, 3.0), (2.5, 4.5, 3.5)])
    assert (np.linalg.norm(free, axis=-1) > 0)[[0, 2]].all()
    assert not free[1].any()  # its neighbour above is the NaN itself
    on_voxels = reference.gradients(
        volume, [(5, 2, 3.0)]
    )  # reaches the voxel before it, with no weight on it
    assert on_voxels.any()


@pytest.mark.parametrize("distance", [0.5, 1, 1.3, 2, 4])
@pytest.mark.parametrize("with_nan", [False, True])
def test_the_casters_gradient_is_that_of_plain_numpy(distance, with_nan):
    data = noise().data.astype(np.float32)
    if with_nan:
        data[3, 4, 5] = np.nan
    volume = Volume(data, world_from_object=pose_of("sheared"))
    field = stretch.field_of(volume, volume.data, distance)
    rng = np.random.default_rng(2)
    zeros = 0
    for _ in range(40):
        start, end = rng.uniform(0, np.array(volume.size) - 1, (2, 3))
        direction = end - start
        direction[rng.integers(0, 4) % 4 : 3] *= rng.integers(0, 2)  # some along an axis or a plane
        if not direction.any():
            continue
        room = stretch.room_for(field, np.empty(0))
        stretch.set_out(field, start, direction, 0.0, room.planes)
        here = 0.0
        while here < 1:
            there = stretch.next_cut(start, direction, here, 1.0, room.planes)
            stretch.lay_value(field, start, direction, here, there, room)
            stretch.lay_gradient(field, start, direction, here, there, room)
            if there - here > 1e-6:
                u = rng.uniform(0.1, 0.9, 3)
                found = [stretch.gradient_on(field, room, part) for part in u]
                places = start + (here + u * (there - here))[:, None] * direction
                world = places @ volume.world_from_object[:3, :3].T + volume.world_from_object[:3, 3]
                truth = reference.gradients(volume, world, distance)
                assert np.abs(np.array(found) - truth).max() < GRADIENT
                zeros += not truth.any()
            here = there
    assert (zeros > 0) == with_nan


def test_what_has_no_gradient_is_refused():
    with pytest.raises(LookError, match="two voxels along each axis"):
        reference.gradients(Volume(np.zeros((1, 4, 4), np.uint8)), (1, 1, 0))
    with pytest.raises(LookError, match=r"gradient_distance lies between 0\.5 and 4"):
        reference.gradients(noise(), (1, 1, 1), 5)
