"""Eye images travel as bytes, and tell where their faces lie."""

import io
from dataclasses import replace

import numpy as np
import pytest
from tolerances import MATRIX
from views import DIRECTIONS, random_pose, view_of

from persp_sw import EyeImage, Regions, Renderer, TransferFunction, Volume
from persp_sw.errors import ViewError

TF = TransferFunction([(0, (1, 0.5, 0.2), 0), (255, (1, 1, 1), 0.5)], 1.0)


@pytest.fixture
def image(rng):
    volume = Volume(rng.integers(0, 255, (12, 10, 11)).astype(np.uint8), world_from_object=random_pose(rng))
    view = view_of(volume, DIRECTIONS[1], 1.0, fovy=90)
    clipped = Regions(clip=[(*view.eye.position, 1e4)])
    return Renderer(volume, TF, regions=clipped).composite(view.eye, [view.wall])


def test_bytes_round_trip_bit_for_bit(image):
    other = EyeImage.from_bytes(image.to_bytes())
    assert other.faces == image.faces
    assert other.samples == image.samples > 0
    assert other.eye.near == image.eye.near
    np.testing.assert_array_equal(other.eye.position, image.eye.position)
    np.testing.assert_array_equal(other.world_from_object, image.world_from_object)
    assert other.pixels.dtype == np.float32
    np.testing.assert_array_equal(other.pixels, image.pixels)
    np.testing.assert_array_equal(other.box, image.box)
    np.testing.assert_array_equal(other.half_spaces, image.half_spaces)
    assert other.depth is None and other.slabs == ()


def test_depth_and_slabs_travel_too(image):
    slabs = tuple(
        replace(image, pixels=image.pixels * factor, depth=4 + factor, box=image.box * factor)
        for factor in (1, 2, 3)
    )
    image = replace(image, depth=7.25, slabs=slabs)
    other = EyeImage.from_bytes(image.to_bytes())
    assert other.depth == 7.25 and [slab.depth for slab in other.slabs] == [5, 6, 7]
    for slab, given in zip(other.slabs, slabs, strict=True):
        np.testing.assert_array_equal(slab.pixels, given.pixels)
        np.testing.assert_array_equal(slab.box, given.box)
        assert slab.faces == image.faces and slab.slabs == ()


def test_an_eye_image_without_faces_travels_too(image):
    empty = EyeImage(image.eye, image.world_from_object, (), np.empty((0, 4), np.float32), 0)
    other = EyeImage.from_bytes(empty.to_bytes())
    assert other.faces == () and other.pixels.shape == (0, 4)


@pytest.mark.parametrize(
    "damage", [lambda b: b"", lambda b: b"hello", lambda b: b[:-40], lambda b: b[: len(b) // 2]]
)
def test_damaged_bytes_are_refused_by_name(image, damage):
    with pytest.raises(ViewError, match="eye image"):
        EyeImage.from_bytes(damage(image.to_bytes()))


def test_pixels_that_do_not_fit_the_faces_are_refused(image):
    short = EyeImage(image.eye, image.world_from_object, image.faces, image.pixels[:-1], 0)
    with pytest.raises(ViewError, match="damaged"):
        EyeImage.from_bytes(short.to_bytes())


def test_quad_corners_project_to_the_faces_corners(image, rng):
    """eye + world_from_tangents · (t, 1)·D lies on the ray of t for every D: the quad is the warp."""
    for number, face in enumerate(image.faces):
        matrix = image.world_from_tangents(number)
        t = np.array(face.origin) + rng.random((20, 2)) * np.array(face.size) * face.pitch
        near, far = (image.eye.position + np.column_stack([t, np.ones(20)]) @ matrix.T * d for d in (0.5, 70))
        inverse = np.linalg.inv(image.world_from_object[:3, :3])
        for points in (near, far):
            direction = (points - image.eye.position) @ inverse.T
            along = face.sign * direction[:, face.axis]
            i, j = (face.axis + 1) % 3, (face.axis + 2) % 3
            np.testing.assert_allclose(direction[:, [i, j]] / along[:, None], t, atol=MATRIX * 10)


def saved(**arrays):
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


NOWHERE = np.nan  # tangents of parallel rays, where they are not
GOOD = {
    "eye": np.array([0, 0, 0, 0, 1.0]),
    "world_from_object": np.eye(4),
    "faces": np.array([[0, 1, 0.0, 0.0, 0.1, 2, 2, NOWHERE, NOWHERE]]),
    "pixels": np.zeros((4, 4), np.float32),
    "samples": np.int64(0),
    "box": np.array([[0, 0, 0], [1, 1, 1.0]]),
    "half_spaces": np.zeros((0, 4)),
    "depths": np.array([NOWHERE, 3.0]),
    "slabs": np.zeros((1, 4, 4), np.float32),
    "slab_boxes": np.array([[[0, 0, 0], [1, 1, 0.5]]]),
}


@pytest.mark.parametrize(
    "change",
    [
        {"faces": np.zeros(9)},
        {"faces": np.array([[0, 1, 0.0, 0.0, 0.1, 2, 2]])},
        {"faces": np.array([[3, 1, 0, 0, 0.1, 2, 2.0, NOWHERE, NOWHERE]])},
        {"faces": np.array([[0, 1, np.inf, 0, 0.1, 2, 2.0, NOWHERE, NOWHERE]])},
        {"faces": np.array([[0, 1, 0, 0, 0, 2, 2.0, NOWHERE, NOWHERE]])},
        {"faces": np.array([[0, 1, 0.0, 0.0, 0.1, 2, 2, 0.1, 0.2]])},
        {"eye": np.array([0, 0, 1, 0, 0.0])},
        {"eye": np.array([0, 0, 1, 0, 0.5])},
        {"pixels": np.zeros((4, 4))},
        {"pixels": np.zeros((4, 3), np.float32)},
        {"world_from_object": np.eye(3)},
        {"samples": np.zeros(2)},
        {"eye": np.full(5, np.nan)},
        {"box": np.zeros((2, 2))},
        {"box": np.full((2, 3), np.nan)},
        {"half_spaces": np.zeros((2, 3))},
        {"half_spaces": np.full((1, 4), np.inf)},
        {"depths": np.array([NOWHERE])},
        {"depths": np.array([NOWHERE, 0.0])},
        {"depths": np.array([np.inf, 1.0])},
        {"slabs": np.zeros((1, 4, 4))},
        {"slab_boxes": np.zeros((2, 2, 3))},
        {"slab_boxes": np.full((1, 2, 3), np.nan)},
        {"slabs": np.zeros((1, 3, 4), np.float32)},
    ],
)
def test_impossible_contents_are_refused(change):
    EyeImage.from_bytes(saved(**GOOD))
    with pytest.raises(ViewError):
        EyeImage.from_bytes(saved(**{**GOOD, **change}))


def test_another_numpy_file_is_refused():
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(3))
    with pytest.raises(ViewError, match="eye image"):
        EyeImage.from_bytes(buffer.getvalue())
