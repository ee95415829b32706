"""The shear-warp of 2001 as the atlas has it: its closed forms, a plain twin, the paper's own matrices."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import FLOAT32_PICTURE, MATRIX

from persp_sw import Regions, TransferFunction, View, Volume
from persp_sw.geometry.factorization import factorize, viewport_from_world
from persp_sw.geometry.view import Wall
from persp_sw.measure.atlas import obliquity, single_axis
from persp_sw.measure.atlas.case import Scale
from persp_sw.measure.exact import Slab

OPACITY = 0.05
RAMP = TransferFunction([(0, (0.1, 0.4, 0.9), 0.0), (60, (1, 0.7, 0.2), 0.2)], 1.0)


def before(volume: Volume, towards, distance: float = 2.0, fovy: float = 50.0, pixels: int = 33) -> View:
    """From `distance` longest edges before a volume's middle."""
    towards = np.array(towards, float) / np.linalg.norm(towards)
    eye = volume.centre + distance * max(volume.extent) * towards
    return View.look_at(eye, volume.centre, (0.05, 1, 0.03), fovy, (pixels, pixels))


def cosines(view: View, axis: int) -> np.ndarray:
    """(h, w) of the angles between rays and an axis."""
    directions = view.directions()
    return np.abs(directions[..., axis]) / np.linalg.norm(directions, axis=-1)


def waves() -> Volume:
    z, y, x = np.indices((11, 12, 13))
    return Volume((30 + 20 * np.sin(0.9 * x) * np.cos(0.6 * y) + 9 * np.sin(z)).astype(np.float32))


# --- Opacity -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_along_the_axis_a_homogeneous_box_is_as_opaque_as_its_slices(axis):
    slab = Slab((9, 9, 9), opacity=OPACITY)
    picture = single_axis.render(slab.volume, slab.transfer, before(slab.volume, 3 * np.eye(3)[axis]))
    exact = 1 - (1 - OPACITY) ** 9
    assert abs(picture[16, 16, 3] - exact) < FLOAT32_PICTURE
    np.testing.assert_allclose(picture[16, 16, :3], np.array(slab.colour) * exact, atol=FLOAT32_PICTURE)


def test_at_a_slant_it_stays_as_thin_as_along_the_axis():
    """1 − (1 − a)^n for every ray, where a ray at θ has the length of 1 / cos θ as many intervals."""
    slab = Slab((21, 21, 7), opacity=OPACITY)
    view = View.look_at((10.2, 9.7, 12.5), (10, 10, 0), (0, 1, 0), 100, (48, 48))
    found = single_axis.composite(slab.volume, slab.transfer, view)
    assert found.axis == 2
    entry = slab.image(found.rays)[..., 3]
    cosine = cosines(found.rays, 2)
    # Rays that go in by the front and out by the back: their length in the box is 6 / cos θ.
    through = np.abs(entry - (1 - (1 - OPACITY) ** (6 / cosine))) < 1e-12
    assert through.sum() > 100 and cosine[through].min() < 0.8
    alpha = found.pixels[..., 3][through].astype(np.float64)
    assert np.abs(alpha - (1 - (1 - OPACITY) ** 7)).max() < FLOAT32_PICTURE
    lacks = np.log1p(-alpha) / np.log1p(-entry[through])
    np.testing.assert_allclose(lacks, 7 / 6 * cosine[through], atol=10 * FLOAT32_PICTURE)


def test_a_sample_stands_for_the_spacing_along_the_axis():
    slab = Slab((9, 9, 5), pose=np.diag([1.0, 1.0, 3.0, 1.0]), opacity=OPACITY)
    view = before(slab.volume, (0, 0, 1))
    picture = single_axis.render(slab.volume, slab.transfer, view)
    assert abs(picture[16, 16, 3] - (1 - (1 - OPACITY) ** (3 * 5))) < FLOAT32_PICTURE


# --- Which axis --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (2, 0)])
def test_the_axis_switches_at_45_degrees(pair):
    slab = Slab((9, 9, 9), opacity=OPACITY)
    found = []
    for degrees in (44.99, 45.01):
        towards = np.zeros(3)
        towards[list(pair)] = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        view = before(slab.volume, towards)
        axis = single_axis.principal_axis(slab.volume, view.eye.position)
        found.append((axis, single_axis.render(slab.volume, slab.transfer, view)))
    (one, picture), (other, changed) = found
    assert (one, other) == pair
    assert np.abs(changed - picture).max() > 0.05  # that is how it pops


def test_corners_vote_in_world_lengths():
    """A box of thick slices: by voxels its long side is x, by lengths z."""
    volume = Volume(np.zeros((5, 9, 13), np.uint8), spacing=(1, 1, 20))
    assert single_axis.principal_axis(volume, (-60, 4, 40)) == 0
    assert single_axis.principal_axis(volume, (-30, 4, 300)) == 2


def test_equals_are_given_to_z_then_y():
    volume = Volume(np.zeros((9, 9, 9), np.uint8))
    assert single_axis.principal_axis(volume, (44, 44, 44)) == 2
    assert single_axis.principal_axis(volume, (44, 44, 4)) == 1


# --- Pixels ------------------------------------------------------------------------------------------------


def one_pixel(volume: Volume, transfer: TransferFunction, found: single_axis.Intermediate, u: int, v: int):
    """Pixel (u, v) by a loop over slices and voxels, for volumes whose world is their voxel index."""
    axis, eye = found.axis, found.rays.eye.position
    i, j = (axis + 1) % 3, (axis + 2) % 3
    direction = found.rays.direction_from_pixel @ (u + 0.5, v + 0.5, 1)
    count = volume.size[axis]
    slices = range(count) if eye[axis] < 0 else range(count - 1, -1, -1)
    rgba, clear, first = np.zeros(4), 1.0, abs(slices[0] - eye[axis])
    for k in slices:
        place = eye + direction * (k - eye[axis]) / direction[axis]
        width = max(1.0, abs(k - eye[axis]) / first)
        if not all(-1e-9 <= place[n] <= volume.size[n] - 1 + 1e-9 for n in (i, j)):
            continue
        value, total = 0.0, 0.0
        for m in range(volume.size[i]):
            for n in range(volume.size[j]):
                weight = max(1 - abs(place[i] - m) / width, 0) * max(1 - abs(place[j] - n) / width, 0)
                voxel = [0, 0, 0]
                voxel[axis], voxel[i], voxel[j] = k, m, n
                value += weight * volume.data[voxel[2], voxel[1], voxel[0]]
                total += weight
        value /= total
        alpha = 1 - np.exp(-float(transfer.extinction(value)))
        rgba += clear * alpha * np.append(transfer.colour(value), 1)
        clear *= 1 - alpha
    return rgba


@pytest.mark.parametrize("towards", [(0.4, 0.3, 1), (-1, 0.3, 0.5), (0.2, -1, 0.6)])
def test_a_pixel_is_what_a_plain_loop_makes_it(towards):
    volume = waves()
    found = single_axis.composite(volume, RAMP, before(volume, towards))
    assert found.axis == np.argmax(np.abs(towards))
    height, width = found.pixels.shape[:2]
    covered = 0
    for u, v in ((width // 2, height // 2), (width // 3, height // 2), (width // 2, height - 4), (0, 0)):
        expected = one_pixel(volume, RAMP, found, u, v)
        covered += expected[3] > 0.1
        np.testing.assert_allclose(found.pixels[v, u], expected, atol=FLOAT32_PICTURE)
    assert covered >= 2


@pytest.mark.parametrize("quality", [1.0, 2.5])
def test_the_first_slice_has_a_pixel_a_voxel(quality):
    volume = waves()
    view = before(volume, (0, 0.1, 1))
    found = single_axis.composite(volume, RAMP, view, quality=quality)
    voxels = np.array([[3, 4, 10], [4, 4, 10], [3, 5, 10]])
    middle, right, up = found.rays.project(voxels)
    np.testing.assert_allclose(right - middle, (quality, 0), atol=1e-9)
    np.testing.assert_allclose(up - middle, (0, quality), atol=1e-9)
    if quality == 1:
        np.testing.assert_allclose(middle % 1, 0.5, atol=1e-9)


@pytest.mark.parametrize("towards", [(0.4, 0.3, 1), (-1, 0.3, 0.5), (0.2, -1, 0.6)])
def test_the_intermediate_image_is_that_of_the_papers_matrices(towards, rng):
    """Places in it differ from M_oi's by one scale and a shift alone: the base plane is another slice."""
    pose = np.diag([0.7, 0.7, 0.7, 1.0])
    pose[:3, 3] = 3, -2, 5
    volume = Volume(waves().data, world_from_object=pose)
    view = before(volume, towards)
    found = single_axis.composite(volume, RAMP, view)
    paper = factorize(viewport_from_world(view) @ pose, found.axis)
    voxels = rng.random((50, 3)) * (np.array(volume.size) - 1)
    theirs = np.column_stack([voxels, np.ones(50)]) @ paper.intermediate_from_object.T
    theirs = theirs[:, :2] / theirs[:, 3:]
    ours = found.rays.project(voxels @ pose[:3, :3].T + pose[:3, 3])
    eye = paper.eye[2] / paper.eye[3]
    first = 0.0 if eye < 0 else volume.size[found.axis] - 1.0
    np.testing.assert_allclose(
        ours - ours[0], (theirs - theirs[0]) * (1 - first / eye), rtol=MATRIX, atol=1e3 * MATRIX
    )


def test_nothing_but_the_rays_matters_to_what_is_composited():
    """A part of a view shows what the whole view shows there."""
    volume = waves()
    whole = before(volume, (0.4, 0.3, 1), pixels=32)
    wall = whole.wall
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    corner = wall.lower_left + across / 4 + up / 2
    part = View.through_wall(whole.eye, Wall(corner, corner + across / 2, corner + up / 4, pixels=(16, 8)))
    pictures = [single_axis.render(volume, RAMP, view) for view in (whole, part)]
    assert pictures[1][..., 3].max() > 0.2
    np.testing.assert_allclose(pictures[0][8:16, 8:24], pictures[1], atol=FLOAT32_PICTURE)
    sizes = [single_axis.composite(volume, RAMP, view).pixels.size for view in (whole, part)]
    assert sizes[1] < 0.6 * sizes[0]


def test_a_plane_takes_slices_away_one_by_one():
    slab = Slab((9, 9, 9), opacity=OPACITY)
    view = before(slab.volume, (0, 0, 1))
    pictures = [
        single_axis.render(slab.volume, slab.transfer, view, Regions(clip=[(0, 0, -1, depth)]))
        for depth in (3.2, 3.8, 4.2)
    ]
    assert np.array_equal(pictures[0], pictures[1])
    for picture, slices in zip(pictures, (4, 4, 5), strict=True):
        assert abs(picture[16, 16, 3] - (1 - (1 - OPACITY) ** slices)) < FLOAT32_PICTURE


def test_voxels_without_value_are_transparent():
    data = np.full((5, 9, 9), 30, np.float32)
    data[2, 4, 4] = np.nan
    volume = Volume(data)
    picture = single_axis.render(volume, RAMP, before(volume, (0, 0, 1), 20.0, 3.0))
    opacity = float(RAMP.opacity(30.0))
    assert np.isfinite(picture).all()
    assert abs(picture[16, 16, 3] - (1 - (1 - opacity) ** 4)) < FLOAT32_PICTURE
    assert abs(picture[16, 7, 3] - (1 - (1 - opacity) ** 5)) < FLOAT32_PICTURE


def test_the_warp_interpolates_between_the_middles_of_pixels(rng):
    row, column = np.indices((5, 8)) + 0.5
    image = np.repeat((2 * column - 3 * row)[..., None], 4, -1).astype(np.float32)
    places = rng.uniform(0.5, (7.5, 4.5), (3, 30, 2))
    found = single_axis._looked_up(image, places)
    np.testing.assert_allclose(found[..., 2], places @ (2, -3), atol=20 * FLOAT32_PICTURE)
    beyond = np.array([[-0.6, 2], [8.6, 2], [2, -0.6], [2, 5.6], [np.nan, np.nan]])
    assert not single_axis._looked_up(image, beyond).any()


# --- Where there is no picture -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("eye", "centre"),
    [((4, 4, 4), (8, 8, 8)), ((4.1, 3.2, 0), (4, 4, 8)), ((60, 4, 100), (5, 4, 100))],
    ids=["inside", "on the first slice", "beside the slices"],
)
def test_an_eye_in_the_slab_of_slices_has_none(eye, centre):
    long = eye[2] > 50
    volume = Volume(np.full((201 if long else 9, 9, 9), 30, np.uint8))
    view = View.look_at(eye, centre, (0, 1, 0), 60, (8, 6))
    assert single_axis.principal_axis(volume, eye) == 2
    picture = single_axis.render(volume, RAMP, view)
    assert picture.shape == (6, 8, 4) and np.isnan(picture).all()
    assert not list(single_axis.faces_of(volume, RAMP, view))


def test_what_is_behind_the_viewer_is_not_drawn():
    volume = waves()
    eye = volume.centre + (0, 0, 30)
    for centre, seen in ((volume.centre, True), (eye + (0, 0, 9), False)):
        picture = single_axis.render(volume, RAMP, View.look_at(eye, centre, (0, 1, 0), 60, (16, 16)))
        assert picture.any() == seen and np.isfinite(picture).all()


# --- In the atlas ------------------------------------------------------------------------------------------


def test_the_atlas_shows_what_it_lacks_at_a_slant():
    """Along the axes a slice too many; along edges and corners rays that are √2 and √3 longer, too."""
    found = [finding for finding in obliquity.run(Scale(quick=True), lambda *_: None) if finding.single_axis]
    opacity = {f.metric: f.single_axis for f in found if "closed form" in f.metric}
    along_axes, along_edges, along_corners, *frusta = opacity.values()
    assert OPACITY / 2 < along_axes < along_edges < along_corners
    assert len(frusta) == 2 and min(frusta) > OPACITY
    assert all(f.ray_caster is None or f.strips[0].single_axis is not None for f in found)
    slanted = [f for f in found if f.ray_caster is not None and "√" in f.metric]
    assert len(slanted) == 4 and all(f.single_axis > f.ray_caster for f in slanted)
