"""Eye images drawn for an eye that has moved since: where every pixel looks, and that seams hold."""

from dataclasses import replace

import numpy as np
import pytest
from moved_eyes import SOLID, coloured_noise, composited, moved
from tolerances import FLOAT32_IMAGE, WARP_LINEAR
from views import DIRECTIONS, random_pose, random_rotation, view_of

from persp_sw import Eye, View, Volume, Wall
from persp_sw.errors import ViewError
from persp_sw.kernels.warp import warp
from persp_sw.volume.levels import STANDARD_AXES
from persp_sw.warp import software
from persp_sw.warp.moved import distance_of
from persp_sw.warp.software import warp_eye_image


@pytest.fixture
def volume(rng):
    return coloured_noise(rng)


def around(eye, rotation, pixels=(41, 37)):
    """Six walls that surround an eye."""
    corners = [(-1, -1, 1), (1, -1, 1), (-1, 1, 1)]
    return [
        Wall(*(eye + rotation @ np.roll(c, axis) * sign for c in corners), pixels)
        for axis in range(3)
        for sign in (-1, 1)
    ]


def with_tangents(image):
    """The image whose pixels hold their own tangents, and their face's axis and sign."""
    image = replace(image, pixels=np.empty_like(image.pixels), slabs=())
    for number, face in enumerate(image.faces):
        u, v = np.meshgrid(*(np.arange(n) + 0.5 for n in face.size))
        t_i, t_j = face.origin[0] + u * face.pitch, face.origin[1] + v * face.pitch
        image.face_pixels(number)[:] = np.stack([t_i, t_j, face.axis + 0 * u, face.sign + 0 * u], -1)
    return image


def seen_in_box(image, view):
    """Where rays of a view leave the box of half-size D about the image's eye: (h, w, 3), relative to it.

    In voxels. Of a single face, where they meet its plane. From points and planes, without tangents.
    """
    object_from_world = np.linalg.inv(image.world_from_object)
    start, eye = (
        object_from_world[:3, :3] @ e.position + object_from_world[:3, 3] for e in (view.eye, image.eye)
    )
    directions = view.directions() @ object_from_world[:3, :3].T
    ways = []
    for axis, sign in {(f.axis, f.sign) for f in image.faces} if len(image.faces) == 1 else SIDES:
        plane = eye[axis] + sign * distance_of(image)
        with np.errstate(divide="ignore"):
            way = (plane - start[axis]) / directions[..., axis]
        ways.append(np.where(sign * directions[..., axis] > 0, way, np.inf))
    return start + np.min(ways, 0)[..., None] * directions - eye


SIDES = [(axis, sign) for axis in range(3) for sign in (-1, 1)]


@pytest.mark.parametrize("distance, single, faces", [(1.7, 3, 1), (0.9, 1, 3), (0.2, 3, 5)])
def test_every_pixel_looks_where_its_ray_meets_the_images_plane(volume, rng, distance, single, faces):
    """Faces that hold their tangents: bilinear look-up reproduces them. One face, several, from inside."""
    counts = set()
    for towards in DIRECTIONS:
        view = view_of(volume, towards, distance, fovy=100 if distance < 1 else 60, size=(51, 43))
        image = with_tangents(composited(volume, view, single_face_tangent=single))
        counts.add(len(image.faces))
        shift = rng.uniform(-0.3, 0.3, 3) * distance_of(image) * 0.7  # of the finest spacing
        picture = warp_eye_image(image, moved(view, shift))
        shown = picture[..., 3] != 0
        assert shown.sum() > 100
        points = seen_in_box(image, moved(view, shift))[shown]
        unsure = np.zeros(len(points), bool)
        expected = np.full((len(points), 4), np.nan)
        for face in image.faces:
            i, j, k = STANDARD_AXES[face.axis]
            along = face.sign * points[:, k]
            aside = np.abs(points[:, [i, j]]).max(-1)
            own = along >= aside if len(image.faces) > 1 else along > 0
            # Near a seam two faces tell their tangents; how near, differs from face to face for a moved eye.
            unsure |= np.abs(along - aside) < 0.3 * aside if len(image.faces) > 1 else False
            expected[own] = np.column_stack(
                [points[own][:, [i, j]] / along[own, None], np.full((own.sum(), 2), (face.axis, face.sign))]
            )
        assert (~unsure).sum() > 100
        assert np.abs(picture[shown] - expected)[~unsure].max() < WARP_LINEAR
    assert max(counts) == faces


def own_rays(image, view):
    """What the kernel needs for the image's own eye: rays' directions are tangents, at no distance."""
    directions = np.linalg.inv(image.world_from_object)[:3, :3] @ view.direction_from_pixel
    matrices, borders, c = [], [], image.alone
    for face in image.faces:
        i, j, along = directions[list(STANDARD_AXES[face.axis])] * np.array([[1], [1], [face.sign]])
        borders.append([along - c * i, along + c * i, along - c * j, along + c * j])
        (t_i, t_j), p = face.origin, face.pitch
        to_pixels = np.array([[1 / p, 0, -t_i / p - 0.5], [0, 1 / p, -t_j / p - 0.5], [0, 0, 1]])
        matrices.append(to_pixels @ np.array([i, j, along]))
    return np.array(matrices), np.array(borders) if len(image.faces) > 1 else np.empty((1, 0, 3))


def test_an_eye_that_has_not_moved_sees_the_image_itself(volume, monkeypatch):
    """Bit for bit, wherever image and slabs lie: the kernel gets the numbers that know no distance."""
    given = []
    monkeypatch.setattr(software, "warp", lambda *arguments: given.append(arguments) or warp(*arguments))
    for distance, single in ((1.7, 3), (0.2, 1)):
        view = view_of(volume, DIRECTIONS[1], distance, fovy=80)
        image = composited(volume, view, single_face_tangent=single)
        truth = warp_eye_image(image, view)
        slabs = (replace(image, depth=3.0), replace(image, depth=9.0))
        for other in (image, replace(image, depth=5.0), replace(image, depth=5.0, slabs=slabs)):
            given.clear()
            np.testing.assert_array_equal(warp_eye_image(other, view), truth)
            assert len(given) == 1
            for found, expected in zip(given[0], own_rays(image, view), strict=False):
                np.testing.assert_array_equal(found, expected)


def test_measuring_the_depth_changes_no_pixel(volume):
    for distance in (1.7, 0.2):
        view = view_of(volume, DIRECTIONS[1], distance, fovy=80)
        plain, placed = composited(volume, view), composited(volume, view, depth_slabs=1)
        assert plain.depth is None and placed.depth > 0 and placed.slabs == ()
        np.testing.assert_array_equal(placed.pixels, plain.pixels)
        assert placed.samples > plain.samples


def test_from_inside_a_moved_eye_sees_all_around(rng):
    """Faces of one colour all around: every pixel of six walls has it, and no pixel twice; far shifts too."""
    volume = Volume(np.ones((19, 18, 17), np.uint8), world_from_object=random_pose(rng, shear=0.3))
    constant = np.array([0.3, 0.2, 0.1, 0.6], np.float32)
    for size in (0.01, 0.5, 3.0) * 4:
        eye = volume.centre + rng.uniform(-1, 1, 3)
        walls = around(eye, random_rotation(rng))
        image = composited(volume, View(Eye(eye), walls[0]), walls=walls)
        assert len(image.faces) == 6
        image.pixels[:] = constant
        shift = random_rotation(rng)[0] * size
        around_moved = around(eye + shift, random_rotation(rng))
        for wall in around_moved:
            picture = warp_eye_image(image, View(Eye(eye + shift), wall))
            assert np.abs(picture - constant).max() < FLOAT32_IMAGE


def test_inside_a_solid_box_a_moved_eye_sees_no_crack(rng):
    """Composited, not painted: everything is opaque for an eye and for one that has moved."""
    volume = Volume(np.ones((19, 18, 17), np.uint8), world_from_object=random_pose(rng, shear=0.3))
    eye = volume.centre + (0.3, -0.2, 0.6)
    walls = around(eye, random_rotation(rng))
    image = composited(volume, View(Eye(eye), walls[0]), SOLID, walls)
    for _ in range(6):
        shift = random_rotation(rng)[0] * rng.uniform(0, 2)
        for wall in around(eye + shift, random_rotation(rng)):
            assert warp_eye_image(image, View(Eye(eye + shift), wall))[..., 3].min() > 0.99


def test_parallel_rays_serve_no_other_eye(volume):
    views = [
        View.parallel(volume.centre + d, volume.centre, (0.1, 0.9, 0.3), 40, (30, 20)) for d in DIRECTIONS[:2]
    ]
    image = composited(volume, views[0], depth_slabs=4)
    assert image.slabs == () and image.depth is None
    assert warp_eye_image(image, views[0]).any()
    for view in (views[1], view_of(volume, DIRECTIONS[0])):
        with pytest.raises(ViewError, match="parallel"):
            warp_eye_image(image, view)
    with pytest.raises(ViewError, match="parallel"):
        warp_eye_image(composited(volume, view_of(volume, DIRECTIONS[0])), views[0])
