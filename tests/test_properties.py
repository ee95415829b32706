"""What holds of every picture, whatever is shown, from wherever, however: drawn by hypothesis.

The same examples in every run; `PERSP_SW_PROPERTIES=long pytest tests/test_properties.py` draws others, and
many more, to look for what fails.
"""

import dataclasses
import os

import numpy as np
import pytest
import strategies as make
from hypothesis import HealthCheck, assume, event, given, note
from hypothesis import settings as profile
from hypothesis import strategies as st
from numpy.lib.stride_tricks import sliding_window_view
from tolerances import FEW_BITS, FLOAT32_IMAGE, OF_ALPHA, POSSIBLE, STORED_OTHERWISE

from persp_sw import (
    Cut,
    Eye,
    EyeImage,
    PerspSWError,
    Regions,
    Renderer,
    Settings,
    TransferFunction,
    View,
    Volume,
    Wall,
    reference,
)

LONG = os.environ.get("PERSP_SW_PROPERTIES") == "long"
profile.register_profile(
    "few", max_examples=40, derandomize=True, deadline=None, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)  # fmt: skip
profile.register_profile(
    "long", max_examples=3000, deadline=None, print_blob=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)  # fmt: skip
profile.load_profile("long" if LONG else "few")


def renderer_of(scene, **changes):
    settings = dataclasses.replace(scene.settings, **changes)
    return Renderer(scene.volume, scene.transfer, settings, scene.regions)


def tell(scene):
    """What hypothesis prints beside a failure: voxels have no short form."""
    data = scene.volume.data
    note(f"{scene.volume} pose {scene.volume.world_from_object.tolist()}")
    note(f"values {data.ravel()[:8]} … {scene.volume.value_range}")
    note(
        "\n".join(map(str, (scene.transfer.to_dict(), scene.regions, scene.settings, scene.eye, scene.walls)))
    )


def assert_possible(pixels, scene):
    assert np.isfinite(pixels).all()
    assert (pixels >= 0).all()
    alpha, colour = pixels[..., 3:], scene.transfer.colours.max(0)
    assert (alpha <= 1 + POSSIBLE).all()
    assert (pixels[..., :3] <= alpha * colour + POSSIBLE).all()


@given(scene=make.scenes())
def test_every_picture_is_possible(scene):
    tell(scene)
    renderer = renderer_of(scene)
    image = renderer.composite(scene.eye, scene.walls)
    for each in (image, *image.slabs):
        assert_possible(each.pixels, scene)
    for view in scene.views:
        assert_possible(renderer.warp(image, view), scene)


@given(scene=make.scenes())
def test_threads_and_skipping_change_no_bit(scene):
    tell(scene)
    one, two, dense, loose = (
        renderer_of(scene, **change)
        for change in ({"threads": 1}, {"threads": 2}, {"skip_empty": False}, {"pack_runs": False})
    )
    box = one.runs.visible_box()
    if box is None:
        assert not one.composite(scene.eye, scene.walls).faces
        return
    dense.runs._box = box  # what can be seen bounds the faces: the same for all
    image, other, skipless, packless = (
        each.composite(scene.eye, scene.walls) for each in (one, two, dense, loose)
    )
    assert image.faces == other.faces == skipless.faces == packless.faces
    for same in (other, packless):
        np.testing.assert_array_equal(same.pixels, image.pixels)
        for slab, own in zip(same.slabs, image.slabs, strict=True):
            np.testing.assert_array_equal(slab.pixels, own.pixels)
    assert (
        np.abs(skipless.pixels - image.pixels).max(initial=0) <= scene.settings.residual
    )  # nothing, if that is 0


@given(scene=make.scenes(), exponent=st.sampled_from([1, -1, 10, -10, 30, -30]))
def test_the_unit_of_the_world_changes_no_bit(scene, exponent):
    """All lengths times a power of two, which rounds nothing but what is too small for float32's bits."""
    tell(scene)
    image, other = (
        renderer_of(each).composite(each.eye, each.walls)
        for each in (scene, make.scaled(scene, 2.0**exponent))
    )
    assert other.faces == image.faces
    np.testing.assert_allclose(other.pixels, image.pixels, rtol=0, atol=FEW_BITS)


@given(scene=make.scenes())
def test_an_image_is_the_same_after_a_journey(scene):
    tell(scene)
    image = renderer_of(scene).composite(scene.eye, scene.walls)
    data = image.to_bytes()
    other = EyeImage.from_bytes(data)
    assert other.to_bytes() == data
    assert other.faces == image.faces and other.samples == image.samples and other.depth == image.depth
    np.testing.assert_array_equal(other.pixels, image.pixels)
    np.testing.assert_array_equal(other.box, image.box)
    np.testing.assert_array_equal(other.half_spaces, image.half_spaces)
    assert (other.eye.near, other.eye.w) == (image.eye.near, image.eye.w)
    np.testing.assert_array_equal(other.eye.position, image.eye.position)
    for slab, own in zip(other.slabs, image.slabs, strict=True):
        assert slab.depth == own.depth
        np.testing.assert_array_equal(slab.pixels, own.pixels)


# --- Smooth volumes: how far from the truth ----------------------------------------------------------------


def truth_of(scene, view):
    return reference.render(scene.volume, scene.transfer, view, tolerance=1e-4)


def rms(difference):
    return float(np.sqrt(np.square(difference).mean()))


@given(scene=make.smooth_scenes(quality=2.0, residual=0.0))
def test_no_picture_is_emptier_than_the_truth(scene):
    """In the mean, nor a hole where the truth is dense all about."""
    tell(scene)
    renderer = renderer_of(scene)
    image = renderer.composite(scene.eye, scene.walls)
    for view in scene.views:
        assert_full(renderer.warp(image, view), truth_of(scene, view))


def assert_full(picture, truth):
    alpha, truth = picture[..., 3], truth[..., 3]
    assert abs(alpha.mean() - truth.mean()) <= OF_ALPHA * truth.mean() + 1 / max(alpha.shape)
    least = sliding_window_view(np.pad(truth, 1, constant_values=1), (3, 3)).min((2, 3))
    assert (alpha[least > 0.5] > 0.2).all()


@given(
    scene=make.smooth_scenes(quality=2.0, residual=0.0),
    order=st.permutations([0, 1, 2]),
    flips=st.tuples(*[st.booleans()] * 3),
)
def test_how_voxels_are_stored_changes_nothing(scene, order, flips):
    """But which of two faces is taken that serve as well, and, as packets lie along another axis, which pitch
    fills them and how often steep rays are sampled.
    """
    assume(not scene.eye.is_at_infinity)  # whose pixels are counted from voxel 0
    tell(scene)
    other = dataclasses.replace(scene, volume=make.stored_otherwise(scene.volume, order, flips))
    one, two = renderer_of(scene), renderer_of(other)
    images = [renderer.composite(scene.eye, scene.walls) for renderer in (one, two)]
    alike = plain_directions(images[0]) == plain_directions(images[1])
    event("alike" if alike else "other faces or samples")
    for view in scene.views:
        picture, other = one.warp(images[0], view), two.warp(images[1], view)
        either = OF_ALPHA * picture[..., 3].mean() + 1 / max(view.size)
        assert rms(other - picture) <= (STORED_OTHERWISE if alike else either)


def plain_directions(image):
    """Which way the faces look, in the world, and their pitch; like nothing where steep rays sample more."""
    axes = image.world_from_object[:3, :3] / np.linalg.norm(image.world_from_object[:3, :3], axis=0)
    if any(face.samples_per_interval(1) > 1 for face in image.faces):
        return object()
    ways = [np.round(face.sign * axes[:, face.axis], 6) + 0.0 for face in image.faces]
    return sorted([*way.tolist(), f"{face.pitch:.4g}"] for way, face in zip(ways, image.faces, strict=True))


@given(scene=make.smooth_scenes(most=1, residual=0.0, intermediate_size=64), columns=st.integers(1, 24))
def test_two_half_walls_show_what_one_wall_shows(scene, columns):
    """At a size given: what a pixel of the eye image is worth, else, is each wall's to say."""
    tell(scene)
    (wall,) = scene.walls
    assume(columns < wall.pixels[0])
    parts = make.halves(wall, columns)
    renderer = renderer_of(scene)
    whole, both = (renderer.composite(scene.eye, walls) for walls in ((wall,), parts))
    picture = renderer.warp(whole, View(scene.eye, wall))
    pieces = [renderer.warp(both, View(scene.eye, part)) for part in parts]
    assert np.abs(np.concatenate(pieces, 1) - picture).max() <= FLOAT32_IMAGE


@given(
    scene=make.smooth_scenes(quality=2.0),
    step=st.tuples(*[st.sampled_from([0.0, 0.01, -0.01, 0.3, -0.3, 1.0, -1.0])] * 3),
)
def test_the_frame_before_makes_no_picture_wrong(scene, step):
    """Faces and pitch that are kept serve, too."""
    assume(not scene.eye.is_at_infinity)
    tell(scene)
    renderer = renderer_of(scene)
    before = Eye(scene.eye.position + scene.volume.world_from_object[:3, :3] @ step)
    previous = renderer.composite(before, [wall for wall in scene.walls if sees(before, wall)])
    kept = renderer.composite(scene.eye, scene.walls, previous)
    new = renderer.composite(scene.eye, scene.walls)
    event("kept" if kept.faces != new.faces else "the same")
    if kept.faces == new.faces:
        np.testing.assert_array_equal(kept.pixels, new.pixels)
        return
    for view in scene.views:
        assert_full(renderer.warp(kept, view), truth_of(scene, view))


def sees(eye, wall):
    try:
        View(eye, wall)
    except PerspSWError:
        return False
    return True


# --- What is no input --------------------------------------------------------------------------------------

CALLS = {
    "volume": lambda draw: Volume(draw(st.one_of(make.arrays(), make.junk())), draw(make.junk())),
    "posed volume": lambda draw: Volume(np.ones((2, 2, 2)), world_from_object=draw(make.junk())),
    "pose": lambda draw: Volume(
        np.ones((2, 2, 2)), world_from_object=[draw(make.numbers(4)) for _ in "4444"]
    ),
    "transfer": lambda draw: TransferFunction(draw(make.junk()), draw(make.junk())),
    "points": lambda draw: TransferFunction(
        [(draw(make.junk()), draw(make.numbers(3)), draw(make.junk())) for _ in range(2)], 1.0
    ),
    "rows": lambda draw: TransferFunction.from_rows([draw(make.numbers(5)), draw(make.junk())]),
    "eye": lambda draw: Eye(draw(make.junk()), draw(make.junk()), draw(make.junk())),
    "eye at infinity": lambda draw: Eye.at_infinity(draw(make.junk())),
    "wall": lambda draw: Wall(*(draw(make.numbers(3)) for _ in "123"), draw(make.junk())),
    "corner": lambda draw: Wall((0, 0, 0), (1, 0, 0), draw(make.junk()), (4, 4)),
    "view": lambda draw: View.through_wall(
        draw(make.numbers(3)), Wall((0, 0, 0), (1, 0, 0), (0, 1, 0), (4, 4))
    ),
    "look": lambda draw: View.look_at(*(draw(make.numbers(3)) for _ in "123"), draw(make.junk()), (4, 4)),
    "looked at": lambda draw: View.look_at(draw(make.junk()), (0, 0, 0), (0, 1, 0), 40, draw(make.junk())),
    "parallel": lambda draw: View.parallel(
        *(draw(make.numbers(3)) for _ in "123"), draw(make.junk()), (4, 4)
    ),
    "regions": lambda draw: Regions(*(draw(make.junk()) for _ in "1234")),
    "crop": lambda draw: Regions(draw(make.numbers(6)), crop_flags=draw(make.junk())),
    "clip": lambda draw: Regions(clip=[draw(make.junk()) for _ in "12"]),
    "cut": lambda draw: Cut(draw(make.junk()), draw(make.junk()), draw(make.junk())),
    "cut of words": lambda draw: Regions(
        cut=[{"plane": draw(make.numbers(4)), "thickness": draw(make.junk())}]
    ),
    "settings": lambda draw: Settings(
        **{draw(st.sampled_from([field.name for field in dataclasses.fields(Settings)])): draw(make.junk())}
    ),
    "image": lambda draw: EyeImage.from_bytes(draw(st.binary(max_size=80))),
}


@pytest.mark.parametrize("call", CALLS)
@given(data=st.data())
def test_what_is_no_input_is_refused_in_words(call, data):
    """It is taken or refused; no other exception and, for they are errors here, no warning."""
    try:
        CALLS[call](data.draw)
    except PerspSWError as error:
        assert str(error)


# --- What it found -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "call",
    [
        lambda: Eye((0, 0, 10**400)),  # OverflowError
        lambda: Eye((0, 0, 0), 10**400),  # TypeError
        lambda: Eye((0, 0, 1j)),  # ComplexWarning
        lambda: Eye((0, 0, 0), 0, np.zeros(3)),  # ValueError
        lambda: Cut((0, 0, 1, 0), 1, np.zeros(3)),  # ValueError
        lambda: Regions(clip=np.array(1.0)),  # TypeError
        lambda: Settings(quality=10**400),
        lambda: TransferFunction([(0, (0, 0, 10**400), 0.5)]),
        lambda: Volume([[[1, 2], [3]]]),  # ValueError
        lambda: Volume(np.ones((2, 2, 2)), world_from_object="pose"),
        lambda: Volume(np.ones((2, 2, 2)), world_from_object=[[1, 0, 0, 10**400]] * 4),
        lambda: View.look_at((0, 0, 0), (0, 0, 1), (0, 0, 1e300), 40, (4, 4)),  # RuntimeWarning: overflow
        lambda: Wall((0, 0, 0), (1e300, 0, 0), (0, 1, 0), (4, 4)),
    ],
)
def test_numbers_beyond_all_bounds_are_refused(call):
    with pytest.raises(PerspSWError, match=r"given|control points"):
        call()


def test_without_skipping_no_pixel_changes_by_more_than_the_residual():
    """Rays of a packet go on until the last of them ends; what they meet meanwhile depends on skipping."""
    rng = np.random.default_rng(0)
    volume = Volume(
        np.where(rng.random((24,) * 3) < 0.05, rng.integers(1, 255, (24,) * 3), 0).astype(np.uint8)
    )
    comb = [(12.7 * n, (0, 0, 0), float(n % 2)) for n in range(21)]
    view = View.look_at((241.5, 11.5, 11.5), volume.centre, (0, 1, 0), 23, (12, 12))
    for residual, changes in ((0.0, False), (0.5, True)):
        settings = Settings(residual=residual)
        one, dense = (
            Renderer(volume, TransferFunction(comb), dataclasses.replace(settings, skip_empty=skip))
            for skip in (True, False)
        )
        dense.runs._box = one.runs.visible_box()
        image, other = (renderer.composite(view.eye, [view.wall]) for renderer in (one, dense))
        change = np.abs(other.pixels - image.pixels).max()
        assert change <= residual and (change > 0) == changes
