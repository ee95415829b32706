"""The real preview in a real window of a virtual screen, moved by real key and mouse events."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageGrab
from samples import ROOT

from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.room_painter import BACKGROUND

pytestmark = pytest.mark.gl

PATIENCE_SECONDS = 20  # for what happens at once, but on a machine that may be busy, or compiling
SIZE = (480, 360)


@pytest.fixture(scope="module")
def screen() -> Iterator[str]:
    """DISPLAY of a screen of our own."""
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if missing:
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI has no {', '.join(missing)}")
        pytest.skip(f"no {', '.join(missing)}: apt-get install xvfb xdotool")
    reader, writer = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writer), "-screen", "0", "800x600x24", "-nolisten", "tcp"],
        pass_fds=[writer],
        stderr=subprocess.DEVNULL,
    )
    os.close(writer)
    with os.fdopen(reader) as pipe:
        number = pipe.readline().strip()
    assert number, "Xvfb did not start"
    try:
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@pytest.fixture
def volume_file(tmp_path: Path) -> Path:
    path = tmp_path / "body.npy"
    np.save(path, synthetic_ct(32).data)
    return path


class Preview:
    """`persp-sw view` in a process of its own, and hands on its keyboard and mouse."""

    def __init__(self, screen: str, *arguments: object):
        self._environment = {**os.environ, "DISPLAY": screen, "PYTHONPATH": str(ROOT)}
        self._screen = screen
        command = [sys.executable, "-W", "error", "-m", "persp_sw", "view", *map(str, arguments)]
        self.process = subprocess.Popen(
            [*command, "--size", *map(str, SIZE)],
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            self._window = self._find_window()
            self.do("windowmove", self._window, 0, 0, "windowfocus", "--sync", self._window)
            self.until(lambda picture: picture.max() > 60)  # the first frame is there
        except BaseException:
            self.process.kill()
            raise

    def _find_window(self) -> str:
        end = time.monotonic() + PATIENCE_SECONDS
        while time.monotonic() < end and self.process.poll() is None:
            found = self.do("search", "--onlyvisible", "--name", "persp-sw view", check=False).stdout.split()
            if found:
                return found[0]
            time.sleep(0.1)
        self.process.kill()
        pytest.fail(f"no window: {self.process.communicate()[1]}")

    def do(self, *words: object, check: bool = True) -> subprocess.CompletedProcess:
        """What xdotool does."""
        return subprocess.run(
            ["xdotool", *map(str, words)],
            env=self._environment,
            check=check,
            capture_output=True,
            text=True,
            timeout=PATIENCE_SECONDS,
        )

    def picture(self) -> np.ndarray:
        """(h, w, 3) int16: what the window shows now."""
        box = (0, 0, *SIZE)
        return np.asarray(ImageGrab.grab(bbox=box, xdisplay=self._screen)).astype(np.int16)

    def until(self, what: Callable[[np.ndarray], bool]) -> np.ndarray:
        """The first picture that is so, and stays for a moment."""
        end = time.monotonic() + PATIENCE_SECONDS
        before = None
        while time.monotonic() < end:
            assert self.process.poll() is None, self.process.communicate()[1]
            picture = self.picture()
            if before is not None and what(picture) and (picture == before).all():
                return picture
            before = picture
            time.sleep(0.15)
        path = Path(tempfile.gettempdir()) / "persp-sw-window-actual.png"
        Image.fromarray(before.astype(np.uint8)).save(path)
        pytest.fail(f"the picture never became so; it is in {path}")

    def leave(self, code: int = 0) -> dict:
        """Wait for the end, which must be clean."""
        out, errors = self.process.communicate(timeout=PATIENCE_SECONDS)
        assert self.process.returncode == code, errors
        assert "Traceback" not in errors
        return json.loads(out) if out else {}


@pytest.fixture
def preview(
    screen: str, volume_file: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> Iterator[Preview]:
    """The figures are off, for they change; tests find pictures in tmp_path."""
    more = getattr(request, "param", ())
    shown = Preview(screen, volume_file, "--press", "O", "--json", "-o", tmp_path, *more)
    yield shown
    if shown.process.poll() is None:
        shown.process.kill()
        shown.process.communicate()


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Mean difference, of 255."""
    return float(np.abs(a - b).mean())


def covered(picture: np.ndarray) -> float:
    """Which part of the picture is not background."""
    return float((picture.max(-1) > 8).mean())


@pytest.mark.parametrize("preview", [("--warp", "texture"), ("--warp", "software")], indirect=True)
def test_hands_move_the_view_and_keys_change_it(preview: Preview, tmp_path: Path):
    home = preview.until(lambda p: covered(p) > 0.1)
    assert covered(home[:40, :40]) == 0  # no figures
    changed = lambda p: apart(p, home) > 1  # noqa: E731

    # An orbit, and back.
    preview.do(
        "mousemove", 200, 180, "mousedown", 1, "mousemove", 260, 180, "mousemove", 320, 200, "mouseup", 1
    )
    turned = preview.until(changed)
    assert 0.5 * covered(home) < covered(turned) < 2 * covered(home)  # the same thing from another side
    preview.do("key", "r")
    preview.until(lambda p: (p == home).all())

    # The wheel, and back.
    preview.do("mousemove", 240, 180, "click", "--repeat", 3, "--delay", 30, 4)
    preview.until(lambda p: covered(p) > 1.15 * covered(home))
    preview.do("key", "r")
    preview.until(lambda p: (p == home).all())

    # Stereo by number, mono and back.
    preview.do("key", "5")
    halves = preview.until(changed)
    left, right = halves[:, : SIZE[0] // 2], halves[:, SIZE[0] // 2 :]
    assert covered(left) == pytest.approx(covered(right), rel=0.1)
    assert 0 < apart(left, right) < apart(left, home[:, : SIZE[0] // 2])
    preview.do("key", "x")
    swapped = preview.until(lambda p: not (p == halves).all())
    assert (swapped == np.concatenate([right, left], 1)).all()
    preview.do("key", "8")
    preview.until(lambda p: apart(p, swapped) > 1 and changed(p))
    preview.do("key", "m")
    preview.until(lambda p: (p == home).all())

    # A picture on disk is what the window shows.
    preview.do("key", "p")
    preview.until(lambda p: covered(p[-40:]) > 0.05)  # it says so
    file = tmp_path / "body-view-001.png"
    saved = np.asarray(Image.open(file).convert("RGB")).astype(np.int16)
    assert saved.shape == home.shape
    assert np.abs(saved - home).max() <= 2
    preview.do("key", "r")
    preview.until(lambda p: (p == home).all())  # for a few seconds only

    # Figures, help, leaving.
    preview.do("key", "o")
    preview.until(lambda p: covered(p[:40, :200]) > 0.02)
    preview.do("key", "F1")
    preview.until(lambda p: covered(p[150:250, :100]) > 0.02)  # where nothing was before
    preview.do("key", "Escape", "key", "Escape")
    values = preview.leave()
    assert values["screenshots"] == [str(file)]
    assert values["frames"] > 10


def test_flight_and_the_room_from_outside(preview: Preview):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.do("key", "f", "keydown", "w", "sleep", 1, "keyup", "w")
    preview.until(lambda p: covered(p) > 1.1 * covered(home))
    preview.do("key", "Tab")
    corner = lambda p: np.abs(p[2, 2] - BACKGROUND).max() <= 1  # noqa: E731
    room = preview.until(corner)
    # The walls' outlines are the brightest thing: white lines on dark grey.
    assert ((room.min(-1) > 150).sum()) > 100
    preview.do("keydown", "Left", "sleep", 0.5, "keyup", "Left")
    moved = preview.until(lambda p: apart(p, room) > 0.05)
    assert corner(moved)
    preview.do("key", "8")
    preview.until(lambda p: apart(p, moved) > 0.05)
    preview.do("key", "v")
    preview.until(lambda p: apart(p, moved) > 0.05)
    preview.do("key", "Escape")
    assert preview.leave()["compositings"] == 2  # the volume itself is off: two eyes


def test_an_interruption_ends_the_program_without_a_traceback(preview: Preview):
    preview.process.send_signal(signal.SIGINT)
    preview.leave(130)


def test_a_window_can_be_resized(preview: Preview):
    home = preview.until(lambda p: covered(p) > 0.1)
    preview.do("windowsize", "--sync", preview._window, 300, 300)
    smaller = preview.until(lambda p: apart(p, home) > 0.2)
    assert covered(smaller[:, 300:]) == 0
    assert covered(smaller[:300, :300]) > 0.1
    preview.do("key", "Escape")
    preview.leave()


def test_so_many_frames_are_drawn_and_then_it_ends(screen: str, volume_file: Path):
    environment = {**os.environ, "DISPLAY": screen, "PYTHONPATH": str(ROOT)}
    command = ["view", volume_file, "--frames", 5, "--turn", 5, "--json", "--stereo", "quad", "--size", *SIZE]
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "persp_sw", *map(str, command)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE_SECONDS,
    )
    assert done.returncode == 0, done.stderr
    values = json.loads(done.stdout)
    assert values["frames"] == 5
    assert values["compositings"] == 1  # no quad buffers on this screen: mono, and that is said
    assert "no quad-buffered stereo" in done.stderr
