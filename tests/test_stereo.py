"""Stereo modes: each against a pair of pictures split by hand, pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import NEUTRAL_ANAGLYPH

import persp_sw as psw
from vr_plugin.eyes import EyePair
from vr_plugin.frame import FrameMaker
from vr_plugin.pose import Pose
from vr_plugin.rig import STEREO_MODES, RigWall
from vr_plugin.stereo import (
    DUBOIS_LEFT,
    DUBOIS_RIGHT,
    MODES,
    Stereo,
    StereoError,
    combine,
    eye_size,
    eyes_of,
    modes_of_windows,
    rectangles,
    shows_left,
    window_size,
    without_quad_buffers,
)

BACKGROUND = np.array([0.25, 0.5, 0.125])
WINDOW = (8, 6)


def pair(mode: str, rng: np.random.Generator, window=WINDOW) -> tuple[np.ndarray, np.ndarray]:
    """Two premultiplied pictures of the mode's size; in the left one red grows, in the right one blue."""
    width, height = eye_size(mode, window)
    pictures = rng.random((2, height, width, 4)).astype(np.float32)
    pictures[..., :3] *= pictures[..., 3:]
    return pictures[0], pictures[1]


def over(pixel: np.ndarray) -> np.ndarray:
    return pixel[:3] + (1 - pixel[3]) * BACKGROUND


# Which eye's pixel each pixel (column, row) of an 8 × 6 window shows, written out.
SPLIT = {
    "mono": lambda x, y: ("left", x, y),
    "left": lambda x, y: ("left", x, y),
    "right": lambda x, y: ("right", x, y),
    "side_by_side": lambda x, y: ("left", x, y) if x < 4 else ("right", x - 4, y),
    "top_bottom": lambda x, y: ("left", x, y) if y < 3 else ("right", x, y - 3),
    "interlaced": lambda x, y: ("left", x, y) if y in (0, 2, 4) else ("right", x, y),
}


@pytest.mark.parametrize("mode", SPLIT)
def test_every_pixel_is_the_right_eyes(mode, rng):
    left, right = pair(mode, rng)
    window = combine(left, right, mode, WINDOW, background=BACKGROUND)
    assert window.shape == (6, 8, 4)
    assert (window[..., 3] == 1).all()
    for row in range(6):
        for column in range(8):
            eye, x, y = SPLIT[mode](column, row)
            expected = np.float32(over({"left": left, "right": right}[eye][y, x].astype(float)))
            np.testing.assert_array_equal(window[row, column, :3], expected)


def test_anaglyph_is_dubois_sum_in_linear_light(rng):
    left, right = pair("anaglyph", rng)
    window = combine(left, right, "anaglyph", background=BACKGROUND)
    for row in range(6):
        for column in range(8):
            ours, theirs = over(left[row, column].astype(float)), over(right[row, column].astype(float))
            expected = [
                sum(DUBOIS_LEFT[c, k] * ours[k] + DUBOIS_RIGHT[c, k] * theirs[k] for k in range(3))
                for c in range(3)
            ]
            np.testing.assert_allclose(window[row, column, :3], np.clip(expected, 0, 1), rtol=0, atol=1e-7)


def test_the_anaglyph_separates_the_eyes_and_keeps_greys():
    grey = np.full((1, 1, 4), 1, np.float32)
    for level in (0.2, 0.7, 1.0):
        grey[..., :3] = level
        np.testing.assert_allclose(combine(grey, grey, "anaglyph")[..., :3], level, atol=NEUTRAL_ANAGLYPH)
    white, black = np.ones((1, 1, 4), np.float32), np.zeros((1, 1, 4), np.float32)
    to_left, to_right = combine(white, black, "anaglyph")[0, 0], combine(black, white, "anaglyph")[0, 0]
    assert to_left[0] >= 1 and to_left[1:3].max() == 0  # red alone, the negative rest clipped
    assert to_right[0] == 0 and to_right[1:3].min() >= 1


@pytest.mark.parametrize("first_row", [0, 1, 37, 1080])
def test_interlaced_rows_stay_with_the_screen(first_row, rng):
    left, right = pair("interlaced", rng)
    window = combine(left, right, "interlaced", first_row=first_row, background=BACKGROUND)
    for row in range(6):
        screen_row = first_row + row
        source = (left, right)[screen_row % 2]
        np.testing.assert_array_equal(window[row, 3, :3], np.float32(over(source[row, 3].astype(float))))
        assert shows_left(row, first_row) == (screen_row % 2 == 0)


@pytest.mark.parametrize(("mode", "axis"), [("side_by_side", 1), ("top_bottom", 0)])
def test_the_odd_pixel_is_background_in_the_middle(mode, axis, rng):
    window = (9, 7)
    left, right = pair(mode, rng, window)
    shown = combine(left, right, mode, window, background=BACKGROUND)[..., :3]
    middle = np.take(shown, shown.shape[axis] // 2, axis)
    np.testing.assert_array_equal(middle, np.broadcast_to(np.float32(BACKGROUND), middle.shape))
    assert left.shape[axis] == right.shape[axis] == shown.shape[axis] // 2
    last = np.take(shown, -1, axis)
    of_right = np.take(right, -1, axis).astype(float)
    np.testing.assert_array_equal(last, np.float32(of_right[:, :3] + (1 - of_right[:, 3:]) * BACKGROUND))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("size", [(1, 1), (2, 1), (1920, 1080), (641, 479)])
def test_pictures_lie_in_the_window(mode, size):
    width, height = eye_size(mode, size)
    assert width >= 1 and height >= 1
    for place in rectangles(mode, size):
        if place:
            assert (place.width, place.height) == (width, height)
            assert place.x >= 0 and place.y >= 0
            assert place.x + width <= size[0] and place.y + height <= size[1]
    assert eye_size(mode, window_size(mode, (width, height))) == (width, height)
    shares = {"side_by_side": (2, 1), "top_bottom": (1, 2)}.get(mode, (1, 1))
    assert (width, height) == tuple(max(n // share, 1) for n, share in zip(size, shares, strict=True))


def test_modes_know_their_eyes_and_windows():
    assert eyes_of("mono") == ("middle",)
    assert eyes_of("left") == ("left",)
    assert eyes_of("right") == ("right",)
    assert all(eyes_of(m) == ("left", "right") for m in MODES if m not in ("mono", "left", "right"))
    assert modes_of_windows("two_windows") == ("left", "right")
    assert modes_of_windows("anaglyph") == ("anaglyph",)
    assert without_quad_buffers("quad") == "mono"
    assert all(without_quad_buffers(mode) == mode for mode in MODES if mode != "quad")
    assert set(STEREO_MODES) == set(MODES) - {"two_windows"}  # a rig has a wall for each of those


def test_eyes_change_places_and_flatten():
    stereo = Stereo("side_by_side")
    assert (stereo.shown_mode, stereo.channels) == ("side_by_side", ("left", "right"))
    swapped = stereo.swap()
    assert (swapped.shown_mode, swapped.channels) == ("side_by_side", ("right", "left"))
    assert swapped.swap() == stereo
    flat = swapped.flatten()
    assert (flat.shown_mode, flat.channels) == ("mono", ("middle", "middle"))
    assert flat.flatten() == swapped
    one = Stereo("left").swap()
    assert (one.shown_mode, one.channels) == ("right", ("right", "right"))
    assert Stereo("two_windows").swap().channels == ("right", "left")


def test_modes_follow_one_another():
    stereo = Stereo("mono", flat=True)
    seen = []
    for _ in MODES:
        seen.append(stereo.mode)
        stereo = stereo.next_mode()
        assert not stereo.flat
    assert seen == list(MODES)
    assert stereo.mode == "mono"
    assert Stereo("quad").next_mode(["mono", "anaglyph"]).mode == "mono"


def test_a_frame_composites_the_eyes_its_modes_need():
    volume = psw.Volume(np.full((4, 4, 4), 200, np.uint8))
    transfer = psw.TransferFunction([(0, (1, 1, 1), 0.0), (255, (1, 1, 1), 0.5)])
    wall = RigWall(psw.Wall((-1, 0, -1), (1, 0, -1), (-1, 2, -1), (16, 16), name="front"), "mono")
    room_from_world = np.diag([0.1, 0.1, 0.1, 1.0])
    room_from_world[:3, 3] = -0.15, 0.85, -2
    maker = FrameMaker(psw.Renderer(volume, transfer), [wall], room_from_world)
    eyes = EyePair(np.array([-0.03, 1, 1]), np.array([0.03, 1, 1]))
    for mode in ("mono", "left", "right", "anaglyph", "two_windows"):
        frame = maker.make(Pose((0, 1, 1)), eyes, modes={"front": mode})
        assert tuple(picture.eye for picture in frame.pictures) == eyes_of(mode)
        assert frame.compositings == len(eyes_of(mode))


def test_refusals_say_what_to_do(rng):
    left, right = pair("anaglyph", rng)
    with pytest.raises(StereoError, match="choose one of mono, left"):
        eyes_of("shutter")
    with pytest.raises(StereoError, match="choose one of mono, left"):
        Stereo("shutter")
    with pytest.raises(StereoError, match="a picture for each eye"):
        combine(left, right, "quad")
    with pytest.raises(
        StereoError, match="8 × 6 pixels needs eye pictures of 4 × 6; given a left one of 8 × 6"
    ):
        combine(left, right, "side_by_side", WINDOW)
    with pytest.raises(StereoError, match="given a right one"):
        combine(left, right[:-1], "anaglyph")
    with pytest.raises(StereoError, match=r"\(height, width, 4\)"):
        combine(left[..., 0], right, "anaglyph")
