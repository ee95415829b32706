"""How far off a moved eye sees things: exactly what geometry says, and less with slabs."""

from dataclasses import replace

import numpy as np
import pytest
from tolerances import BEST_PLANE_DB, MARKER_MOVES, MARKER_PIXELS, MATRIX
from views import random_pose, random_rotation, view_of

from persp_sw import Eye, Renderer, Settings, TransferFunction, View, Volume, Wall
from persp_sw.geometry.placement import depth_range
from persp_sw.measure.exact import Markers
from persp_sw.measure.metrics import psnr
from persp_sw.volume.phantoms import synthetic_ct
from persp_sw.warp.software import warp_eye_image

SIZE = (48, 44, 50)
MIDDLE = np.array([23.5, 21.5])
BEFORE = 30.0  # voxels from the eye to the first slice
FOCAL = 400.0  # pixels a tangent
WALL = 50.0  # voxels from the eye


def window():
    """A view along +z, its wall at right angles: a pixel is 1 / FOCAL of a tangent."""
    half = 0.45
    eye = np.array([*MIDDLE, -BEFORE])
    # Rows run downwards, so that the picture is not mirrored where x is to the right and y down.
    corners = [eye + WALL * np.array([sx * half, sy * half, 1]) for sx, sy in ((-1, 1), (1, 1), (-1, -1))]
    return View(Eye(eye), Wall(*corners, pixels=(int(2 * half * FOCAL), int(2 * half * FOCAL))))


def moved(view, shift):
    return View(Eye(view.eye.position + shift), view.wall)


def composited(scene, view, **settings):
    renderer = Renderer(scene.volume, scene.transfer, Settings(quality=4, **settings))
    image = renderer.composite(view.eye, [view.wall])
    assert len(image.faces) == 1 and image.faces[0].axis == 2
    return image


def inverse_range(image):
    """Inverse distances of the nearest and the farthest that is seen."""
    eye = np.linalg.solve(image.world_from_object, np.append(image.eye.position, 1))[:3]
    nearest, farthest = depth_range(image.faces, eye, image.box)
    return 1 / nearest, 1 / farthest


@pytest.mark.parametrize("slice_", [2, 20, 47])
@pytest.mark.parametrize("distance", [25.0, 50.0, 120.0])
def test_a_point_is_seen_where_geometry_puts_it(slice_, distance):
    """A voxel at z, shown at D: off by shift · (1/z − 1/D), along the shift; to a part of a pixel."""
    view = window()
    scene = Markers(voxels=((20, 26, slice_),), size=SIZE)
    image = replace(composited(scene, view), depth=distance)
    z = slice_ + BEFORE
    (own,) = scene.centroids(warp_eye_image(image, view), view, 60) - scene.centres(view)
    assert np.abs(own).max() < 2 * MARKER_PIXELS
    for shift in ((2.0, 0, 0), (0, -3.0, 0), (1.5, 2.5, 0)):
        other = moved(view, shift)
        picture = warp_eye_image(image, other)
        (truth,) = scene.centres(other)
        shown = view.eye.position + (scene.voxels[0] - view.eye.position) * distance / z
        expected = other.project(shown)
        # What is nearer than it is shown moves too little against the shift: it is off along the shift.
        error = FOCAL * (1 / z - 1 / distance) * np.array(shift[:2])
        assert expected - truth == pytest.approx(error, abs=MATRIX * FOCAL)
        (found,) = scene.centroids(picture, other, 60)
        assert np.abs(found - expected - own).max() < MARKER_MOVES


def ladder_of_markers():
    """Markers at growing depths, side by side as the eye sees them, the nearest and farthest at the ends."""
    order = [5, 0, 9, 3, 7, 11, 1, 8, 4, 10, 2, 6]
    slices = np.linspace(1, SIZE[2] - 2, 12).round().astype(int)[order]
    across, down = np.meshgrid([-0.3, -0.1, 0.1, 0.3], [-0.25, 0.0, 0.25])
    x, y = (m + t.ravel() * (slices + BEFORE) for m, t in zip(MIDDLE, (across, down), strict=True))
    places = np.column_stack([x.round(), y.round(), slices]).astype(int)
    return Markers(voxels=tuple(map(tuple, places)), size=SIZE)


def worst(scene, image, view, shift):
    """The largest error of a marker's place, pixels."""
    other = moved(view, shift)
    found = scene.centroids(warp_eye_image(image, other), other, 35)
    return np.linalg.norm(found - scene.centres(other), axis=1).max()


@pytest.mark.parametrize("slabs", [2, 4, 8])
def test_with_slabs_the_worst_error_is_a_part_of_the_range(slabs):
    """Shift · (1/near − 1/far) / 2K with slabs in the middle between their cuts, never over twice that."""
    scene, view = ladder_of_markers(), window()
    image = composited(scene, view, depth_slabs=slabs)
    near, far = inverse_range(image)
    cuts = np.linspace(near, far, slabs + 1)
    for shift in ((2.5, 0, 0), (-1, 2, 0)):
        whole = FOCAL * np.hypot(*shift[:2]) * (near - far)
        assert worst(scene, image, view, shift) < whole / slabs + MARKER_PIXELS
        middles = 2 / (cuts[1:] + cuts[:-1])
        placed = replace(
            image, slabs=tuple(replace(s, depth=d) for s, d in zip(image.slabs, middles, strict=True))
        )
        assert worst(scene, placed, view, shift) < whole / slabs / 2 + MARKER_PIXELS
        assert worst(scene, replace(image, slabs=()), view, shift) > whole / 4


def test_slabs_lie_between_their_cuts():
    image = composited(ladder_of_markers(), window(), depth_slabs=4)
    cuts = np.linspace(*inverse_range(image), 5)
    inverse = np.array([1 / slab.depth for slab in image.slabs])
    assert (inverse <= cuts[:-1] + 1e-12).all() and (inverse >= cuts[1:] - 1e-12).all()
    ends = np.array([slab.box[:, 2] for slab in image.slabs]) + BEFORE
    assert ends[0, 0] == BEFORE + image.box[0, 2] and ends[-1, 1] == BEFORE + image.box[1, 2]
    np.testing.assert_allclose(ends[1:, 0], 1 / cuts[1:-1], rtol=MATRIX)
    np.testing.assert_allclose(ends[:-1, 1], 1 / cuts[1:-1], rtol=MATRIX)


def test_a_sheet_is_found_where_it_is():
    """A pattern on one slice, in a box with next to nothing at its ends: to a step of the look."""
    for slice_ in (6, 25, 40):
        data = np.zeros(SIZE[::-1], np.uint8)
        data[slice_, 10:34, 10:34] = np.random.default_rng(3).integers(100, 255, (24, 24))
        data[1, 20, 20] = data[-2, 20, 20] = 1
        volume = Volume(data)
        view = window()
        renderer = Renderer(
            volume, TransferFunction([(0, (1, 1, 1), 0), (255, (1, 1, 1), 0.5)]), Settings(depth_slabs=1)
        )
        image = renderer.composite(view.eye, [view.wall])
        near, far = inverse_range(image)
        z = slice_ + BEFORE
        assert 1 / near < 33 and 1 / far > 75
        assert abs(1 / image.depth - 1 / z) < (near - far) / 8 + 1 / (z - 1) - 1 / z


def test_all_around_a_cube_is_found_where_it_is(rng):
    """A shell about the eye: as far along every face's axis."""
    data = rng.integers(100, 255, (41, 41, 41)).astype(np.uint8)
    data[9:-9, 9:-9, 9:-9] = 0  # 12 voxels from the eye to the shell's first slice with something
    data[:8] = data[-8:] = data[:, :8] = data[:, -8:] = data[:, :, :8] = data[:, :, -8:] = 0
    data[0, 0, 0] = data[-1, -1, -1] = 1
    volume = Volume(data, world_from_object=random_pose(rng, spacing=(1, 2, 0.5)))
    rotation = random_rotation(rng)
    corners = [(-1, -1, 1), (1, -1, 1), (-1, 1, 1)]
    walls = [
        Wall(*(volume.centre + rotation @ np.roll(c, axis) * sign for c in corners), (64, 64))
        for axis in range(3)
        for sign in (-1, 1)
    ]
    transfer = TransferFunction([(0, (1, 1, 1), 0), (255, (1, 1, 1), 0.5)], 1.0)
    image = Renderer(volume, transfer, Settings(depth_slabs=1)).composite(Eye(volume.centre), walls)
    assert len(image.faces) == 6
    near, far = inverse_range(image)
    assert abs(1 / image.depth - 1 / 12) < (near - far) / 8 + 1 / 11 - 1 / 12


@pytest.mark.parametrize("transfer", ["surface", "fog"])
def test_no_other_plane_is_much_better(transfer):
    """Least squares of contrast: no plane that is tried makes a better picture of a small shift."""
    volume = synthetic_ct(48)
    function = {
        "surface": [
            (0, (0, 0, 0), 0),
            (20, (0.9, 0.5, 0.3), 0),
            (50, (1, 0.9, 0.8), 0.6),
            (255, (1, 1, 1), 0.9),
        ],
        "fog": [(0, (0, 0, 0), 0), (60, (0.9, 0.5, 0.3), 0.02), (255, (1, 1, 1), 0.3)],
    }[transfer]
    renderer = Renderer(volume, TransferFunction(function, 1.0), Settings(quality=2, depth_slabs=1))
    view = view_of(volume, (0.3, 0.2, -0.93), 1.3, size=(96, 96))
    image = renderer.composite(view.eye, [view.wall])
    others = [moved(view, shift) for shift in ((0.5, 0, 0), (0, 0.5, 0))]
    truths = [renderer.render(other) for other in others]

    def decibels(depth):
        there = replace(image, depth=depth)
        return np.mean([psnr(warp_eye_image(there, o), t) for o, t in zip(others, truths, strict=True)])

    near, far = inverse_range(image)
    found = decibels(image.depth)
    best = max(decibels(1 / inverse) for inverse in np.linspace(near, far, 25))
    assert found > best - BEST_PLANE_DB
    assert found > decibels(1 / near) + 3 and found > decibels(1 / far) + 3
