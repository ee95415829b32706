"""The preview's controller, driven by events and time: no window, no pixels."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from tolerances import MATRIX

import persp_sw as psw
from vr_plugin.cameras import Camera
from vr_plugin.pose import Pose
from vr_plugin.preview import navigation
from vr_plugin.preview.choices import QUALITIES, QUALITY_STEP, SEPARATION, SEPARATION_STEP, Choices
from vr_plugin.preview.controller import FAST, HEAD_SPEED, Preview
from vr_plugin.preview.figures import Rate, figures, fitting_letter, help_text
from vr_plugin.preview.keys import BINDINGS, KEYS, SPIN_KEYS, THRUST_KEYS
from vr_plugin.preview.session import PreviewError, press
from vr_plugin.preview.wanted import Wanted
from vr_plugin.rig import STEREO_MODES
from vr_plugin.room.outside import room_camera
from vr_plugin.room.rooms import four_walls

UP = np.array([0.0, 0.0, 1.0])
SIZE = (400, 200)
HOME = Camera.look_at((40, -50, 35), (11, 12, 13), UP, np.radians(40))


class Driver:
    """A preview and a clock."""

    def __init__(self, **options):
        rig = four_walls()
        choices = Choices(("bone", "skin"))
        options = {"rig": rig, "outside_home": room_camera(rig, SIZE), "choices": choices, **options}
        self.preview = Preview(HOME, up=UP, extent=20.0, size=SIZE, **options)
        self.now = 100.0
        self.preview.advance(self.now)

    def wait(self, seconds: float) -> Wanted:
        for _ in range(max(round(seconds * 50), 1)):
            self.now += 0.02
            wanted = self.preview.advance(self.now)
        return wanted

    def press(self, *names: str, **modifiers: bool) -> Wanted:
        for name in names:
            self.preview.key(name, True, **modifiers)
            self.preview.key(name, False)
        return self.wait(0.0)

    def drag(self, button: str, start: tuple, end: tuple, **modifiers: bool) -> Wanted:
        self.preview.pointer(*start)
        self.preview.button(button, True, **modifiers)
        for share in (0.3, 1.0):
            self.preview.pointer(*(np.array(start) + share * np.subtract(end, start)))
        self.preview.button(button, False)
        return self.wait(2.0)


@pytest.fixture
def driver() -> Driver:
    return Driver()


def same(a: Camera, b: Camera, tolerance: float = 1e-9) -> bool:
    return bool(
        np.abs(a.pose.matrix - b.pose.matrix).max() < tolerance and abs(a.distance - b.distance) < tolerance
    )


# --- mouse -------------------------------------------------------------------------------------------------


def test_a_drag_orbits_by_its_pixels(driver: Driver):
    wanted = driver.drag("left", (200, 100), (250, 90))
    per_pixel = navigation.ORBIT_PER_HEIGHT / SIZE[1]
    assert same(wanted.camera, HOME.on_turntable(-50 * per_pixel, -10 * per_pixel, UP))


def test_moving_without_a_button_does_nothing(driver: Driver):
    driver.preview.pointer(10, 10)
    driver.preview.pointer(300, 150)
    assert same(driver.wait(1.0).camera, HOME)


@pytest.mark.parametrize(("button", "shift"), [("middle", False), ("left", True)])
def test_middle_or_shift_drags_pan(driver: Driver, button: str, shift: bool):
    wanted = driver.drag(button, (200, 100), (230, 80), shift=shift)
    view = psw.View.through_wall(wanted.camera.position, wanted.camera.wall(SIZE))
    np.testing.assert_allclose(view.project(HOME.pivot), (230, 80), atol=1e-6)  # it follows the pointer


def test_the_wheel_zooms_to_the_pointer_and_with_shift_to_the_pivot(driver: Driver):
    driver.preview.pointer(320, 40)
    point = HOME.point_at(2 * 320 / 200 - 2, 1 - 2 * 40 / 200)
    driver.preview.wheel(2)
    camera = driver.wait(2.0).camera
    assert camera.distance == pytest.approx(HOME.distance / navigation.ZOOM_PER_NOTCH**2)
    view = psw.View.through_wall(camera.position, camera.wall(SIZE))
    np.testing.assert_allclose(view.project(point), (320, 40), atol=1e-6)
    driver.press("R")
    driver.preview.wheel(2, shift=True)
    np.testing.assert_allclose(driver.wait(2.0).camera.pivot, HOME.pivot, atol=MATRIX)


# --- keys that are held ------------------------------------------------------------------------------------


def test_flight_goes_where_keys_say_and_only_in_flight(driver: Driver):
    driver.preview.key("W", True)
    assert same(driver.wait(0.5).camera, HOME)
    driver.press("F")
    before = driver.wait(0.0).camera.position
    driver.wait(1.0)
    driver.preview.key("W", False)
    wanted = driver.wait(2.0)
    assert wanted.style == "fly"
    way = wanted.camera.position - before
    forwards = -HOME.axes[2]
    assert np.linalg.norm(np.cross(way, forwards)) < 1e-6
    assert way @ forwards == pytest.approx(wanted.speed * 20.0, rel=0.1)  # one second of it


def test_shift_flies_faster(driver: Driver):
    ways = []
    for shift in (False, True):
        driver.press("R")
        driver.preview._inside.style = "fly"
        driver.preview.key("D", True, shift=shift)
        driver.wait(1.0)
        driver.preview.key("D", False)
        ways.append(np.linalg.norm(driver.wait(2.0).camera.position - HOME.position))
    assert ways[1] == pytest.approx(FAST * ways[0], rel=1e-6)


def test_the_wheel_sets_the_speed_of_flights(driver: Driver):
    driver.press("F")
    speed = driver.wait(0.0).speed
    driver.preview.wheel(1)
    assert driver.wait(0.1).speed == pytest.approx(speed * navigation.SPEED_PER_NOTCH)


def test_a_key_held_down_acts_once_and_losing_the_keyboard_lets_go(driver: Driver):
    for _ in range(4):
        driver.preview.key("O", True)
    assert not driver.wait(0.0).overlay
    driver.preview.key("RIGHT", True)
    driver.preview.button("left", True)
    driver.wait(0.5)
    driver.preview.let_go()
    turned = driver.wait(2.0).camera
    driver.preview.pointer(0, 0)
    driver.preview.pointer(100, 100)
    assert same(driver.wait(1.0).camera, turned)
    assert not same(turned, HOME)


def test_a_long_pause_is_no_leap(driver: Driver):
    driver.press("F")
    driver.preview.key("W", True)
    before = driver.wait(1.0).camera.position
    driver.now += 3600
    way = np.linalg.norm(driver.preview.advance(driver.now).camera.position - before)
    assert way <= 0.25 * driver.preview.advance(driver.now).speed * 20.0 * (1 + 1e-6)


# --- keys that are pressed ---------------------------------------------------------------------------------


@pytest.mark.parametrize("number", range(1, len(STEREO_MODES) + 1))
def test_number_keys_choose_a_stereo_mode(driver: Driver, number: int):
    driver.preview.choices.quad_buffers = True
    assert driver.press(str(number)).stereo.mode == STEREO_MODES[number - 1]


def test_n_goes_through_all_stereo_modes(driver: Driver):
    driver.preview.choices.quad_buffers = True
    seen = [driver.press("N").stereo.mode for _ in STEREO_MODES]
    assert seen == [*STEREO_MODES[1:], STEREO_MODES[0]]


def test_quad_buffers_that_are_not_there_are_said_and_mono_is_shown(driver: Driver):
    wanted = driver.press("4")
    assert wanted.stereo.shown_mode == "mono"
    assert "quad" in wanted.message
    while wanted.message:
        wanted = driver.wait(0.0)
    assert wanted.moving  # or the line would stay on the screen
    assert driver.now < 110
    assert driver.press("N").stereo.mode == "side_by_side"  # the one after quad


def test_mono_and_swap_are_toggles(driver: Driver):
    driver.press("8")
    assert driver.press("M").stereo.shown_mode == "mono"
    assert driver.press("M").stereo.shown_mode == "anaglyph"
    assert driver.press("X").stereo.channels == ("right", "left")
    assert driver.press("X").stereo.channels == ("left", "right")
    driver.press("X", "5")
    assert driver.wait(0.0).stereo.swapped  # another mode keeps it


def test_eyes_go_apart_and_together_around_the_camera(driver: Driver):
    wanted = driver.wait(0.0)
    np.testing.assert_allclose(wanted.eyes.middle, HOME.position, atol=MATRIX)
    assert np.linalg.norm(wanted.eyes.right - wanted.eyes.left) == pytest.approx(SEPARATION * HOME.distance)
    assert driver.press("]").separation == pytest.approx(SEPARATION * SEPARATION_STEP)
    assert driver.press("[", "[").separation == pytest.approx(SEPARATION / SEPARATION_STEP)
    assert driver.press("R").separation == SEPARATION


def test_quality_goes_up_and_down_within_limits(driver: Driver):
    assert driver.press("+").quality == pytest.approx(QUALITY_STEP)
    assert driver.press("-", "-").quality == pytest.approx(1 / QUALITY_STEP)
    assert driver.press(*["-"] * 40).quality == QUALITIES[0]
    assert driver.press(*["+"] * 40).quality == QUALITIES[1]


def test_presets_go_round_with_the_scenes_own(driver: Driver):
    assert [driver.press(".").preset for _ in range(3)] == ["bone", "skin", None]
    assert driver.press(",").preset == "skin"
    chosen = Driver(choices=Choices(("bone", "skin"), "skin"))  # one of them: not once more
    assert [chosen.press(".").preset for _ in range(2)] == ["bone", "skin"]


def test_overlay_help_screenshot_and_leaving(driver: Driver):
    assert driver.wait(0.0).overlay
    assert not driver.press("O").overlay
    assert driver.press("F1").help
    assert not driver.press("H").help
    driver.press("P", "P")
    assert driver.preview.choices.screenshots == 2
    driver.press("H", "ESCAPE")
    assert not driver.wait(0.0).help
    assert not driver.preview.finished
    driver.press("ESCAPE")
    assert driver.preview.finished


def test_reset_goes_home(driver: Driver):
    assert not same(driver.drag("left", (0, 0), (50, 50)).camera, HOME)
    assert same(driver.press("R").camera, HOME)


def test_styles(driver: Driver):
    assert driver.wait(0.0).style == "turntable"
    assert [driver.press(key).style for key in "TTFF"] == ["trackball", "turntable", "fly", "turntable"]


def test_resize_changes_the_picture_and_iconifying_does_not(driver: Driver):
    driver.preview.resize(640, 480)
    assert driver.wait(0.0).size == (640, 480)
    driver.preview.resize(0, 0)
    assert driver.wait(0.0).size == (640, 480)


def test_at_rest_nothing_is_to_be_drawn(driver: Driver):
    assert not driver.wait(0.1).moving
    driver.preview.key("O", True)
    assert driver.wait(0.0).moving
    driver.preview.key("O", False)
    assert not driver.wait(0.1).moving
    driver.preview.key("LEFT", True)
    assert driver.wait(0.1).moving
    driver.preview.key("LEFT", False)
    assert not driver.wait(3.0).moving


# --- the room from outside ---------------------------------------------------------------------------------


def test_tab_shows_the_room_and_the_mouse_moves_its_camera_alone(driver: Driver):
    inside = driver.wait(0.0).camera
    wanted = driver.press("TAB")
    assert wanted.outside
    assert same(wanted.camera, room_camera(four_walls(), SIZE))
    driver.drag("left", (0, 0), (30, 0))
    assert not same(driver.wait(0.0).camera, wanted.camera)
    assert same(driver.press("TAB").camera, inside)


def test_without_a_room_tab_does_nothing():
    driver = Driver(rig=None)
    wanted = driver.press("TAB")
    assert not wanted.outside
    assert wanted.head is None


def test_the_outside_camera_sees_all_walls():
    rig = four_walls()
    for size in ((400, 200), (200, 400)):
        camera = room_camera(rig, size)
        view = psw.View.through_wall(camera.position, camera.wall(size))
        pixels = view.project(rig.corners.reshape(-1, 3))
        assert (pixels > 0).all()
        assert (pixels < size).all()


def test_arrow_keys_move_the_head_outside(driver: Driver):
    rest = four_walls().eyes.rest_pose
    driver.press("TAB")
    for key, direction in (("RIGHT", (1, 0, 0)), ("UP", (0, 0, -1)), ("PAGE_UP", (0, 1, 0))):
        driver.press("R")
        driver.preview.key(key, True)
        driver.wait(1.0)
        driver.preview.key(key, False)
        way = driver.wait(2.0).head.position - rest.position
        np.testing.assert_allclose(way, HEAD_SPEED * np.array(direction), atol=0.02)
    before = driver.wait(0.0)
    driver.press("TAB")
    driver.preview.key("LEFT", True)  # inside it turns the camera
    np.testing.assert_allclose(driver.wait(0.5).head.position, before.head.position)


def test_ctrl_drags_turn_the_head_outside_and_not_the_camera(driver: Driver):
    before = driver.press("TAB")
    after = driver.drag("left", (100, 100), (140, 100), control=True)
    assert same(after.camera, before.camera)
    assert np.abs(after.head.matrix - before.head.matrix).max() > 0.1
    np.testing.assert_allclose(after.head.position, before.head.position, atol=1e-9)
    left, right = after.head_eyes
    assert np.linalg.norm(right - left) == pytest.approx(four_walls().eyes.separation)


def test_a_recorded_head_moves_with_time_and_halts():
    driver = Driver(head_at=lambda seconds: Pose((seconds, 1.5, 0.0)))
    wanted = driver.press("TAB")
    assert wanted.path_runs
    start = wanted.head.position[0]
    wanted = driver.wait(1.0)
    assert wanted.moving
    assert wanted.head.position[0] - start == pytest.approx(1.0)
    halted = driver.press("SPACE")
    assert not halted.path_runs
    assert driver.wait(1.0).head.position[0] == pytest.approx(halted.head.position[0])
    assert not driver.wait(0.1).moving
    assert driver.press("R").head.position[0] == 0


# --- what is said ------------------------------------------------------------------------------------------


def test_every_key_means_one_thing_and_the_help_tells_it():
    count = Counter(key for binding in BINDINGS for key in binding.keys)
    count.update(map(str, range(1, len(STEREO_MODES) + 1)))
    count.update({*THRUST_KEYS, *SPIN_KEYS})
    assert set(count.values()) == {1}
    assert set(count) == KEYS
    lines = help_text().splitlines()
    assert len(lines) == len(BINDINGS)
    for binding, line in zip(BINDINGS, lines, strict=True):
        assert line.startswith(binding.shown)
        assert line.endswith(binding.text)


@pytest.mark.parametrize("size", [(960, 720), (400, 300), (3840, 2160)])
def test_the_help_fits_the_window(size: tuple):
    from vr_plugin.screen.lettering import text_panel

    letter = fitting_letter(help_text(), size)
    height, width, _ = text_panel(help_text(), letter).shape
    assert letter == 6 or (width <= size[0] and height <= size[1])


def test_the_figures_say_what_was_measured(driver: Driver):
    rate = Rate()
    statistics = {
        "composite_ms": 12.34, "warp_ms": 3.21, "warp": "texture", "samples": 1_234_567, "faces": 2,
        "intermediate_size": [192, 160], "compositings": 2, "samples_per_interval": 2, "preintegrated": True,
        "quality": 1.414, "why": "", "target_hz": 0.0,
    }  # fmt: skip
    assert "-" in figures(driver.wait(0.0), statistics, rate).splitlines()[0]
    for seconds in (0.02, 0.02, 0.5):
        rate.add(seconds)
    text = figures(driver.press("8", "X", "+"), statistics, rate)
    for words in (
        "50.0 Hz", "20.0 ms", "12.3 ms", "3.2 ms, texture", "1.23 M", "2 samples an interval",
        "pre-integrated", "192 × 160", "1.4", "anaglyph, eyes swapped", "1/30", "the scene's own",
        "turntable",
    ):  # fmt: skip
        assert words in text, words
    driver.press("TAB", ".")
    outside = figures(driver.wait(0.0), statistics, rate)
    assert "+0.00 +1.70 +1.00 m, by keys" in outside
    assert "bone" in outside
    rate.clear()
    assert not rate.count


def test_keys_pressed_by_name(driver: Driver):
    press(driver.preview, "tab 8 o")
    wanted = driver.wait(0.0)
    assert wanted.outside
    assert wanted.stereo.mode == "anaglyph"
    assert not wanted.overlay
    with pytest.raises(PreviewError, match="no keys NONSENSE"):
        press(driver.preview, "TAB NONSENSE")
