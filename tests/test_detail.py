"""Levels of detail in pictures: which distances they serve, what they leave exact, and what they are for."""

from __future__ import annotations

import numpy as np
import pytest
import twins
from tolerances import (
    CLOSED_FORM,
    COMPOSITE_TWIN,
    FLICKER,
    NO_POP,
    NOISE_BRIGHTNESS,
    RAMP_BRIGHTNESS,
    VOXEL_BRIGHTNESS,
)
from views import DIRECTIONS, direction, face_view, view_of

from persp_sw import Regions, Renderer, Settings, TransferFunction, View, Volume, Wall, reference
from persp_sw.geometry.detail_zones import detail_zones
from persp_sw.measure.exact import Ramp, Slab
from persp_sw.optics.classification import Classification
from persp_sw.volume.levels import STANDARD_AXES, standard_rows

HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.5)], 1.0)
THIN_HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.05)], 1.0)
# So thin that a ray's alpha is its extinction's integral to 1 %, and extinction is linear in the value.
THIN = TransferFunction([(0, (1, 1, 1), 0), (255, (1, 1, 1), 2e-4)], 1.0)


def renderer_of(volume, transfer, regions=None, **settings):
    return Renderer(volume, transfer, Settings(residual=0, **settings), regions)


def levels_used(renderer):
    return sorted(renderer.detail._stores)


def noise(shape, seed=0):
    return Volume(np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8))


def smooth(shape):
    z, y, x = np.indices(shape)
    data = 120 + 100 * np.sin(0.16 * x + 0.2) * np.cos(0.2 * y) * np.sin(0.12 * z + 0.7)
    return Volume(data.astype(np.float32))


# --- Zones ------------------------------------------------------------------------------------------------


def shares_at(zones, distance, levels):
    """Share of each level at a distance."""
    (zone,) = (zone for zone in zones if zone.near <= distance < zone.far)
    shares = np.zeros(levels + 1)
    share = zone.share[0] + zone.share[1] * distance
    shares[zone.fine : zone.fine + 2] = 1 - share, share
    return shares


def wanted_shares(apart, levels):
    """From what is said: a level begins where pixels are 2.4 of the finer's voxels apart, rules at 3.4."""
    shares = np.zeros(levels + 1)
    shares[0] = 1.0
    for level in range(levels - 1):
        coarser = np.clip((apart / 2**level - 2**1.25) / (2**1.75 - 2**1.25), 0, 1)
        shares[level + 1] = shares[level] * coarser
        shares[level] -= shares[level + 1]
    return shares


@pytest.mark.parametrize("levels", [1, 2, 3, 8])
@pytest.mark.parametrize(("pitch", "farthest"), [(0.03, 900.0), (0.03, 100.0), (0.5, 33.0), (1e-3, 1500.0)])
def test_every_distance_has_the_shares_that_its_pixels_ask_for(pitch, farthest, levels):
    zones = list(detail_zones(pitch, 0.0, farthest, levels))
    assert zones[0].near == 0
    assert zones[-1].far == np.inf
    assert [zone.far for zone in zones[:-1]] == [zone.near for zone in zones[1:]]
    for distance in np.geomspace(1e-3, farthest, 400):
        shares = shares_at(zones, distance, levels)
        np.testing.assert_allclose(shares, wanted_shares(pitch * distance, levels), atol=1e-12)


def test_shares_are_continuous_where_zones_meet():
    levels = 6
    zones = list(detail_zones(0.1, 0.0, 1e4, levels))
    assert [zone.fine for zone in zones] == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5]
    for zone in zones[1:]:
        before, after = (shares_at(zones, zone.near * s, levels) for s in (1 - 1e-9, 1 + 1e-9))
        np.testing.assert_allclose(before, after, atol=1e-7)


def test_no_zone_begins_behind_the_volume_and_one_level_needs_none():
    assert len(list(detail_zones(0.1, 0.0, 23.7, 5))) == 1
    assert len(list(detail_zones(0.1, 0.0, 23.9, 5))) == 2
    assert [zone.far for zone in detail_zones(0.1, 0.0, 1e4, 1)] == [np.inf]


@pytest.mark.parametrize("apart", [0.3, 2.0, 2.9, 3.5, 4.0, 5.0, 7.9, 8.1, 1e3])
@pytest.mark.parametrize("levels", [1, 2, 4])
def test_parallel_rays_have_one_zone(apart, levels):
    (zone,) = detail_zones(0.0, apart, 50.0, levels)
    assert (zone.near, zone.far) == (0, np.inf)
    for distance in (0.0, 17.0):
        shares = shares_at([zone], distance, levels)
        np.testing.assert_allclose(shares, wanted_shares(apart, levels), atol=1e-12)


# --- Exact ------------------------------------------------------------------------------------------------

CUT = Regions(crop=(1.3, 90.8, 0, 41.25, 0.5, 29.1), clip=[(0.3, -0.5, 0.8, -1.1), (-1, 0, 0, 86.1)])


@pytest.mark.parametrize("regions", [Regions(), CUT])
@pytest.mark.parametrize("quality", [0.1, 0.15, 0.2, 0.3, 0.5])
def test_a_homogeneous_medium_is_exact_at_every_quality(quality, regions):
    slab = Slab(size=(97, 44, 33), opacity=0.02)
    renderer = renderer_of(slab.volume, slab.transfer, regions, quality=quality)
    for towards in DIRECTIONS[:5]:
        view = view_of(slab.volume, towards, distance=1.1)
        image = renderer.composite(view.eye, [view.wall])
        for number in range(len(image.faces)):
            expected = slab.image(face_view(image, number), regions)
            assert expected.max() > 0.1
            assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM
    assert len(levels_used(renderer)) > 1


@pytest.mark.parametrize("regions", [Regions(), CUT])
@pytest.mark.parametrize("quality", [0.1, 0.17, 0.25, 0.4])
def test_a_homogeneous_medium_is_exact_in_parallel_views(quality, regions):
    slab = Slab(size=(97, 44, 60), opacity=0.02)
    renderer = renderer_of(slab.volume, slab.transfer, regions, quality=quality)
    for towards in DIRECTIONS[:5]:
        view = View.parallel(
            slab.volume.centre + 200 * towards, slab.volume.centre, (0.3, 1, 0.2), 90, (40, 30)
        )
        image = renderer.composite(view.eye, [view.wall])
        expected = slab.image(parallel_face_view(image), regions)
        assert expected.max() > 0.1
        assert np.abs(image.face_pixels(0) - expected).max() < CLOSED_FORM
    assert len(levels_used(renderer)) > 1


def parallel_face_view(image):
    """The view whose rays are those of the face of an eye at infinity; its wall is slice 0."""
    (face,) = image.faces
    axes = list(STANDARD_AXES[face.axis])
    low = np.array(face.origin)
    high = low + np.array(face.size) * face.pitch
    corners = np.zeros((3, 3))
    corners[:, axes[:2]] = (low[0], high[1]), (high[0], high[1]), (low[0], low[1])
    wall = Wall(*corners, pixels=face.size)  # the pose is the identity
    return View.through_wall(image.eye, wall)


# --- The plain twin ---------------------------------------------------------------------------------------


def pixel_of_levels(renderer, image, u, v):
    """One pixel, float64: all levels' planes in order, each piece with its level's share in its middle."""
    (face,) = image.faces
    volume, axes, sign = renderer.volume, list(STANDARD_AXES[face.axis]), face.sign
    classification = Classification.of(renderer.transfer, volume)
    eye = image.eye.position[axes]  # the pose is the identity
    t = np.array(face.origin) + (np.array([u, v]) + 0.5) * face.pitch
    ray = np.array([*t, sign])
    size = np.array(volume.size)[axes] - 1.0
    ends = np.sort([-eye / ray, (size - eye) / ray], axis=0)
    near, far = max(ends[0].max(), 0), ends[1].min()
    pieces = []
    for zone in detail_zones(face.pitch, 0.0, np.inf, len(renderer.detail)):
        begin, end = max(near, zone.near), min(far, zone.far)
        for number in (zone.fine, zone.fine + 1)[: 1 + any(zone.share)]:
            factor = renderer.detail.levels.factor(number)[axes].astype(float)
            slices = renderer.detail.levels.level(number).size[face.axis]
            for slice_ in range(slices):
                distance = sign * (slice_ * factor[2] - eye[2])
                first, last = max(distance - factor[2] / 2, begin), min(distance + factor[2] / 2, end)
                if first < last:
                    share = zone.share[0] + zone.share[1] * (first + last) / 2
                    share = share if number > zone.fine else 1 - share
                    pieces.append((zone.near, distance, number, slice_, share * (last - first), factor))
    result = np.zeros(4)
    for _, distance, number, slice_, length, factor in sorted(pieces, key=lambda piece: piece[:3]):
        rows = standard_rows(renderer.detail.levels.level(number), face.axis)[:, slice_].astype(float)
        j, i = (np.clip(eye[:2] + t * distance, 0, size[:2]) / factor[:2])[::-1]
        j0, i0 = min(int(j), rows.shape[0] - 2), min(int(i), rows.shape[1] - 2)
        weights = np.outer([1 - (j - j0), j - j0], [1 - (i - i0), i - i0])
        value = (rows[j0 : j0 + 2, i0 : i0 + 2] * weights).sum()
        table = classification.table
        *colour, tau = table[
            twins.entries(value, classification.origin, classification.scale, len(table) - 1)
        ].astype(float)
        covered = (1 - result[3]) * -np.expm1(-tau * np.linalg.norm(ray) * length)
        result += covered * np.array([*colour, 1])
    return result


@pytest.mark.parametrize("towards", [DIRECTIONS[0], DIRECTIONS[2], DIRECTIONS[3]])
def test_every_pixel_equals_the_plain_twin(towards):
    renderer = renderer_of(
        smooth((70, 67, 68)), THIN_HAZE, quality=0.2, samples_per_interval=1, single_face_tangent=8
    )
    view = view_of(renderer.volume, towards, distance=1.6, fovy=30)
    image = renderer.composite(view.eye, [view.wall])
    assert len(image.faces) == 1
    assert image.faces[0].steepest < 1.5
    assert len(levels_used(renderer)) > 2
    pixels = image.face_pixels(0)
    assert pixels[..., 3].max() > 0.3
    for v, u in np.ndindex(pixels.shape[:2]):
        if (u + v) % 3 == 0:
            expected = pixel_of_levels(renderer, image, u, v)
            assert np.abs(pixels[v, u] - expected).max() < COMPOSITE_TWIN, (u, v)


# --- Brightness -------------------------------------------------------------------------------------------


def brightness(renderer, view):
    """Sum over a face's pixels, times what one pixel covers."""
    image = renderer.composite(view.eye, [view.wall])
    (face,) = image.faces
    return image.pixels[:, 3].sum(dtype=float) * face.pitch**2


def relative_brightness(volume, view, quality, **settings):
    """That of a volume over that of a homogeneous one, whose rays are the same."""
    full = Volume(np.full(volume.data.shape, 128, np.uint8))
    one, other = (brightness(renderer_of(v, THIN, quality=quality, **settings), view) for v in (volume, full))
    return one / other


@pytest.mark.parametrize("quality", [0.125, 0.2, 0.25, 0.35, 0.5])
@pytest.mark.parametrize("axis", range(3))
def test_a_linear_ramp_keeps_its_mean_brightness(axis, quality):
    """What a coarse end voxel has too much at the ramp's foot, that at its top has too little."""
    ramp = Ramp((129, 130, 131), axis=axis, colours=((1, 1, 1),) * 2, opacities=(0.0, 1e-4))
    renderer = renderer_of(ramp.volume, ramp.transfer, quality=quality)
    for towards in (direction(0.3, 0.2, 1), direction(-1, 0.2, 0.3)):
        view = view_of(ramp.volume, towards, distance=1.8, fovy=60)
        image = renderer.composite(view.eye, [view.wall])
        expected = ramp.image(face_view(image, 0))[..., 3].sum()
        assert abs(image.face_pixels(0)[..., 3].sum() / expected - 1) < RAMP_BRIGHTNESS
    assert len(levels_used(renderer)) > 1


@pytest.mark.parametrize("quality", [0.125, 0.2, 0.25, 0.35, 0.5])
def test_noise_of_linear_extinction_keeps_its_mean_brightness(quality):
    volume = noise((65, 65, 65))
    view = view_of(volume, direction(0.3, 0.2, 1), distance=1.8, fovy=60)
    fine = relative_brightness(volume, view, 1.0)
    assert abs(relative_brightness(volume, view, quality) / fine - 1) < NOISE_BRIGHTNESS


def test_a_bright_voxel_keeps_its_mean_brightness_wherever_pixels_fall():
    """Averaged over shifts of the eye: extinction times a voxel's volume, over the distance squared."""
    data = np.zeros((65, 65, 65), np.float32)
    data[32, 31, 33] = 255
    transfer = TransferFunction([(0, (1, 1, 1), 0), (255, (1, 1, 1), 0.002)], 1.0)
    renderer = renderer_of(Volume(data), transfer, quality=0.25, skip_empty=False)  # as wide as the box
    centre, distance = np.array([33.0, 31, 32]), 130.0
    view = View.look_at(centre + (0, 0, distance), centre, (0, 1, 0), 40, (64, 64))
    (face,) = renderer.composite(view.eye, [view.wall]).faces
    ratios = []
    for shift in np.ndindex(9, 9):
        # Pixels keep their tangents while the eye moves, so that this is all places between four of them.
        offset = np.array([*(np.array(shift) / 9 * face.pitch * distance), distance])
        view = View.look_at(centre + offset, centre, (0, 1, 0), 40, (64, 64))
        expected = -np.log(1 - 0.002) * np.linalg.norm(offset) / distance**3
        ratios.append(brightness(renderer, view) / expected)
    assert len(levels_used(renderer)) > 1
    assert abs(np.mean(ratios) - 1) < VOXEL_BRIGHTNESS
    assert np.std(ratios) < 0.5


# --- In motion --------------------------------------------------------------------------------------------


def path_pictures(renderer, eyes, centre, size=(32, 32), fovy=35):
    """Pictures from a path of eyes, all through walls of one size."""
    return np.array([renderer.render(View.look_at(eye, centre, (0, 1, 0), fovy, size)) for eye in eyes])


def changes(pictures):
    return np.sqrt(np.mean(np.diff(pictures.astype(float), axis=0) ** 2, axis=(1, 2, 3)))


def test_nothing_pops_where_levels_take_over():
    """The eye draws back, and zone after zone moves through the volume: no step stands out."""
    volume = smooth((49, 57, 97))
    renderer = renderer_of(volume, THIN_HAZE, quality=0.25)
    centre = volume.centre
    eyes = [centre + distance * direction(0.3, 0.2, 1) for distance in np.linspace(75, 95, 41)]
    ours = changes(path_pictures(renderer, eyes, centre))
    views = [View.look_at(eye, centre, (0, 1, 0), 35, (32, 32)) for eye in eyes[::10]]
    truth = np.array([reference.render(volume, THIN_HAZE, view) for view in views])
    assert len(levels_used(renderer)) > 2
    assert ours.max() < NO_POP * changes(truth).max() / 10


@pytest.mark.parametrize("kind", ["noise", "checkerboard"])
def test_fine_structure_flickers_less_than_without_levels(kind):
    """Much of the path is within a pixel. The view lies inside the box's silhouette, which does move."""
    volume = noise((33, 129, 129))
    if kind == "checkerboard":
        volume = Volume((255 * (np.indices((33, 129, 129)).sum(0) % 2)).astype(np.uint8))
    centre = volume.centre
    eyes = [centre + (0.2 * step, 0.03 * step, 130.0) for step in range(24)]
    energy = {}
    for levels in (True, False):
        renderer = renderer_of(volume, THIN_HAZE, quality=0.25, level_of_detail=levels)
        pictures = path_pictures(renderer, eyes, centre, size=(64, 64), fovy=30)
        energy[levels] = np.mean((pictures - pictures.mean(0)) ** 2)
    assert energy[True] < FLICKER * energy[False]


# --- Work -------------------------------------------------------------------------------------------------


def test_fewer_pixels_and_coarser_voxels_are_less_work():
    volume = noise((97, 97, 97))
    view = view_of(volume, DIRECTIONS[0])
    taken = [
        renderer_of(volume, THIN, quality=quality).composite(view.eye, [view.wall]).samples
        for quality in (0.2, 0.25, 0.3, 0.5, 1.0)
    ]
    assert taken == sorted(taken)
    without = renderer_of(volume, THIN, quality=0.2, level_of_detail=False)
    assert taken[0] < without.composite(view.eye, [view.wall]).samples
