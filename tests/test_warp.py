"""The software warp: exact for what bilinear look-up reproduces, and its plain twin."""

import numpy as np
import pytest
import twins
from tolerances import WARP_LINEAR, WARP_TWIN
from views import DIRECTIONS, random_pose, view_of

from persp_sw import Canvas, EyeImage, Renderer, Settings, TransferFunction, Volume
from persp_sw.errors import ViewError
from persp_sw.geometry.sight import tangents
from persp_sw.volume.levels import STANDARD_AXES
from persp_sw.warp.software import warp_eye_image

WHITE = TransferFunction([(0, (1, 1, 1), 0.1)], 1.0)


def eye_image_of(volume, view, **settings):
    return Renderer(volume, WHITE, Settings(**settings)).composite(view.eye, [view.wall])


def with_pixels(image, function):
    """The eye image whose pixels are function(face, t_i, t_j) -> 4 numbers."""
    pixels = np.empty_like(image.pixels)
    result = EyeImage(image.eye, image.world_from_object, image.faces, pixels, 0)
    for number, face in enumerate(image.faces):
        u, v = np.meshgrid(*(np.arange(n) + 0.5 for n in face.size))
        t_i, t_j = face.origin[0] + u * face.pitch, face.origin[1] + v * face.pitch
        result.face_pixels(number)[:] = np.stack(function(face, t_i, t_j), -1)
    return result


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("distance", [0.8, 1.7])
def test_every_pixel_looks_up_its_own_ray(mirrored, distance, rng):
    """Faces that hold their own tangents: bilinear look-up reproduces them, so each pixel tells its ray.

    But near seams, where two tell theirs: see the twin.
    """
    volume = Volume(np.ones((20, 24, 28), np.uint8), world_from_object=random_pose(rng, mirrored=mirrored))
    inverse = np.linalg.inv(volume.world_from_object[:3, :3])
    for towards in DIRECTIONS:
        view = view_of(volume, towards, distance, fovy=75)
        image = with_pixels(
            eye_image_of(volume, view), lambda f, a, b: (a, b, f.axis + 0 * a, f.sign + 0 * a)
        )
        picture = warp_eye_image(image, view)
        shown = picture[..., 3] != 0
        assert shown.sum() > 100
        if len(image.faces) > 1:
            parts = np.sort(np.abs(view.directions() @ inverse.T))
            shown &= parts[..., 1] < image.alone * parts[..., 2]
        directions = (view.directions() @ inverse.T)[shown]
        expected = np.empty((len(directions), 4))
        for face in image.faces:
            own = face.sign * directions[:, face.axis] >= np.abs(directions).max(1)
            if len(image.faces) == 1:
                own[:] = True
            expected[own, :2] = tangents(directions[own], face.axis, face.sign)[:, :2]
            expected[own, 2:] = face.axis, face.sign
        assert np.abs(picture[shown] - expected).max() < WARP_LINEAR


@pytest.mark.parametrize("single", [1.0, 3.0])
def test_pixels_equal_the_plain_twin(single, rng):
    """One face, and several, mixed near their seams."""
    volume = Volume(np.ones((9, 7, 8), np.uint8), world_from_object=random_pose(rng))
    inverse = np.linalg.inv(volume.world_from_object[:3, :3])
    view = view_of(volume, DIRECTIONS[1], 1.1, fovy=90, size=(39, 37))
    image = eye_image_of(volume, view, single_face_tangent=single)
    image = with_pixels(image, lambda f, a, b: rng.random((4, *a.shape)))
    assert len(image.faces) == (3 if single == 1 else 1)
    faces = [
        (STANDARD_AXES[f.axis], f.sign, np.array(f.origin), f.pitch, image.face_pixels(n))
        for n, f in enumerate(image.faces)
    ]
    picture = warp_eye_image(image, view)
    directions = view.directions() @ inverse.T
    for v, u in np.ndindex(picture.shape[:2]):
        expected = twins.warp_pixel(directions[v, u], faces, image.alone)
        assert np.abs(picture[v, u] - expected).max() < WARP_TWIN


def test_an_empty_eye_image_is_an_empty_picture():
    volume = Volume(np.ones((9, 7, 8), np.uint8))
    view = view_of(volume, DIRECTIONS[0])
    behind = view_of(volume, DIRECTIONS[0], 3)
    image = EyeImage(behind.eye, volume.world_from_object, (), np.empty((0, 4), np.float32), 0)
    out = np.full((48, 64, 4), 7, np.float32)
    assert warp_eye_image(image, view, out=out) is out
    assert not out.any()


def test_what_lies_outside_the_faces_is_cleared():
    volume = Volume(np.full((9, 9, 9), 200, np.uint8))
    view = view_of(volume, (0, 0, 1), 4)
    image = eye_image_of(volume, view)
    out = np.full((48, 64, 4), 7, np.float32)
    warp_eye_image(image, view, out=out)
    assert out.max() <= 1
    assert not out[0].any() and not out[:, 0].any()
    assert out[24, 32, 3] > 0.3


def test_one_eye_image_serves_two_walls_alike():
    """Walls that share an edge agree along it: the picture does not depend on which wall shows a ray."""
    volume = Volume(np.random.default_rng(0).integers(0, 255, (20, 20, 20)).astype(np.uint8))
    renderer = Renderer(volume, WHITE)
    wide = view_of(volume, DIRECTIONS[0], 1.5, fovy=60, size=(64, 48))
    wall = wide.wall
    middle_low = (wall.lower_left + wall.lower_right) / 2
    up = wall.upper_left - wall.lower_left
    left = type(wall)(wall.lower_left, middle_low, wall.upper_left, (32, 48))
    right = type(wall)(middle_low, wall.lower_right, middle_low + up, (32, 48))
    image = renderer.composite(wide.eye, [left, right])
    halves = [renderer.warp(image, type(wide)(wide.eye, half)) for half in (left, right)]
    whole = renderer.warp(image, wide)
    assert np.abs(np.concatenate(halves, 1) - whole).max() < WARP_TWIN


def test_threads_change_no_bit():
    volume = Volume(np.full((9, 9, 9), 200, np.uint8))
    view = view_of(volume, DIRECTIONS[0])
    image = eye_image_of(volume, view)
    np.testing.assert_array_equal(warp_eye_image(image, view, 1), warp_eye_image(image, view, 2))


def test_a_canvas_holds_the_last_picture_only():
    """Pictures of different extent, one after the other, as if each were alone; one face and several."""
    volume = Volume(np.random.default_rng(0).integers(1, 255, (9, 9, 9)).astype(np.uint8))
    canvas = Canvas(64, 48)
    for distance, fovy in ((1.2, 70), (4, 30), (0.8, 100), (9, 30), (1.2, 70), (300, 30)):
        for single in (1.0, 3.0):
            for towards in DIRECTIONS[:3]:
                view = view_of(volume, towards, distance, fovy=fovy, size=(64, 48))
                image = eye_image_of(volume, view, single_face_tangent=single)
                alone = warp_eye_image(image, view)
                np.testing.assert_array_equal(warp_eye_image(image, view, out=canvas), alone)
                shown = np.arange(64)[None] >= canvas.written[:, :1]
                shown &= np.arange(64)[None] < canvas.written[:, 1:]
                assert not alone[~shown].any()


def test_a_picture_of_another_size_is_refused():
    volume = Volume(np.full((9, 9, 9), 200, np.uint8))
    view = view_of(volume, DIRECTIONS[0])
    image = eye_image_of(volume, view)
    for out in (Canvas(48, 64), np.zeros((48, 64, 3), np.float32), np.zeros((48, 64, 4))):
        with pytest.raises(ViewError, match="contiguous"):
            warp_eye_image(image, view, out=out)
