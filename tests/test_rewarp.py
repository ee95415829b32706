"""Eye images drawn for an eye that has moved since: where every pixel looks, seams, slabs, both warps."""

from dataclasses import replace

import numpy as np
import pytest
from exact_faces import COLOUR, VALUE, assert_exact
from test_texture_warp import drawn
from tolerances import CUT_SLICES, FLOAT32_IMAGE, TEXTURE_FLOAT32, WARP_LINEAR
from views import DIRECTIONS, random_pose, random_rotation, view_of

from persp_sw import (
    Canvas,
    Eye,
    Regions,
    Renderer,
    Settings,
    TextureWarp,
    TransferFunction,
    View,
    Volume,
    Wall,
)
from persp_sw.errors import SettingsError, ViewError
from persp_sw.kernels.warp import warp
from persp_sw.seams import close_seams
from persp_sw.slabs import _hidden
from persp_sw.volume.levels import STANDARD_AXES
from persp_sw.warp import software
from persp_sw.warp.moved import distance_of
from persp_sw.warp.software import warp_eye_image

TF = TransferFunction([(0, (1, 0.5, 0.2), 0), (255, (0.3, 1, 1), 0.3)], 1.0)
SOLID = TransferFunction([(0, (1, 0.5, 0.2), 0.99)], 1.0)


@pytest.fixture
def volume(rng):
    """Coloured noise in a turned, stretched, sheared, mirrored pose."""
    pose = random_pose(rng, spacing=(1, 1.5, 0.7), shear=0.2, mirrored=True)
    return Volume(rng.integers(0, 255, (20, 24, 22)).astype(np.uint8), world_from_object=pose)


def composited(volume, view, transfer=TF, walls=None, **settings):
    return Renderer(volume, transfer, Settings(**settings)).composite(view.eye, walls or [view.wall])


def moved(view, shift):
    """The same wall for an eye elsewhere."""
    return View(Eye(view.eye.position + shift, view.eye.near), view.wall)


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
            unsure |= np.abs(along - aside) < 1e-9 * aside if len(image.faces) > 1 else False
            expected[own] = np.column_stack(
                [points[own][:, [i, j]] / along[own, None], np.full((own.sum(), 2), (face.axis, face.sign))]
            )
        assert np.abs(picture[shown] - expected)[~unsure].max() < WARP_LINEAR
    assert max(counts) == faces


def own_rays(image, view):
    """What the kernel needs for the image's own eye: rays' directions are tangents, at no distance."""
    directions = np.linalg.inv(image.world_from_object)[:3, :3] @ view.direction_from_pixel
    matrices, borders = [], []
    for face in image.faces:
        i, j, along = directions[list(STANDARD_AXES[face.axis])] * np.array([[1], [1], [face.sign]])
        borders.append([along - i, along + i, along - j, along + j])
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


def test_slabs_of_a_solid_hold_its_colour_or_nothing(rng):
    """What is hidden is left out: it is as empty as if there were nothing."""
    volume = Volume(np.ones((60, 60, 60), np.uint8))
    view = view_of(volume, DIRECTIONS[0], 2.0)
    image = composited(volume, view, SOLID, depth_slabs=4, quality=2)
    for slab in image.slabs:
        np.testing.assert_allclose(slab.pixels, slab.pixels[:, 3:] * (1, 0.5, 0.2, 1), atol=1e-6)
    first, *_, last = image.slabs
    assert (first.pixels[:, 3] > 0.995).sum() > 2000
    assert not last.pixels[(first.pixels[:, 3] > 0.995)].all() and last.pixels.any()


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
            assert (warp_eye_image(image, View(Eye(eye + shift), wall)) == constant).all()


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


def shells(image, count):
    """`count` slabs of random pixels at growing depths."""
    rng = np.random.default_rng(7)
    pixels = rng.random((count, *image.pixels.shape), np.float32)
    pixels[..., :3] *= pixels[..., 3:]
    depth = distance_of(image)
    return tuple(replace(image, pixels=p, depth=depth * (0.8 + 0.2 * n)) for n, p in enumerate(pixels))


@pytest.mark.parametrize("distance, single", [(1.7, 3), (0.9, 1), (0.2, 1)])
def test_slabs_are_laid_over_one_another_back_to_front(volume, distance, single):
    view = view_of(volume, DIRECTIONS[0], distance, fovy=70, size=(45, 39))
    image = composited(volume, view, single_face_tangent=single)
    image = replace(image, slabs=shells(image, 3))
    other = moved(view, (0.4, -0.3, 0.2))
    front, middle, back = (warp_eye_image(slab, other) for slab in image.slabs)
    expected = middle + (1 - middle[..., 3:]) * back
    expected = front + (1 - front[..., 3:]) * expected
    assert np.abs(warp_eye_image(image, other) - expected).max() < 1e-6


def test_a_canvas_holds_the_last_picture_of_slabs_only(volume):
    canvas = Canvas(64, 48)
    for towards, distance in zip(DIRECTIONS * 2, (1.2, 4, 9, 1.2, 30, 2, 0.8) * 2, strict=True):
        view = view_of(volume, towards, distance)
        image = composited(volume, view)
        image = replace(image, slabs=shells(image, 3))
        for shift in ((0, 0, 0), (3, -2, 1)):
            alone = warp_eye_image(image, moved(view, shift))
            np.testing.assert_array_equal(warp_eye_image(image, moved(view, shift), out=canvas), alone)
            columns = np.arange(64)[None]
            inside = (columns >= canvas.written[:, :1]) & (columns < canvas.written[:, 1:])
            assert not alone[~inside].any() and alone.any()


@pytest.mark.parametrize("slabs", [2, 5])
@pytest.mark.parametrize("distance, faces", [(1.7, 1), (0.2, 4)])
def test_slabs_make_up_the_image(volume, distance, faces, slabs):
    """One over the other, exactly; and nearly the one without slabs, whose slices no cuts pass through."""
    regions = Regions(clip=[(*-DIRECTIONS[0], DIRECTIONS[0] @ volume.centre + 6.0)])
    counts = set()
    for towards in DIRECTIONS[:3]:
        view = view_of(volume, towards, distance, fovy=90)
        settings = [Settings(depth_slabs=k, residual=0) for k in (slabs, 0)]
        pieces, whole = (
            Renderer(volume, TF, each, regions).composite(view.eye, [view.wall]) for each in settings
        )
        counts.add(len(whole.faces))
        assert whole.slabs == () and len(pieces.slabs) == slabs
        assert pieces.faces == whole.faces
        made = np.zeros_like(whole.pixels)
        for slab in pieces.slabs[::-1]:
            made = slab.pixels + (1 - slab.pixels[:, 3:]) * made
        assert np.abs(made - pieces.pixels).max() < FLOAT32_IMAGE
        for slab in pieces.slabs:
            images = [slab.face_pixels(number).copy() for number in range(len(slab.faces))]
            close_seams(slab.faces, images)
            assert np.abs(np.concatenate([p.reshape(-1, 4) for p in images]) - slab.pixels).max() < 1e-6
        assert np.sqrt(np.square(pieces.pixels - whole.pixels).mean()) < CUT_SLICES
        depths = [slab.depth for slab in pieces.slabs]
        assert depths == sorted(depths) and min(slab.pixels[:, 3].max() for slab in pieces.slabs) > 0
    assert max(counts) == faces


@pytest.mark.parametrize("quality", [0.3, 1])
def test_in_slabs_a_homogeneous_box_is_as_exact_as_ever(rng, quality):
    """From outside and inside, with a clip plane and several levels of detail."""
    counts, zones = set(), set()
    for place in (-1.7, -0.9, 0.2) * 3:
        pose = random_pose(rng, spacing=(1, 1.5, 0.7), shear=0.2, mirrored=True)
        volume = Volume(np.full((18, 24, 31), VALUE, np.uint8), world_from_object=pose)
        transfer = TransferFunction([(VALUE, tuple(COLOUR), 0.05)], 1.0)
        towards = random_rotation(rng)[0]
        regions = Regions(clip=[(*-towards, towards @ volume.centre + 5.0)])
        view = view_of(volume, towards, place, fovy=90)
        settings = Settings(depth_slabs=4, residual=0, quality=quality)
        image = Renderer(volume, transfer, settings, regions).composite(view.eye, [view.wall])
        assert len(image.slabs) == 4
        decided, undecided = assert_exact(image, volume, regions, transfer.extinction(VALUE))
        assert undecided < 0.01 * decided
        counts.add(len(image.faces))
        zones.add(image.faces[0].pitch * distance_of(image) > 2)
    assert min(counts) == 1 and max(counts) > 2
    assert quality == 1 or True in zones


@pytest.mark.parametrize("size", [(16, 5), (80, 71), (96, 64)])
def test_what_is_hidden_is_left_out_away_from_edges(size, rng):
    """Nothing that a shift could uncover, up to the margin; all that is two blocks farther from an edge."""
    width, height = size
    for margin in (0, 3, 8, 13):
        pixels = np.zeros((height, width, 4), np.float32)
        pixels[..., 3] = 0.999
        for row, column in zip(rng.integers(0, height, 2), rng.integers(0, width, 2), strict=True):
            pixels[row, column, 3] = 0.9
        seen = np.pad(pixels[..., 3] < 0.995, margin + 17, constant_values=True)
        hidden = _hidden(pixels, 0.005, margin)

        def near(reach, seen=seen, pad=margin + 17):
            rows = [(r, c) for r in range(-reach, reach + 1) for c in range(-reach, reach + 1)]
            return np.any([np.roll(seen, at, (0, 1))[pad:-pad, pad:-pad] for at in rows], axis=0)

        assert not (hidden & near(margin)).any()
        assert hidden[~near(margin + 16)].all()
        assert hidden.any() == (size != (16, 5))


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


@pytest.mark.parametrize("slabs", [-1, 9, 1.5, "two"])
def test_impossible_numbers_of_slabs_are_refused(slabs):
    with pytest.raises(SettingsError, match="depth_slabs"):
        Settings(depth_slabs=slabs)


@pytest.mark.gl
@pytest.mark.parametrize("distance, single, faces", [(1.7, 3, 1), (0.9, 1, 3), (0.2, 3, 5)])
@pytest.mark.parametrize("slabs", [0, 1, 4])
def test_the_texture_warp_draws_the_same_for_moved_eyes(
    gl_context, volume, rng, distance, single, faces, slabs
):
    counts = set()
    with TextureWarp() as texture:
        for towards in DIRECTIONS[:4]:
            view = view_of(volume, towards, distance, fovy=100 if distance < 1 else 60, size=(90, 70))
            image = composited(volume, view, single_face_tangent=single, depth_slabs=slabs)
            counts.add(len(image.faces))
            texture.upload(image)
            for size in (0.0, 0.3, 4.0):
                other = moved(view, random_rotation(rng)[0] * size)
                truth = warp_eye_image(image, other)
                assert truth[..., 3].max() > 0.3
                error = np.abs(drawn(lambda v=other: texture.draw_view(v), view.size) - truth).max(-1)
                # A ray may lie on an edge of a face or of a picture but for rounding.
                assert (error > (1 + slabs) * TEXTURE_FLOAT32).sum() <= 2, error.max()
    assert max(counts) == faces
