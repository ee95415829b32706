"""Windows on a virtual screen, driven by real keys and a real mouse."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from virtual_screen import SCREEN, Program, display  # noqa: F401  (a fixture)

import persp_sw as psw
from vr_plugin.screen.monitors import Monitors
from vr_plugin.stereo import shows_left
from vr_plugin.window import Window

pytestmark = pytest.mark.gl

HEAD = """
from window_program import flat, run, say, settle, tell
from vr_plugin.screen.monitors import WindowError
from vr_plugin.rig import WindowPlace
from vr_plugin.window import Windows
"""
TWO = (
    HEAD
    + """
with Windows() as windows:
    first = windows.open("first", WindowPlace(position=(100, 51), size=(320, 240)))
    from OpenGL import GL
    from vr_plugin.present import Composer, read_screen
    target, other = flat((1, 0.5, 0.25), (320, 240)), flat((0, 0, 1), (320, 240))
    GL.glFlush()
    composers = {"first": Composer()}
    second = windows.open("second", WindowPlace(position=(500, 202), size=(320, 240)))
    composers["second"] = Composer()

    def draw():
        for window in windows:
            window.make_current()
            mode = "interlaced" if window.name == "second" else "mono"
            composers[window.name].compose(target, other, mode, window.size, first_row=window.first_row)

    draw()
    say({name: read_screen((4, 4))[0, 0].tolist() for name in ("second",)})
    windows.swap()
    run(windows, draw)
"""
)
ONE = (
    HEAD
    + """
with Windows() as windows:
    window = windows.open("one", WindowPlace(position=(40, 30), size=(300, 200)), title="One window")
    from OpenGL import GL
    from vr_plugin.present import read_screen
    say(window.size)

    def draw():
        GL.glClearColor(0.2, 0.4, 0.6, 1)
        GL.glClear(GL.GL_COLOR_BUFFER_BIT)

    run(windows, draw)
    draw()
    say([window.size, read_screen(window.size).shape, read_screen(window.size)[-1, -1].tolist()])
"""
)


def bytes_of(*linear: float) -> list[int]:
    return np.rint(255 * psw.images.srgb(linear)).astype(int).tolist()


def test_two_windows_share_a_texture_and_show_it(display, tmp_path):  # noqa: F811
    with Program(display, TWO) as program:
        program.value()
        program.focus("second")
        program.until("Focus")
        screen = program.grab(tmp_path / "screen.png")
        left, right = bytes_of(1, 0.5, 0.25), bytes_of(0, 0, 1)
        assert (screen[51 : 51 + 240, 100 : 100 + 320] == left).all()
        second = screen[202 : 202 + 240, 500 : 500 + 320]
        expected = np.where(shows_left(np.arange(202, 442))[:, None, None], left, right)
        assert (second == expected).all()
        assert (screen[:50] == 0).all() and (screen[:, :99] == 0).all()
        program.hand("key", "Escape")
        assert program.end() == (0, "")


def test_keys_text_and_modifiers_arrive(display):  # noqa: F811
    with Program(display, ONE) as program:
        assert program.value() == [300, 200]
        program.focus("One window")
        for keys in ("a", "shift+b", "ctrl+Left", "F1", "plus", "Tab", "Escape"):
            program.hand("key", "--delay", 40, keys)
        seen = program.until("Key")
        while not (seen[-1].get("name") == "ESCAPE" and seen[-1]["kind"] == "Key"):
            seen += program.until("Key")
        assert {event["window"] for event in seen} == {"one"}
        down = [e for e in seen if e["kind"] == "Key" and e["down"] and not e["repeat"]]
        names = [e["name"] for e in down if "SHIFT" not in e["name"] and "CONTROL" not in e["name"]]
        assert names == ["A", "B", "LEFT", "F1", "=", "TAB", "ESCAPE"]
        by_name = {event["name"]: event for event in down}
        assert by_name["B"]["shift"] and not by_name["A"]["shift"]
        assert by_name["LEFT"]["control"] and not by_name["F1"]["control"]
        assert "".join(e["character"] for e in seen if e["kind"] == "Text") == "aB+"
        assert sum(e["kind"] == "Key" and e["name"] == "A" and not e["down"] for e in seen) == 1
        program.value()
        assert program.end() == (0, "")


def test_the_mouse_arrives_in_pixels(display):  # noqa: F811
    with Program(display, ONE) as program:
        program.value()
        number = program.focus("One window")
        program.hand("mousemove", "--window", number, 123, 45)
        program.hand("click", 3)
        program.hand("click", 4)
        program.hand("keydown", "shift")
        program.hand("click", 5)
        program.hand("keyup", "shift")
        program.hand("mousemove", 45, 37)
        program.hand("mousedown", 1)
        program.hand("mousemove", 47, 40)
        program.hand("mouseup", 1)
        program.hand("key", "Escape")
        seen = program.until("Key")
        while seen[-1].get("name") != "ESCAPE":
            seen += program.until("Key")
        places = [(e["x"], e["y"]) for e in seen if e["kind"] == "Pointer"]
        assert (123, 45) in places
        assert places[-2:] == [(5, 7), (7, 10)]  # the window's corner is at (40, 30)
        buttons = [(e["name"], e["down"]) for e in seen if e["kind"] == "Button"]
        assert buttons == [("right", True), ("right", False), ("left", True), ("left", False)]
        wheel = [(e["notches"], e["shift"]) for e in seen if e["kind"] == "Wheel"]
        assert wheel == [(1, False), (-1, True)]


def test_a_window_follows_its_size(display):  # noqa: F811
    with Program(display, ONE) as program:
        program.value()
        number = program.focus("One window")
        program.hand("windowsize", "--sync", number, 411, 277)
        seen = program.until("Resized")
        assert (seen[-1]["width"], seen[-1]["height"]) == (411, 277)
        program.hand("key", "Escape")
        program.until("Key")
        size, shape, corner = program.value()
        assert size == [411, 277] and shape == [277, 411, 3]
        assert corner == [51, 102, 153]


def test_the_close_button_is_an_event(display):  # noqa: F811
    with Program(display, ONE) as program:
        program.value()
        program.focus("One window")
        program.press_close("One window")
        assert program.until("Closing")[-1]["window"] == "one"
        program.value()
        assert program.end() == (0, "")


def test_a_closed_window_leaves_the_others(display):  # noqa: F811
    code = (
        HEAD
        + """
with Windows() as windows:
    a, b = windows.open("a", pixels=(64, 48)), windows.open("b", pixels=(64, 48))
    from OpenGL import GL
    target = flat((0, 1, 0), (64, 48))
    GL.glFlush()
    a.make_current()
    a.close()
    say([a.is_open, b.is_open, [window.name for window in windows]])
    b.make_current()
    from vr_plugin.present import Composer, read_screen
    composer = Composer()
    composer.compose(target, target, "mono", b.size)
    say(read_screen(b.size)[20, 20].tolist())
    a = windows.open("a", pixels=(32, 32))  # shares with b
    composer = Composer()
    composer.compose(target, target, "mono", a.size)
    say(read_screen(a.size)[20, 20].tolist())
"""
    )
    with Program(display, code) as program:
        assert program.value() == [False, True, ["b"]]
        assert program.value() == [0, 255, 0]
        assert program.value() == [0, 255, 0]
        assert program.end() == (0, "")


def test_there_is_one_set_of_windows_at_a_time(display):  # noqa: F811
    code = (
        HEAD
        + """
with Windows() as windows:
    windows.open("a", pixels=(32, 32))
    try:
        Windows()
    except WindowError as error:
        say(str(error))
    windows.close()
with Windows() as windows:
    say(windows.open("a", pixels=(40, 30)).size)
"""
    )
    with Program(display, code) as program:
        assert "open already" in program.value()
        assert program.value() == [40, 30]
        assert program.end() == (0, "")


def test_windows_are_swapped_together_and_wait_once(display):  # noqa: F811
    code = (
        HEAD
        + """
with Windows() as windows:
    calls, glfw, intervals = [], windows.glfw, {}
    current = [None]
    make_current, swap_interval = glfw.make_context_current, glfw.swap_interval
    swap_buffers = glfw.swap_buffers
    def making(handle):
        current[0] = handle
        make_current(handle)
    def waiting(n):
        intervals[next((w.name for w in windows if w.handle is current[0]), "new")] = n
        swap_interval(n)
    def swapping(handle):
        calls.append(next(w.name for w in windows if w.handle is handle))
        swap_buffers(handle)
    glfw.make_context_current, glfw.swap_interval, glfw.swap_buffers = making, waiting, swapping
    for name in "abc":
        windows.open(name, pixels=(32, 32))
    say(intervals)
    windows.swap()
    say(calls)
    next(w for w in windows if w.name == "c").close()
    say([intervals["a"], intervals["b"]])
"""
    )
    with Program(display, code) as program:
        assert program.value() == {"a": 0, "b": 0, "c": 1}
        assert program.value() == ["a", "b", "c"]
        assert program.value() == [0, 1]
        assert program.end() == (0, "")


def test_fullscreen_fills_its_monitor_and_survives_its_loss(display):  # noqa: F811
    code = (
        HEAD
        + """
import logging
logging.basicConfig(level=logging.WARNING, format="%(message)s")
with Windows() as windows:
    window = windows.open("front", WindowPlace(monitor=0, fullscreen=True), pixels=(10, 10))
    monitor = windows.monitors.all()[0]
    settle(windows, lambda: window.size == monitor.size)
    say([window.size, window.fullscreen_on == monitor.name, monitor.size, window.first_row])
    handle = windows.glfw.get_monitors()[0]
    # What glfw does before it calls: the window is one no longer on the monitor.
    windows.glfw.set_window_monitor(window.handle, None, 0, 0, *monitor.size, 0)
    windows._monitor_changed(handle, windows.glfw.DISCONNECTED)
    half = tuple(n // 2 for n in monitor.size)
    settle(windows, lambda: window.size == half and window.position == (half[0] // 2, half[1] // 2))
    say([window.size, window.position, window.fullscreen_on])
    windows._monitor_changed(handle, windows.glfw.CONNECTED)
    for event in settle(windows, lambda: window.size == monitor.size):
        tell(event)
    say([window.size, window.fullscreen_on == monitor.name])
"""
    )
    with Program(display, code) as program:
        assert program.value() == [list(SCREEN), True, list(SCREEN), 0]
        size, position, monitor = program.value()
        assert size == [SCREEN[0] // 2, SCREEN[1] // 2]
        assert position == [SCREEN[0] // 4, SCREEN[1] // 4]
        assert monitor == ""
        change = program.until("MonitorChange")[-1]
        assert change["connected"]
        size, full = next(value for value in iter(program.value, None) if isinstance(value, list))
        assert size == list(SCREEN) and full
        code, words = program.end()
        assert code == 0
        lines = words.splitlines()
        assert len(lines) == 2
        assert lines[0] == "monitor screen is lost: window front is now a window on screen"
        assert lines[1] == "monitor screen is back, and window front on it"


def test_a_window_placed_on_a_lost_monitor_is_brought_back(display):  # noqa: F811
    code = (
        HEAD
        + """
import logging
logging.basicConfig(level=logging.WARNING, format="%(message)s")
with Windows() as windows:
    far = windows.open("far", WindowPlace(position=(1700, 100), size=(64, 48)))
    near = windows.open("near", WindowPlace(position=(200, 100), size=(64, 48)))
    handle = windows.glfw.get_monitors()[0]
    for change, place in ((windows.glfw.DISCONNECTED, (0, 0)), (windows.glfw.CONNECTED, (1700, 100))):
        windows._monitor_changed(handle, change)
        settle(windows, lambda: far.position == place)
        say([far.position, near.position])
"""
    )
    with Program(display, code) as program:
        assert program.value() == [[0, 0], [200, 100]]
        assert program.value() == [[1700, 100], [200, 100]]
        code, words = program.end()
        assert code == 0
        assert words.count("window far") == 2 and "near" not in words


def test_refusals_are_one_line_with_advice(display):  # noqa: F811
    code = (
        HEAD
        + """
try:
    with Windows() as windows:
        windows.open("a", pixels=(32, 32))
        for place, name in ((WindowPlace(monitor=3, fullscreen=True), "b"), (None, "a")):
            try:
                windows.open(name, place)
            except WindowError as error:
                say(str(error))
        hints = windows._hints
        windows._hints = lambda *a: hints(*a) | {windows.glfw.CONTEXT_VERSION_MAJOR: 9}
        windows.open("c")
except WindowError as error:
    say(str(error))
"""
    )
    with Program(display, code) as program:
        monitors = program.value()
        assert "the window of 'b' wants monitor 3; there are: 0 (screen, 1600 × 1200 at (0, 0))" in monitors
        assert "names of their own" in program.value()
        context = program.value()
        assert context.startswith("no window for 'c': ") and "OpenGL 3.3" in context
        assert "--offscreen" in context and "\n" not in context
        assert program.end() == (0, "")


def test_screens_with_several_pixels_a_coordinate():
    """None is here: what glfw says of one with two a coordinate, on the lower of two monitors."""
    glfw = SimpleNamespace(
        get_framebuffer_size=lambda _: (800, 600),
        get_window_size=lambda _: (400, 300),
        get_window_pos=lambda _: (10, 1221),
        get_monitors=lambda: ["upper", "lower"],
        get_monitor_name=lambda handle: handle,
        get_monitor_pos=lambda handle: (0, 0 if handle == "upper" else 1200),
        get_video_mode=lambda _: SimpleNamespace(size=(1920, 1200), refresh_rate=60),
    )
    window = Window(SimpleNamespace(glfw=glfw, monitors=Monitors(glfw)), "wall", object())
    assert window.size == (800, 600)
    assert window.pixel(12.5, 30) == (25, 60)
    assert window.first_row == 42  # (1221 − 1200) · 2
    glfw.get_framebuffer_size = lambda _: (0, 0)  # iconified
    window.measure()
    assert not window.is_drawn
    assert window.pixel(12.5, 30) == (25, 60)


@pytest.mark.parametrize("screen", [None, ":987"])
def test_without_a_display_there_is_advice(screen):
    code = HEAD + "\ntry:\n    Windows()\nexcept WindowError as error:\n    say(str(error))\n"
    with Program(screen, code) as program:
        message = program.value()
        assert message.startswith("no window can be opened: ")
        for advice in ("DISPLAY", "xvfb-run", "--offscreen"):
            assert advice in message
        assert "\n" not in message
        assert program.end() == (0, "")


def test_quad_buffers_fall_back_with_one_message(display):  # noqa: F811
    code = (
        HEAD
        + """
import logging
logging.basicConfig(level=logging.WARNING, format="%(message)s")
with Windows() as windows:
    for name in "ab":
        window = windows.open(name, pixels=(64, 48), quad_buffered=True)
        from vr_plugin.present import Composer, read_screen
        composer = Composer()
        left, right = flat((0, 1, 0), (64, 48)), flat((1, 0, 0), (64, 48))
        for _ in range(3):
            composer.compose(left, right, composer.possible_mode("quad"), window.size)
        say([composer.has_quad_buffers(), composer.possible_mode("quad"), read_screen((1, 1))[0, 0].tolist()])
"""
    )
    with Program(display, code) as program:
        for _ in range(2):
            quad, mode, colour = program.value()
            if quad:
                pytest.skip("this screen has quad buffers")
            assert (mode, colour) == ("mono", [0, 255, 0])
        code, words = program.end()
        assert code == 0
        assert len(words.splitlines()) == 1
        assert "no quad-buffered stereo: showing mono instead" in words


@pytest.mark.parametrize("platform", ["egl", "glx"])
def test_windows_live_beside_offscreen_contexts(display, platform):  # noqa: F811
    code = (
        HEAD
        + """
import persp_sw as psw
with psw.OffscreenContext():
    from OpenGL import GL
    say(GL.glGetString(GL.GL_VERSION).decode())
with Windows() as windows:
    window = windows.open("a", pixels=(64, 48))
    from vr_plugin.present import Composer, read_screen
    target = flat((0.5, 0, 0), (64, 48))
    Composer().compose(target, target, "mono", window.size)
    say(read_screen((1, 1))[0, 0].tolist())
    import numpy as np
    from vr_plugin.screen.shapes import Shapes
    Shapes().polygon(np.eye(4), [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], (1, 1, 0), hidden=False)
    say(read_screen((1, 1))[0, 0].tolist())
"""
    )
    with Program(display, code, PYOPENGL_PLATFORM=platform) as program:
        program.value()
        assert program.value() == bytes_of(0.5, 0, 0)
        assert program.value() == [255, 255, 0]
        assert program.end() == (0, "")
