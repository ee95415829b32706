"""The real preview in a real window of a virtual screen, moved by real key and mouse events."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from samples import ROOT
from virtual_screen import SECONDS, Program, display, environment  # noqa: F401  (a fixture)

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.film.flight_file import load_flight
from vr_plugin.preview.saved_view import SavedView
from vr_plugin.room.painter import BACKGROUND

pytestmark = pytest.mark.gl

SIZE = (480, 360)
REFINED_S = 2.0  # more than refining so small a volume takes
TITLE = "body: persp-sw view"
STAYS = ("--target", 0)
DRAG = ("mousemove", 200, 180, "mousedown", 1, "mousemove", 260, 180, "mousemove", 320, 200, "mouseup", 1)


@pytest.fixture
def volume_file(tmp_path: Path) -> Path:
    path = tmp_path / "body.npy"
    np.save(path, synthetic_ct(32).data)
    return path


class Preview(Program):
    """`persp-sw view` in a process of its own, and hands on its keyboard and mouse."""

    def __init__(self, display: str, *arguments: object):  # noqa: F811
        self.display = display
        self._process = subprocess.Popen(
            [sys.executable, "-W", "error", "-m", "persp_sw", "view", *map(str, arguments)],
            env=environment(display),
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def picture(self) -> np.ndarray:
        """(h, w, 3) int16: what the window shows now."""
        return self.grab()[: SIZE[1], : SIZE[0]].astype(np.int16)

    def until(self, what: Callable[[np.ndarray], bool]) -> np.ndarray:
        """The first picture that is so, and stays for a moment."""
        end = time.monotonic() + SECONDS
        before = None
        while time.monotonic() < end:
            assert self._process.poll() is None, self._process.communicate()[1]
            picture = self.picture()
            if before is not None and what(picture) and (picture == before).all():
                return picture
            before = picture
            time.sleep(0.1)
        path = Path(tempfile.gettempdir()) / "persp-sw-window-actual.png"
        Image.fromarray(before.astype(np.uint8)).save(path)
        pytest.fail(f"the picture never became so; it is in {path}")

    def leave(self, code: int = 0) -> dict:
        """Wait for the end, which must be clean; what it printed."""
        out, errors = self._process.communicate(timeout=SECONDS)
        assert self._process.returncode == code, errors
        assert "Traceback" not in errors
        return json.loads(out) if out else {}

    def interrupt(self) -> None:
        """What Ctrl-C in its terminal does."""
        self._process.send_signal(signal.SIGINT)


@pytest.fixture
def preview(
    display: str,  # noqa: F811
    volume_file: Path,
    tmp_path: Path,
    request: pytest.FixtureRequest,
) -> Iterator[Preview]:
    """Figures are off, for they change; quality stays, but where a test says else; files go to tmp_path."""
    more = getattr(request, "param", STAYS)
    options = ("--press", "O", "--trace", tmp_path / "trace.jsonl", "--json", "-o", tmp_path)
    options += ("--size", *SIZE, *more)
    with Preview(display, volume_file, *options) as shown:
        number = shown.window(TITLE)
        shown.hand("windowmove", number, 0, 0)
        shown.focus(TITLE)
        shown.until(lambda picture: picture.max() > 60)  # the first frame is there
        yield shown


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Mean difference, of 255."""
    return float(np.abs(a - b).mean())


def covered(picture: np.ndarray) -> float:
    """Which part of the picture is not background."""
    return float((picture.max(-1) > 8).mean())


@pytest.mark.parametrize(
    "preview", [(*STAYS, "--warp", "texture"), (*STAYS, "--warp", "software")], indirect=True
)
def test_hands_move_the_view_and_keys_change_it(preview: Preview, tmp_path: Path):
    home = preview.until(lambda p: covered(p) > 0.1)
    assert covered(home[:40, :40]) == 0  # no figures
    changed = lambda p: apart(p, home) > 1  # noqa: E731

    # An orbit, and back.
    preview.hand(*DRAG)
    turned = preview.until(changed)
    assert 0.5 * covered(home) < covered(turned) < 2 * covered(home)  # the same thing from another side
    preview.hand("key", "r")
    preview.until(lambda p: (p == home).all())

    # The wheel, and back.
    preview.hand("mousemove", 240, 180, "click", "--repeat", 3, "--delay", 30, 4)
    preview.until(lambda p: covered(p) > 1.15 * covered(home))
    preview.hand("key", "r")
    preview.until(lambda p: (p == home).all())

    # Stereo by number, mono and back.
    preview.hand("key", "5")
    halves = preview.until(changed)
    left, right = halves[:, : SIZE[0] // 2], halves[:, SIZE[0] // 2 :]
    assert covered(left) == pytest.approx(covered(right), rel=0.1)
    assert 0 < apart(left, right) < apart(left, home[:, : SIZE[0] // 2])
    preview.hand("key", "x")
    swapped = preview.until(lambda p: not (p == halves).all())
    assert (swapped == np.concatenate([right, left], 1)).all()
    preview.hand("key", "8")
    preview.until(lambda p: apart(p, swapped) > 1 and changed(p))
    preview.hand("key", "m")
    preview.until(lambda p: (p == home).all())

    # A picture on disk is what the window shows.
    preview.hand("key", "p")
    preview.until(lambda p: covered(p[-40:]) > 0.05)  # it says so
    file = tmp_path / "body-view-001.png"
    saved = np.asarray(Image.open(file).convert("RGB")).astype(np.int16)
    assert saved.shape == home.shape
    assert np.abs(saved - home).max() <= 2
    preview.hand("key", "r")
    preview.until(lambda p: (p == home).all())  # for a few seconds only

    # Figures, help, leaving.
    preview.hand("key", "o")
    preview.until(lambda p: covered(p[:40, :200]) > 0.02)
    preview.hand("key", "F1")
    preview.until(lambda p: covered(p[180:280, 114:150]) > 0.05)  # where nothing was before
    preview.hand("key", "Escape", "key", "Escape")
    values = preview.leave()
    assert values["screenshots"] == [str(file)]
    assert values["frames"] > 10


@pytest.mark.parametrize("preview", [("--target", 1000, "--shot-size", 640, 200)], indirect=True)
def test_flights_sessions_and_large_pictures_are_kept(preview: Preview, tmp_path: Path):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.hand("key", "F9")
    preview.hand(*DRAG)
    preview.until(lambda p: apart(p, home) > 1)
    before = [home]

    def at_rest(picture: np.ndarray) -> bool:
        time.sleep(0.4)
        before.append(picture)
        return np.array_equal(*before[-2:])

    preview.until(at_rest)
    for key, name in (("F9", "flight-001.csv"), ("F5", "001.session.toml"), ("p", "view-001.png")):
        preview.hand("key", key)
        end = time.monotonic() + SECONDS
        while not (tmp_path / f"body-{name}").exists() and time.monotonic() < end:
            time.sleep(0.1)
    preview.hand("key", "Escape")
    values = preview.leave()
    assert [Path(name).name for name in values["screenshots"]] == [
        "body-flight-001.csv", "body-001.session.toml", "body-view-001.png",
    ]  # fmt: skip
    # The flight ends where the session stands, and the picture is the renderer's from there: full quality.
    session = psw.Scene.load(tmp_path / "body-001.session.toml")
    flight = load_flight(tmp_path / "body-flight-001.csv")
    assert flight.eye_way > 1
    np.testing.assert_allclose(flight.keys[-1].camera.position, session.keys.eye, atol=1e-9)
    camera = SavedView.of_scene(session).camera_of(session)
    image = psw.Renderer(session.volume, session.transfer).render(
        psw.View.through_wall(camera.position, camera.wall((640, 200)))
    )
    with Image.open(tmp_path / "body-view-001.png") as picture:
        assert np.array_equal(np.asarray(picture), psw.images.presented(image))


@pytest.mark.parametrize(
    "preview", [(*STAYS, "--warp", "texture"), (*STAYS, "--warp", "software")], indirect=True
)
def test_keys_and_clicks_show_marks_and_pick(preview: Preview):
    home = preview.until(lambda p: covered(p) > 0.1)
    for key in ("b", "y", "u", "l"):
        preview.hand("key", key)
        marked = preview.until(lambda p: (p != home).any())
        # Marks stand outside the body, too, where nothing was; and hide little.
        assert 0.001 < covered(marked) - covered(home) < 0.3, key
        preview.hand("key", key)
        preview.until(lambda p: (p == home).all())

    preview.hand("mousemove", 240, 180, "keydown", "ctrl", "click", 1, "keyup", "ctrl")
    preview.until(lambda p: covered(p[-40:]) > 0.05)  # it says what is there
    picked = preview.until(lambda p: covered(p[-40:]) < 0.05)  # for a few seconds
    assert (picked != home).any(-1).sum() > 300
    # The cursor's arms begin around what was clicked at.
    assert (picked != home).any(-1)[165:195, 225:255].sum() > 20
    preview.hand("key", "c", "key", "c")
    preview.until(lambda p: (p == home).all())

    # Window and level; a preset brings colours back.
    preview.hand("keydown", "ctrl", "mousemove", 280, 100, "mousedown", 1, "mousemove", 240, 100)
    preview.hand("mousemove", 200, 100, "mouseup", 1, "keyup", "ctrl")
    grey = preview.until(lambda p: apart(p, home) > 1 and np.ptp(p, axis=-1).max() <= 1)  # no words, either
    assert covered(grey) > 0.1
    preview.hand("key", "period", "key", "comma")
    preview.until(lambda p: (p == home).all())
    preview.hand("key", "Escape")
    preview.leave()


def test_flight_and_the_room_from_outside(preview: Preview):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.hand("key", "f", "keydown", "w", "sleep", 1, "keyup", "w")
    preview.until(lambda p: covered(p) > 1.1 * covered(home))
    preview.hand("key", "Tab")
    corner = lambda p: np.abs(p[2, 2] - BACKGROUND).max() <= 1  # noqa: E731
    room = preview.until(corner)
    # The walls' outlines are the brightest thing: white lines on dark grey.
    assert ((room.min(-1) > 150).sum()) > 100
    preview.hand("keydown", "Left", "sleep", 0.5, "keyup", "Left")
    moved = preview.until(lambda p: apart(p, room) > 0.05)
    assert corner(moved)
    preview.hand("key", "8")
    preview.until(lambda p: apart(p, moved) > 0.05)
    preview.hand("key", "v")
    preview.until(lambda p: apart(p, moved) > 0.05)
    preview.hand("key", "Escape")
    assert preview.leave()["compositings"] == 2  # the volume itself is off: two eyes


@pytest.mark.parametrize("preview", [("--target", 1000)], indirect=True)
def test_quality_follows_the_frame_rate_and_is_refined_at_rest(preview: Preview, tmp_path: Path):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.hand(*DRAG)
    preview.until(lambda p: apart(p, home) > 1)
    time.sleep(REFINED_S)
    preview.hand("key", "Tab")
    preview.until(lambda p: np.abs(p[2, 2] - BACKGROUND).max() <= 1)
    time.sleep(REFINED_S)
    preview.hand("key", "Tab")
    time.sleep(REFINED_S)
    preview.hand("key", "Escape")
    assert preview.leave()["target_hz"] == 1000.0
    trace = psw.read_trace(tmp_path / "trace.jsonl")
    refined, quality = trace["why"] == "refined", trace["quality"]
    # Four rests; each ends in full quality, which no moving picture at such a rate has.
    ends = np.flatnonzero(refined & ~np.append(refined[1:], False))
    assert len(ends) >= 4
    assert (quality[ends[-3:]] == 2.0).all()
    assert quality[~refined].min() < 1.0
    assert ends[-1] == len(refined) - 1  # and nothing was drawn after it


@pytest.mark.parametrize("preview", [("--quality", 0.5)], indirect=True)
def test_a_quality_that_is_given_stays_until_it_is_let_go(preview: Preview, tmp_path: Path):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.hand(*DRAG)
    turned = preview.until(lambda p: apart(p, home) > 1)
    preview.hand("key", "0")
    preview.until(lambda p: (p != turned).any())
    preview.hand("key", "Escape")
    assert preview.leave()["target_hz"] == 30.0
    trace = psw.read_trace(tmp_path / "trace.jsonl")
    held = trace["why"] == "held"
    assert (trace["quality"][held] == 0.5).all()
    assert held[:10].all()
    assert not held[-1]


def test_the_close_button_ends_the_program(preview: Preview):
    preview.press_close(TITLE)
    assert preview.leave()["frames"] >= 1


def test_an_interruption_ends_the_program_without_a_traceback(preview: Preview):
    preview.interrupt()
    preview.leave(130)


def test_a_window_can_be_resized(preview: Preview):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.hand("windowsize", "--sync", preview.window(TITLE), 300, 300)
    smaller = preview.until(lambda p: apart(p, home) > 0.2)
    assert covered(smaller[:, 300:]) == 0
    assert covered(smaller[:300, :300]) > 0.1
    preview.hand("key", "Escape")
    preview.leave()


def test_so_many_frames_are_drawn_and_then_it_ends(display: str, volume_file: Path):  # noqa: F811
    options = ("--frames", 5, "--turn", 5, "--json", "--stereo", "quad", "--size", *SIZE)
    with Preview(display, volume_file, *options) as shown:
        out, errors = shown._process.communicate(timeout=SECONDS)
    assert shown._process.returncode == 0, errors
    values = json.loads(out)
    assert values["frames"] == 5
    assert values["compositings"] == 1  # no quad buffers on this screen: mono, and that is said
    assert "no quad-buffered stereo" in errors
