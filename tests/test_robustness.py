"""Hard eyes, shapes, poses, regions and values, drawn with fixed seeds: no view is a special case."""

import dataclasses

import numpy as np
import pytest
from exact_faces import COLOUR, VALUE, assert_covered, assert_exact
from tolerances import CLOSED_FORM, FLOAT32_IMAGE
from views import random_pose

from persp_sw import Eye, Regions, Renderer, Settings, TransferFunction, View, Volume, Wall

# Small, thin, and so long that a scanline's bits fill several words (256 voxels each).
SHAPES = [(2, 2, 2), (5, 9, 7), (17, 4, 12), (2, 2, 400), (400, 2, 3), (3, 600, 2)]  # x, y, z
EYES = ["face", "edge", "corner", "slices", "side planes", "far", "axis"]
DTYPES = [np.uint8, np.int16, np.uint16, np.float32]


def eye_outside(rng, kind, size):
    """A random eye, object space, outside the box of voxel centres of a volume of that size."""
    high = np.array(size) - 1.0
    gap = 10.0 ** rng.choice([-9, -6, -3, -1])
    while True:
        eye = high * rng.uniform(-1, 2, 3)
        ends = np.where(rng.random(3) < 0.5, -gap, high + gap)
        axis = rng.integers(3)
        if kind == "face":
            eye = high * rng.uniform(0, 1, 3)
            eye[axis] = ends[axis]
        elif kind == "edge":
            eye = np.where(np.arange(3) == axis, high * rng.uniform(0, 1, 3), ends)
        elif kind == "corner":
            eye = ends
        elif kind == "slices":
            eye = np.rint(eye)
        elif kind == "side planes":
            eye[axis] = rng.choice([0.0, high[axis]])
        elif kind == "far":
            eye = high / 2 + rng.normal(size=3) * high.max() * 10.0 ** rng.uniform(0.5, 5)
        else:
            eye = high / 2
            eye[axis] = ends[axis]
        if ((eye < 0) | (eye > high)).any():
            return eye


def view_from(rng, pose, eye, size):
    """A random view from object-space `eye` towards the box, narrow to very wide, every other off-axis."""
    high = np.array(size) - 1.0
    position, target = (pose[:3, :3] @ p + pose[:3, 3] for p in (eye, high * rng.uniform(0.1, 0.9, 3)))
    reach = np.linalg.norm(pose[:3, :3] @ high) / np.linalg.norm(target - position)
    fovy = min(rng.choice([0.3, 1.2, 5]) * np.degrees(2 * np.arctan(reach)), 170)
    pixels = [(24, 18), (1, 20), (20, 1), (33, 32)][rng.integers(4)]
    view = View.look_at(position, target, rng.normal(size=3), fovy, pixels)
    if rng.random() < 0.5:
        return view
    wall = view.wall
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    corner = wall.lower_left + rng.uniform(-0.5, 0.5) * across
    forward = rng.uniform(-0.5, 1) * (target - position)  # one side farther away: grazing, not a rectangle
    return View.through_wall(
        view.eye, Wall(corner, corner + across + forward + 0.2 * up, corner + up, pixels)
    )


def some_settings(rng):
    return Settings(
        residual=0,
        quality=float(rng.choice([0.05, 0.3, 1, 2])),
        samples_per_interval=[None, 1, 2, 4][rng.integers(4)],
        single_face_tangent=float(rng.choice([1, 2, 3, 8])),
        max_intermediate=int(rng.choice([16, 31, 64, 100, 250])),
    )


def some_regions(rng, pose, size):
    """Nothing, a crop (thin, every third time), and planes: askew, or through the voxels of a slice."""
    high = np.array(size) - 1.0
    crop, clip = None, []
    if rng.random() < 0.4:
        crop = np.sort(rng.uniform(-0.2, 1.2, (3, 2)) * high[:, None], axis=1)
        if rng.random() < 0.3:
            axis = rng.integers(3)
            crop[axis] = crop[axis, 0], crop[axis, 0] + 0.01
        crop = crop.ravel()
    for _ in range(rng.integers(3)):
        normal, point = rng.normal(size=3), high * rng.uniform(-0.1, 1.1, 3)
        if rng.random() < 0.5:
            axis = rng.integers(3)
            normal, point = np.linalg.inv(pose[:3, :3])[axis], np.rint(point)
        clip.append((*normal, -normal @ (pose[:3, :3] @ point + pose[:3, 3])))
    return Regions(crop=crop, clip=clip)


# --- Geometry ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SHAPES)
@pytest.mark.parametrize("kind", EYES)
def test_a_homogeneous_box_is_exact_and_covered_from_every_eye(kind, size):
    """Eyes down to 1e-9 voxel off a side or a corner, on slice planes, 1e5 volume widths away."""
    rng = np.random.default_rng([*size, EYES.index(kind)])
    decided = undecided = 0
    for _ in range(12):
        pose = random_pose(
            rng,
            spacing=10.0 ** rng.uniform(-1, 1, 3),
            mirrored=rng.random() < 0.5,
            shear=rng.choice([0, 0.5]),
        )
        volume = Volume(np.full(size[::-1], VALUE, np.uint8), world_from_object=pose)
        transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.3)], np.mean(volume.spacing))
        view = view_from(rng, pose, eye_outside(rng, kind, size), size)
        image = Renderer(volume, transfer, some_settings(rng)).composite(view.eye, [view.wall])
        counts = assert_exact(image, volume, Regions(), transfer.extinction(VALUE))
        decided, undecided = decided + counts[0], undecided + counts[1]
        assert_covered(image, volume, view)
    assert decided > 10 * undecided


@pytest.mark.parametrize("seed", range(80))
def test_crops_and_planes_of_every_kind_are_exact_and_covered(seed):
    rng = np.random.default_rng([7, seed])
    size = SHAPES[1 + seed % 5]
    pose = random_pose(rng, spacing=10.0 ** rng.uniform(-1, 1, 3), mirrored=seed % 2 == 0)
    volume = Volume(np.full(size[::-1], VALUE, np.uint8), world_from_object=pose)
    transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.3)], np.mean(volume.spacing))
    regions = some_regions(rng, pose, size)
    view = view_from(rng, pose, eye_outside(rng, EYES[seed % len(EYES)], size), size)
    image = Renderer(volume, transfer, some_settings(rng), regions).composite(view.eye, [view.wall])
    assert_exact(image, volume, regions, transfer.extinction(VALUE))
    low, high = regions.box(volume)
    if (low < high).all():
        assert_covered(image, volume, view, regions)


@pytest.mark.parametrize("eye", [(3.1, 3.6, 7.01), (7.2, 7.3, 7.4), (7.001, 3.2, 2.7), (25.3, -4.1, 3.7)])
def test_six_walls_around_the_eye_show_the_whole_box(eye):
    """A closed room: the volume in front of some walls, behind others, and all from one eye image."""
    volume = Volume(np.full((8, 8, 8), VALUE, np.uint8))
    transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.3)], 1.0)
    eye, reach = np.array(eye), 20.0
    walls = []
    for forward in (*np.eye(3), *-np.eye(3)):
        right = np.roll(forward, 1)
        up = np.cross(right, forward)
        middle = eye + reach * forward
        corners = [middle + reach * (x * right + y * up) for x, y in ((-1, -1), (1, -1), (-1, 1))]
        walls.append(Wall(*corners, pixels=(32, 32)))
    renderer = Renderer(volume, transfer, Settings(residual=0))
    image = renderer.composite(Eye(eye), walls)
    assert_exact(image, volume, Regions(), transfer.extinction(VALUE))
    for wall in walls:
        assert_covered(image, volume, View.through_wall(eye, wall))


# --- Values -----------------------------------------------------------------------------------------------


def hard_volume(rng, dtype, size):
    """Noise over the type's whole range, sparse, or sparse blocks; NaN and infinities in float volumes."""
    data = rng.random(size[::-1])
    kind = rng.integers(3)
    if kind:
        spots = rng.random(data.shape) < 0.05
        if kind == 2:
            spots = np.zeros(data.shape, bool)
            spots[tuple(slice(a, a + 4) for a in rng.integers(0, 3, 3))] = True
        data = np.where(spots, data, 0)
    if dtype is np.float32:
        data = (data - 0.5).astype(dtype)
        data[rng.random(data.shape) < 0.02] = rng.choice([np.nan, np.inf])
        data.flat[0] = 0
        return data
    info = np.iinfo(dtype)
    return np.rint(info.min + data * (float(info.max) - info.min)).astype(dtype)


def hard_transfer(rng, volume, unit):
    """A step, a spike, one point inside or outside the range, 300 points, or all beyond the range."""
    low, high = volume.value_range
    width = (high - low) or 1.0
    at = low + width * rng.random()
    colours = rng.random((300, 3))
    rows = [
        [(at - width, 0), (at, 0), (at, 1.0), (at + width, 0.2)],
        [(at - 0.03 * width, 0), (at, 0.9), (at + 0.03 * width, 0)],
        [(low + width * rng.uniform(-1, 2), 0.4)],
        list(zip(np.sort(low + width * rng.random(300)), rng.uniform(-1, 1, 300).clip(0), strict=True)),
        [(high + width, 0.4), (high + 2 * width, 0.9)],
    ][rng.integers(5)]  # fmt: skip
    points = [(v, tuple(c), a) for (v, a), c in zip(rows, colours[: len(rows)], strict=True)]
    return TransferFunction(points, unit)


@pytest.mark.parametrize("dtype", DTYPES)
def test_hard_values_skip_and_share_work_without_changing_a_bit(dtype):
    """Skipping, and any number of threads, give the same bits; pixels are finite, premultiplied, 0 … 1."""
    for seed in range(25):
        rng = np.random.default_rng([11, DTYPES.index(dtype), seed])
        size = [(6, 7, 9), (2, 3, 4), (12, 5, 3), (300, 3, 2), (2, 2, 2)][seed % 5]
        pose = random_pose(rng, spacing=10.0 ** rng.uniform(-1, 1, 3))
        volume = Volume(hard_volume(rng, dtype, size), world_from_object=pose)
        transfer = hard_transfer(rng, volume, min(volume.spacing) * 10.0 ** rng.integers(-2, 3))
        regions = some_regions(rng, pose, size)
        view = view_from(rng, pose, eye_outside(rng, EYES[seed % len(EYES)], size), size)
        settings = some_settings(rng)
        one, two, dense = (
            Renderer(volume, transfer, dataclasses.replace(settings, **change), regions)
            for change in ({"threads": 1}, {"threads": 2}, {"skip_empty": False})
        )
        if one.runs.visible_box() is not None:
            dense.runs._box = one.runs.visible_box()  # what can be seen bounds the faces: the same for both
        else:
            dense = one
        image, *others = (r.composite(view.eye, [view.wall]) for r in (one, two, dense))
        for other in others:
            assert other.faces == image.faces
            np.testing.assert_array_equal(other.pixels, image.pixels)
        assert np.isfinite(image.pixels).all()
        assert (image.pixels >= 0).all() and (image.pixels <= 1 + CLOSED_FORM).all()
        assert (image.pixels[:, :3] <= image.pixels[:, 3:] + CLOSED_FORM).all()


@pytest.mark.parametrize("scale", [1e-30, 1e-6, 1e6, 1e30])
def test_a_unit_of_values_or_of_length_changes_nothing(scale):
    """Values and control points times k, or spacing, view and opacity unit times k: the same picture."""
    data = np.random.default_rng(5).random((8, 9, 10))
    rows = [(0.1, (1, 0.5, 0.2), 0), (0.9, (0.2, 0.5, 1), 0.6)]

    def picture(values=1.0, length=1.0):
        volume = Volume((data * values).astype(np.float32), (length,) * 3)
        transfer = TransferFunction([(v * values, c, a) for v, c, a in rows], length)
        eye = volume.centre + np.array([11, 7, 25]) * length
        view = View.look_at(eye, volume.centre, (0, 1, 0), 37, (24, 20))
        return Renderer(volume, transfer, Settings(residual=0)).render(view)

    plain = picture()
    assert plain[..., 3].max() > 0.5
    assert np.abs(picture(values=scale) - plain).max() < FLOAT32_IMAGE
    assert np.abs(picture(length=scale) - plain).max() < FLOAT32_IMAGE


def test_a_spacing_of_one_to_a_thousand_is_exact():
    volume = Volume(np.full((5, 6, 7), VALUE, np.uint8), (1, 1, 1000))
    transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.3)], 500.0)
    for towards in ((9, 4, 5000), (9, 4, 30), (3, -2, -3000)):
        view = View.look_at(volume.centre + np.array(towards), volume.centre, (0, 1, 0), 60, (40, 40))
        image = Renderer(volume, transfer, Settings(residual=0)).composite(view.eye, [view.wall])
        assert image.faces
        assert_exact(image, volume, Regions(), transfer.extinction(VALUE))
