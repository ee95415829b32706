"""Eyes inside the volume, on its sides, edges, corners and slice planes, and on the way through them."""

import dataclasses

import numpy as np
import pytest
from data_folder import volume_path
from exact_faces import COLOUR, VALUE, assert_covered, assert_exact
from tolerances import CONTINUOUS, INSIDE_SMOOTH_DB, SEAM
from views import random_pose

from persp_sw import Eye, Regions, Renderer, Settings, TransferFunction, View, Volume, Wall, load, reference
from persp_sw.errors import SettingsError
from persp_sw.measure.metrics import psnr
from persp_sw.volume.phantoms import synthetic_ct

SHAPES = [(2, 2, 2), (5, 9, 7), (17, 4, 12), (2, 2, 300)]  # x, y, z
PLACES = ["anywhere", "voxel", "slice", "side", "edge", "corner", "just inside"]
SMOOTH = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (90, (0.9, 0.6, 0.3), 0.05), (255, (1, 1, 1), 0.3)])
SURFACE = TransferFunction(
    [(0, (0, 0, 0), 0), (100, (0.9, 0.7, 0.5), 0), (130, (0.9, 0.7, 0.5), 0.9), (255, (1, 1, 1), 0.95)]
)


def eye_inside(rng, place, size):
    """A random object-space eye in the box of voxel centres of a volume of that size."""
    high = np.array(size) - 1.0
    eye = high * rng.random(3)
    ends = np.where(rng.random(3) < 0.5, 0, high)
    axis = rng.integers(3)
    if place == "voxel":
        eye = np.rint(eye)
    elif place == "slice":
        eye[axis] = np.rint(eye[axis])
    elif place == "side":
        eye[axis] = ends[axis]
    elif place == "edge":
        eye = np.where(np.arange(3) == axis, eye, ends)
    elif place == "corner":
        eye = ends
    elif place == "just inside":
        eye = np.abs(ends - 10.0 ** rng.choice([-12, -9, -6, -3, -1]))
    return eye


def room_of(eye, reach=20.0, pixels=24):
    """Six walls around the eye: every direction is on one of them."""
    walls = []
    for forward in (*np.eye(3), *-np.eye(3)):
        right = np.roll(forward, 1)
        up = np.cross(right, forward)
        corners = [eye + reach * (forward + x * right + y * up) for x, y in ((-1, -1), (1, -1), (-1, 1))]
        walls.append(Wall(*corners, pixels=(pixels, pixels)))
    return walls


# --- Exact ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", SHAPES)
@pytest.mark.parametrize("place", PLACES)
def test_a_homogeneous_box_is_exact_and_covered_from_inside(place, size):
    """Every pixel of every face, all around the eye and through narrow and wide views."""
    rng = np.random.default_rng([11, *size, PLACES.index(place)])
    high = np.array(size) - 1.0
    decided = undecided = 0
    for _ in range(6):
        pose = random_pose(rng, spacing=10.0 ** rng.uniform(-1, 1, 3), mirrored=rng.random() < 0.5)
        volume = Volume(np.full(size[::-1], VALUE, np.uint8), world_from_object=pose)
        transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.3)], np.mean(volume.spacing))
        eye, target = eye_inside(rng, place, size), high * rng.random(3)
        position, centre = (pose[:3, :3] @ p + pose[:3, 3] for p in (eye, target))
        near = rng.choice([0, 0, 0.3]) * np.linalg.norm(centre - position)
        view = View.look_at(position, centre, rng.normal(size=3), rng.choice([20, 80, 150]), (20, 16), near)
        walls = [view.wall] if rng.random() < 0.5 else room_of(position)
        settings = Settings(
            residual=0,
            quality=float(rng.choice([0.3, 1, 2])),
            samples_per_interval=[None, 1, 2, 4][rng.integers(4)],
            single_face_tangent=float(rng.choice([1, 3, 8])),
        )
        image = Renderer(volume, transfer, settings).composite(view.eye, walls)
        counts = assert_exact(image, volume, Regions(), transfer.extinction(VALUE))
        decided, undecided = decided + counts[0], undecided + counts[1]
        for wall in walls:
            assert_covered(image, volume, View.through_wall(view.eye, wall))
    assert decided > 10 * undecided


def test_looking_out_of_a_side_costs_nothing():
    volume = Volume(np.full((9, 9, 9), 200, np.uint8))
    renderer = Renderer(volume, SMOOTH)
    assert renderer.composite(Eye((4, 4, 4)), []).faces == ()
    for eye, centre in (((0, 4, 4), (-9, 4, 5)), ((0, 8, 4), (-5, 14, 4)), ((8, 8, 8), (9, 9.5, 9))):
        view = View.look_at(eye, centre, (0, 0, 1), 60, (16, 16))
        assert not renderer.render(view).any()
        assert renderer.last["samples"] == 0 and renderer.last["faces"] == 0


# --- Against the reference ---------------------------------------------------------------------------------


@pytest.mark.parametrize("place", [(0.5, 0.5, 0.5), (0.31, 0.62, 0.4), (0.0, 0.5, 0.5), (0.1, 0.1, 0.9)])
@pytest.mark.parametrize("fovy", [60, 110])
def test_smooth_volumes_from_inside_meet_the_reference(place, fovy):
    volume = synthetic_ct(64)
    renderer = Renderer(volume, SMOOTH, Settings(samples_per_interval=2))
    eye = 63 * np.array(place)
    view = View.look_at(eye, (50, 22, 38), (0, 0.1, 1), fovy, (96, 96))
    assert psnr(renderer.render(view), reference.render(volume, SMOOTH, view)) > INSIDE_SMOOTH_DB


def test_a_brain_from_inside_meets_the_reference():
    volume = load(volume_path("mni152_nilearn.nrrd"))
    low, high = volume.value_range
    transfer = TransferFunction([(low + v / 255 * (high - low), c, a / 4) for v, c, a in SMOOTH.points])
    high = np.array(volume.size) - 1.0
    places = (0.31, 0.62, 0.4), (0.8, 0.4, 0.6)
    eye, centre = (volume.world_from_object[:3] @ (*(high * place), 1) for place in places)
    view = View.look_at(eye, centre, (0, 0, 1), 100, (96, 96))
    renderer = Renderer(volume, transfer)
    picture = renderer.render(view)
    assert renderer.last["faces"] > 1
    assert psnr(picture, reference.render(volume, transfer, view)) > INSIDE_SMOOTH_DB


# --- Continuity --------------------------------------------------------------------------------------------

PATHS = {  # where, which way, looking at
    "in through a side": ((0, 20.3, 17.7), (1, 0, 0), (30, 20, 25)),
    "out through a side": ((47, 20.3, 17.7), (1, 0, 0), (30, 20, 25)),
    "a side, looking along it": ((0, 20.3, 17.7), (1, 0, 0), (0.5, 60, 17)),
    "an edge": ((0, 0, 17.3), (1, 0.7, 0), (30, 20, 17)),
    "a corner": ((0, 0, 0), (1, 0.7, 0.4), (30, 20, 17)),
    "a slice": ((20, 20.3, 17.7), (1, 0, 0), (30, 20, 25)),
    "along a slice": ((20, 20.3, 17), (1, 0.3, 0), (30, 20, 17)),
    "between two axes": ((70.3, 70.3, 27), (1, -1, 0), (23.5, 23.5, 23.5)),
    "between three axes": ((70, 70, 70), (1, -1, 0.5), (23.5, 23.5, 23.5)),
    "another axis comes into view": ((70, 34.2, 27), (0, 1, 0), (23.5, 23.5, 23.5)),
    "a voxel": ((20, 20, 17), (1, 0.3, 0.2), (30, 20, 25)),
}


@pytest.mark.parametrize("fovy", [50, 110])
@pytest.mark.parametrize("path", PATHS)
def test_the_picture_changes_continuously(path, fovy):
    """Steps of 1e-6 … 1e-2 voxel through sides, slices and voxels: no jump beyond the reference's."""
    volume = synthetic_ct(48)
    renderer = Renderer(volume, SMOOTH, Settings(residual=0))
    place, way, centre = (np.array(v, float) for v in PATHS[path])
    for step in (1e-6, 1e-4, 1e-2):
        pictures, truths = [], []
        for n in (-2, -1, 0, 1, 2):
            view = View.look_at(place + n * step * way, centre + n * step * way, (0, 0.1, 1), fovy, (48, 48))
            pictures.append(renderer.render(view))
            truths.append(reference.render(volume, SMOOTH, view, tolerance=1e-7))
        change, true_change = (np.abs(np.diff(p, axis=0)).max() for p in (pictures, truths))
        assert change < 3 * true_change + CONTINUOUS, (step, change, true_change)


# --- Seams -------------------------------------------------------------------------------------------------


def across(renderer, eye, direction, up):
    """A picture of a millionth of a degree about `direction`, from one eye image for all directions."""
    view = View.look_at(eye, eye + direction, up, 1e-5, (16, 16))
    return renderer.warp(renderer.composite(view.eye, room_of(eye)), view)


@pytest.mark.parametrize("kind", ["homogeneous", "smooth", "surface"])
def test_seams_cannot_be_seen(kind):
    """The picture across a seam is continuous; two or three faces, edges and corners of all six."""
    rng = np.random.default_rng(5)
    data = np.full((24, 20, 22), 100) if kind == "homogeneous" else rng.integers(0, 255, (24, 20, 22))
    volume = Volume(data.astype(np.uint8))
    renderer = Renderer(volume, SURFACE if kind == "surface" else SMOOTH, Settings(residual=0))
    eye = np.array([9.3, 8.1, 13.7])
    for direction in ((1, 1, 0.2), (-1, 0.4, 1), (0.1, -1, -1), (1, 1, 1), (-1, 1, -1), (1, -1, -1)):
        picture = across(renderer, eye, np.array(direction), (0.3, 0.2, 1))
        assert np.ptp(picture, axis=(0, 1)).max() < SEAM
    assert renderer.last["faces"] == 6


def test_a_homogeneous_medium_is_flat_across_seams():
    """Six walls around an eye in a box: no pixel errs by more than the look-up between its neighbours."""
    volume = Volume(np.full((65, 65, 65), VALUE, np.uint8))
    transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.02)], 1.0)
    renderer = Renderer(volume, transfer, Settings(residual=0, quality=4))
    eye = np.array([30.2, 33.1, 28.7])
    view = View.look_at(eye, eye + np.array([1, 1, 0.3]), (0, 0, 1), 20, (200, 200))
    picture = renderer.warp(renderer.composite(view.eye, room_of(eye, pixels=400)), view)
    directions = np.abs(view.directions())
    distance = np.where(view.directions() > 0, 64 - eye, -eye) / view.directions()
    alpha = -np.expm1(-transfer.extinction(VALUE) * distance.min(-1) * np.linalg.norm(directions, axis=-1))
    inner = np.sort(distance, -1)
    away = inner[..., 1] > 1.05 * inner[..., 0]  # the box's own edges are creases; seams are elsewhere
    near_seam = np.abs(directions[..., 0] / directions[..., 1] - 1) < 0.05
    assert (near_seam & away).sum() > 1000
    assert np.abs(picture[..., 3] - alpha)[near_seam & away].max() < SEAM


# --- No axis switch ----------------------------------------------------------------------------------------


def test_nothing_depends_on_earlier_frames():
    """An eye between two axes: both faces are there on either side, and no frame leaves anything."""
    volume = Volume(np.full((48, 48, 48), 100, np.uint8))
    renderer = Renderer(volume, SMOOTH)

    def composite(tremble, previous=None):
        eye = volume.centre + (70 + tremble, 70 - tremble, 3)
        view = View.look_at(eye, volume.centre, (0, 0, 1), 60, (48, 48))
        return renderer.composite(view.eye, [view.wall], previous)

    first, last = composite(0.01), None
    for tremble in (0.01, -0.01, -20, -0.3, 0.01):
        last = composite(tremble, last)
        assert {(face.axis, face.sign) for face in last.faces} == {(0, -1), (1, -1)}
    assert last.faces == first.faces
    np.testing.assert_array_equal(last.pixels, first.pixels)


def test_a_wider_tangent_for_one_face_does_switch():
    """What `single_face_tangent` is there to show: all of the picture changes its axis at once."""
    volume = synthetic_ct(48)
    one, several = (Renderer(volume, SMOOTH, Settings(residual=0, single_face_tangent=t)) for t in (8, 1))

    def view(aside):
        eye = volume.centre + (70 + aside, 70 - aside, 3)
        return View.look_at(eye, volume.centre, (0, 0, 1), 60, (48, 48))

    low, high = -20.0, 20.0
    for _ in range(40):
        middle = (low + high) / 2
        (face,) = one.plan(view(middle).eye, [view(middle).wall]).faces(one.settings)
        low, high = (low, middle) if face.axis == 0 else (middle, high)
    jumps = [np.abs(r.render(view(low - 1e-6)) - r.render(view(high + 1e-6))).max() for r in (one, several)]
    assert jumps[1] < CONTINUOUS < 10 * CONTINUOUS < jumps[0]


# --- The size asked for ------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [16, 50, 128, 500, 1024])
@pytest.mark.parametrize("place", [(0.5, 0.5, -2.0), (0.4, 0.6, 0.3)])
def test_an_intermediate_size_replaces_quality(size, place):
    volume = Volume(np.full((32, 32, 32), 100, np.uint8))
    eye = 31 * np.array(place)
    view = View.look_at(eye, (16, 16, 20), (0, 1, 0.1), 100, (32, 32))
    images = [
        Renderer(volume, SMOOTH, Settings(quality=quality, intermediate_size=size)).composite(
            view.eye, [view.wall]
        )
        for quality in (0.3, 4)
    ]
    assert images[0].faces == images[1].faces
    longest = max(max(face.size) for face in images[0].faces)
    assert size - 4 <= longest <= -(-size // 16) * 16
    assert_covered(images[0], volume, view)


def test_an_intermediate_size_may_be_4096():
    volume = Volume(np.full((3, 3, 3), 200, np.uint8))
    view = View.look_at((1, 1, -9), (1, 1, 1), (0, 1, 0), 30, (32, 32))
    settings = Settings(intermediate_size=4096)
    renderer = Renderer(volume, SMOOTH, settings)
    renderer.composite(view.eye, [view.wall])
    assert 4092 <= max(renderer.last["intermediate_size"]) <= 4096
    with pytest.raises(SettingsError, match="intermediate_size"):
        dataclasses.replace(settings, intermediate_size=4097)
