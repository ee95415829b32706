"""Eye images in depth slabs: what they hold, what they make up, how the software warp lays them over."""

from dataclasses import replace

import numpy as np
import pytest
from exact_faces import COLOUR, VALUE, assert_exact
from moved_eyes import SOLID, TF, coloured_noise, composited, moved
from tolerances import CUT_SLICES, FLOAT32_IMAGE
from views import DIRECTIONS, random_pose, random_rotation, view_of

from persp_sw import Canvas, Regions, Renderer, Settings, TransferFunction, Volume
from persp_sw.errors import SettingsError
from persp_sw.slabs import _hidden
from persp_sw.warp.moved import distance_of
from persp_sw.warp.software import warp_eye_image


@pytest.fixture
def volume(rng):
    return coloured_noise(rng)


def test_slabs_of_a_solid_hold_its_colour_or_nothing(rng):
    """What is hidden is left out: it is as empty as if there were nothing."""
    volume = Volume(np.ones((60, 60, 60), np.uint8))
    view = view_of(volume, DIRECTIONS[0], 2.0)
    image = composited(volume, view, SOLID, depth_slabs=4, quality=2)
    for slab in image.slabs:
        np.testing.assert_allclose(slab.pixels, slab.pixels[:, 3:] * (1, 0.5, 0.2, 1), atol=1e-6)
    first, *_, last = image.slabs
    assert (first.pixels[:, 3] > 0.995).sum() > 2000
    # Behind what is opaque all but a margin along its edges is left out.
    behind = last.pixels[first.pixels[:, 3] > 0.995]
    assert 0 < (behind[:, 3] > 0).mean() < 0.5


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
@pytest.mark.parametrize("distance, faces", [(1.7, 3), (0.2, 5)])
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


@pytest.mark.parametrize("slabs", [-1, 9, 1.5, "two"])
def test_impossible_numbers_of_slabs_are_refused(slabs):
    with pytest.raises(SettingsError, match="depth_slabs"):
        Settings(depth_slabs=slabs)
