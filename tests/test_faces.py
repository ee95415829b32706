"""Faces: every ray that meets the box and a wall is covered, and the pitch follows the view."""

import numpy as np
import pytest
import twins
from views import DIRECTIONS, random_pose, view_of

from persp_sw import View, Volume, Wall
from persp_sw.geometry.faces import EyeGeometry, faces_for, needs_of
from persp_sw.geometry.seams import REACH, shares
from persp_sw.geometry.sight import Sights, tangents


def geometry_of(volume, *views):
    inverse = np.linalg.inv(volume.world_from_object)
    eye = inverse[:3, :3] @ views[0].eye.position + inverse[:3, 3]
    return EyeGeometry(eye, np.zeros(3), np.array(volume.size) - 1.0, views, inverse)


def plan(geometry, quality=1.0, single=3.0, max_size=4096):
    return faces_for(needs_of(geometry, single), quality=quality, max_size=max_size)


def empty_volume(size=(20, 30, 25), **pose):
    return Volume(np.zeros(size[::-1], np.uint8), **pose)


def rays_that_meet(geometry, view):
    directions = view.directions().reshape(-1, 3) @ geometry.object_from_world[:3, :3].T
    with np.errstate(divide="ignore"):
        one, other = (geometry.low - geometry.eye) / directions, (geometry.high - geometry.eye) / directions
    near, far = np.minimum(one, other).max(1), np.maximum(one, other).min(1)
    return directions[(near < far) & (far > 0)]


def covers(face, directions):
    """Whether the warp's bilinear look-up finds four pixels for each direction, in this face."""
    t = tangents(directions, face.axis, face.sign)
    at = (t[:, :2] - face.origin) / face.pitch - 0.5
    return (t[:, 2] > 0) & (at >= 0).all(1) & (at <= np.array(face.size) - 1).all(1)


@pytest.mark.parametrize("kind", ["plain", "oblique", "mirrored", "sheared", "flat"])
@pytest.mark.parametrize("distance", [0.55, 0.8, 1.7, 20])
def test_every_ray_that_matters_is_covered_by_the_face_that_owns_it(kind, distance, rng):
    pose = {
        "plain": np.eye(4),
        "oblique": random_pose(rng, spacing=(1, 2, 0.5)),
        "mirrored": random_pose(rng, mirrored=True),
        "sheared": random_pose(rng, shear=0.5),
        "flat": np.diag([1, 1, 20.0, 1]),
    }[kind]
    volume = empty_volume(world_from_object=pose)
    met = 0
    for towards in DIRECTIONS:
        for fovy in (30, 100) if distance < 2 else (3, 20):
            view = view_of(volume, towards, distance, fovy, size=(40, 30))
            geometry = geometry_of(volume, view)
            if ((geometry.eye >= geometry.low) & (geometry.eye <= geometry.high)).all():
                continue
            faces = plan(geometry)
            directions = rays_that_meet(geometry, view)
            met += len(directions)
            if len(faces) == 1:
                assert covers(faces[0], directions).all()
                continue
            owned = np.zeros(len(directions), bool)
            for face in faces:
                along = face.sign * directions[:, face.axis]
                own = along >= np.abs(directions).max(1)
                assert covers(face, directions[own]).all()
                owned |= own
            assert owned.all()
    assert met > 300


def test_one_face_where_it_serves_several_where_not():
    volume = empty_volume((21, 21, 21))
    far = geometry_of(volume, view_of(volume, DIRECTIONS[1], 3))
    near = geometry_of(volume, view_of(volume, DIRECTIONS[1], 0.9, fovy=120))
    assert len(plan(far)) == 1
    assert len(plan(near, single=3)) == 3
    assert all(face.steepest < 1 + 10 * face.pitch for face in plan(near))  # the width is rounded up to 16
    assert len(plan(far, single=1)) == 3  # a corner has rays of all three faces


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_all_six_faces_are_chosen(axis, sign):
    volume = empty_volume()
    towards = np.zeros(3)
    towards[axis] = -sign
    (face,) = plan(geometry_of(volume, view_of(volume, towards, 2)))
    assert (face.axis, face.sign) == (axis, sign)


def test_nothing_behind_or_beside_the_walls_costs_a_face():
    volume = empty_volume()
    eye = volume.centre + np.array([0, 0, 60])
    for towards, fovy in (((0, 0, 1), 90), ((1, 0, 0), 60)):
        away = View.look_at(eye, eye + np.array(towards), (0, 1, 0), fovy, (32, 32))
        assert plan(geometry_of(volume, away)) == []


def test_several_walls_share_the_union():
    volume = empty_volume((80, 90, 85))
    eye = volume.centre + np.array([5.0, 3.0, 180.0])
    left = View.look_at(eye, volume.centre - np.array([24, 0, 0]), (0, 1, 0), 10, (64, 64))
    right = View.look_at(eye, volume.centre + np.array([24, 0, 0]), (0, 1, 0), 10, (64, 64))
    faces = [plan(geometry_of(volume, *views))[0] for views in ([left], [right], [left, right])]
    both = geometry_of(volume, left, right)
    assert covers(faces[2], np.concatenate([rays_that_meet(both, left), rays_that_meet(both, right)])).all()
    assert faces[2].pitch <= min(faces[0].pitch, faces[1].pitch) * 1.01


def test_a_frustum_that_sees_a_corner_needs_only_that_part():
    volume = empty_volume((60, 60, 60))
    eye = volume.centre + np.array([0, 0, 120.0])
    whole = plan(geometry_of(volume, View.look_at(eye, volume.centre, (0, 1, 0), 40, (64, 64))))[0]
    part = plan(geometry_of(volume, View.look_at(eye, volume.centre, (0, 1, 0), 4, (64, 64))))[0]
    spans = [np.array(f.size) * f.pitch for f in (whole, part)]
    assert (spans[1] < spans[0] / 2).all()


def test_pitch_is_a_pixel_a_voxel_in_front_where_the_view_magnifies():
    volume = empty_volume((21, 21, 21))
    view = view_of(volume, (0, 0, 1), distance=3, fovy=25, size=(400, 400))
    (face,) = plan(geometry_of(volume, view))
    front, back = 60 - 10, 60 + 10  # slices from the eye
    assert face.pitch == pytest.approx(1 / max(front, back / 2))
    assert plan(geometry_of(volume, view), quality=2)[0].pitch == pytest.approx(face.pitch / 2)


def test_pitch_is_the_walls_own_where_the_view_minifies():
    volume = empty_volume((201, 201, 201))
    view = view_of(volume, (0, 0, 1), distance=3, fovy=25, size=(40, 40))
    (face,) = plan(geometry_of(volume, view))
    pixel = 2 * np.tan(np.radians(12.5)) / 40
    assert face.pitch == pytest.approx(pixel, rel=0.02)


def test_close_by_the_image_does_not_shrink_to_nothing():
    volume = empty_volume((41, 41, 41))
    sizes = []
    for gap in (10, 1, 0.1, 0.001):
        eye = np.array([20, 20, 40 + gap])
        view = View.look_at(eye, (20, 20, 0), (0, 1, 0), 60, (400, 400))
        sizes.append(max(plan(geometry_of(volume, view))[0].size))
    assert min(sizes) >= 20


@pytest.mark.parametrize("limit", [16, 250, 256])
def test_size_never_exceeds_the_limit(limit):
    volume = empty_volume((200, 200, 200))
    view = view_of(volume, DIRECTIONS[0], 1.7, size=(800, 800))
    (face,) = plan(geometry_of(volume, view), quality=8, max_size=limit)
    assert max(face.size) <= limit
    assert covers(face, rays_that_meet(geometry_of(volume, view), view)).all()


def test_a_grazing_wall_does_not_drive_the_pitch():
    volume = empty_volume((21, 21, 21))
    eye = volume.centre + np.array([0, 0, 40.0])
    grazing = Wall((-1000, -30, 35), (1000, -30, -100), (-1000, 60, 35), (64, 64))
    (face,) = plan(geometry_of(volume, View.through_wall(eye, grazing)))
    assert max(face.size) <= 64


def test_shares_are_halves_on_a_seam_and_one_faces_beyond_its_zone(rng):
    pitch = 0.01
    found = shares(np.array([(1, 0.2, 1), (3, 1, 3 * 0.97), (1, -1, -1), (-0.1, -2, 0.3)]), pitch)
    np.testing.assert_allclose(found[0], [0, 0.5, 0, 0, 0, 0.5])
    np.testing.assert_array_equal(found[1], [0, 1, 0, 0, 0, 0])
    np.testing.assert_allclose(found[2], [0, 1 / 3, 1 / 3, 0, 1 / 3, 0])
    np.testing.assert_array_equal(found[3], [0, 0, 1, 0, 0, 0])
    directions = rng.normal(size=(1000, 3))
    found = shares(directions, pitch)
    np.testing.assert_allclose(found.sum(1), 1)
    largest = np.abs(directions).argmax(1)
    assert (found.argmax(1) == 2 * largest + (directions[np.arange(1000), largest] > 0)).all()


# --- The kernels' plain twins -----------------------------------------------------------------------------


@pytest.mark.parametrize("reach", [1, 1.0625])
@pytest.mark.parametrize("distance", [0.2, 0.45, 0.8, 2])
def test_what_is_seen_equals_the_plain_twin(distance, reach, rng):
    """Bounds of all that is seen and of each pyramid's own, from eyes inside and outside."""
    compared = 0
    for towards in DIRECTIONS:
        volume = empty_volume(world_from_object=random_pose(rng, spacing=(1, 2, 0.5)))
        views = [view_of(volume, towards, distance, fovy, size=(40, 30)) for fovy in (30, 110)]
        geometry = geometry_of(volume, *views)
        sights = Sights.of(geometry, reach)
        sides = sights_sides(geometry)
        parts = [p for m in sights.matrices for p in twins.seen_corners(sides, m, (40, 30))]
        for direction in range(6):
            axis, sign = direction // 2, 1 if direction % 2 else -1
            own = [twins.clip_polygon(p, twins.pyramid_normals(axis, sign, reach)) for p in parts]
            for sight, polygons in ((sights.whole(direction), parts), (sights.own(direction), own)):
                points = np.concatenate([np.empty((0, 3)), *polygons])
                t = tangents(points, axis, sign)
                before = t[:, 2] > 0
                assert (sight is None) == (not before.any())
                if sight is None:
                    continue
                compared += 1
                np.testing.assert_allclose(sight.low, t[before, :2].min(0), rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(sight.high, t[before, :2].max(0), rtol=1e-9, atol=1e-9)
                np.testing.assert_allclose(
                    (sight.nearest, sight.farthest), (t[:, 2].min(), t[:, 2].max()), atol=1e-9
                )
                world = np.linalg.norm(points @ volume.world_from_object[:3, :3].T, axis=1)
                np.testing.assert_allclose(sight.steepest, (world / t[:, 2])[before].max(), rtol=1e-9)
    assert compared > 20


def sights_sides(geometry):
    """The box's sides relative to the eye, corner by corner."""
    ends = np.array([geometry.low, geometry.high]) - geometry.eye
    sides = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, 1):
            side = np.empty((4, 3))
            side[:, axis] = ends[end, axis]
            side[:, u], side[:, v] = ends[[0, 1, 1, 0], u], ends[[0, 0, 1, 1], v]
            sides.append(side)
    return sides


@pytest.mark.parametrize("distance", [0.3, 0.8, 2])
def test_pixel_sizes_equal_the_plain_twin(distance, rng):
    volume = empty_volume(world_from_object=random_pose(rng, spacing=(1, 2, 0.5)))
    for towards in DIRECTIONS[:4]:
        view = view_of(volume, towards, distance, 80, size=(40, 30))
        geometry = geometry_of(volume, view)
        sights = Sights.of(geometry)
        low, high = geometry.low - geometry.eye, geometry.high - geometry.eye
        for only in (None, 2 * np.argmax(np.abs(towards)) + 1, 4):
            sizes = sights.pixel_sizes(geometry, only)
            for direction in range(6) if only is None else [only]:
                axis, sign = direction // 2, 1 if direction % 2 else -1
                own = REACH if only is None else None
                expected = twins.pixel_sizes(sights.matrices[0], (40, 30), low, high, axis, sign, own, 24)
                if expected:
                    expected = twins.weighted_quantile(expected, 0.1)
                    np.testing.assert_allclose(sizes[direction], expected, rtol=1e-3)


def test_a_box_smaller_than_the_grid_has_a_pixel_size():
    volume = empty_volume((3, 3, 3))
    view = View.look_at((1.3, 1.1, 900), (1, 0, 1), (0, 1, 0), 30, (600, 600))
    geometry = geometry_of(volume, view)
    sizes = Sights.of(geometry).pixel_sizes(geometry, None)
    assert sizes[4] == pytest.approx(2 * np.tan(np.radians(15)) / 600, rel=0.01)
    assert not sizes[[0, 1, 2, 3, 5]].any()
