"""`persp-sw cave` in real windows of a virtual screen: what walls show, real keys, clean ends."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from samples import ROOT
from virtual_screen import SECONDS, Program, display, environment  # noqa: F401  (a fixture)

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.eyes import eyes_of_head
from vr_plugin.frame import FrameMaker
from vr_plugin.placement import room_from_world
from vr_plugin.rigs.file import load_rig
from vr_plugin.stereo import combine

pytestmark = pytest.mark.gl

EDGE = 200
RIG = f"""
[[wall]]
name = "front"
lower_left = [-1, 0.7, -1]
lower_right = [1, 0.7, -1]
upper_left = [-1, 2.7, -1]
pixels = [{EDGE}, {EDGE}]
stereo = "anaglyph"
window = {{ position = [0, 0], size = [{EDGE}, {EDGE}] }}

[[wall]]
name = "side"
lower_left = [1, 0.7, -1]
lower_right = [1, 0.7, 1]
upper_left = [1, 2.7, -1]
pixels = [{EDGE}, {EDGE}]
stereo = "left"
window = {{ position = [{EDGE}, 0], size = [{EDGE}, {EDGE}] }}

[eyes]
rest_pose = {{ position = [-0.2, 1.7, 0.9], look = [0, 0, -1] }}

[tracker]
kind = "mouse"
"""
QUALITY_STEP = 2**0.25  # of the keys; their module would import OpenGL, whose library the first test chooses
# Two encodings of 255 steps each, one through float16 (`EyeTarget`).
SCREEN_STEPS = 3


@pytest.fixture
def files(tmp_path: Path) -> Path:
    (tmp_path / "rig.toml").write_text(RIG)
    np.save(tmp_path / "body.npy", synthetic_ct(32).data)
    return tmp_path


class Cave(Program):
    """The command in a process of its own."""

    def __init__(self, display: str | None, files: Path, *options: str):  # noqa: F811
        self.display = display
        arguments = [str(files / "rig.toml"), str(files / "body.npy"), *options]
        self._process = subprocess.Popen(
            [sys.executable, "-W", "error", "-m", "persp_sw", "cave", *arguments],
            env=environment(display),
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def until(self, what: Callable[[np.ndarray], bool]) -> np.ndarray:
        """The first picture of both windows, (h, 2 h, 3) uint8, that is so."""
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            assert self._process.poll() is None, self._process.communicate()[1]
            picture = self.grab()[:EDGE, : 2 * EDGE]
            if what(picture):
                return picture
            time.sleep(0.1)
        pytest.fail("the windows never showed it")

    def leave(self) -> str:
        """What it printed, once it has ended, which must be cleanly."""
        out, errors = self._process.communicate(timeout=SECONDS)
        assert self._process.returncode == 0, errors
        assert "Traceback" not in errors
        return out

    def interrupt(self) -> None:
        """What Ctrl-C in its terminal does."""
        self._process.send_signal(signal.SIGINT)


def expected(files: Path, *, mono: bool = False, quality: float = 1.0) -> np.ndarray:
    """What both windows should show, by the software warp and numpy."""
    rig = load_rig(files / "rig.toml")
    scene = psw.Scene.of_file(files / "body.npy")
    renderer = psw.Renderer(scene.volume, scene.transfer, psw.Settings(quality=quality))
    maker = FrameMaker(renderer, rig.walls, room_from_world(rig, scene.volume))
    head = rig.eyes.rest_pose
    modes = {"front": "mono", "side": "mono"} if mono else {}
    frame = maker.make(head, eyes_of_head(head, rig.eyes), modes=modes)
    pictures = {(p.wall.name, p.eye): renderer.warp(p.image, p.view).copy() for p in frame.pictures}
    windows = []
    for wall in ("front", "side"):
        mode = "mono" if mono else {"front": "anaglyph", "side": "left"}[wall]
        eyes = {"mono": ("middle", "middle"), "left": ("left", "left")}.get(mode, ("left", "right"))
        left, right = (pictures[wall, eye] for eye in eyes)
        whole = combine(left, right, mode, size=(EDGE, EDGE), background=scene.background)
        windows.append(psw.images.presented(whole, scene.background))
    return np.hstack(windows)


def is_near(truth: np.ndarray) -> Callable[[np.ndarray], bool]:
    return lambda picture: bool(np.abs(picture.astype(int) - truth).max() <= SCREEN_STEPS)


@pytest.mark.parametrize(
    "options", [(), ("--in-turn",), ("--slabs", "3")], ids=["beside", "in turn", "slabs"]
)
def test_walls_keys_and_a_clean_end(display, files, options):  # noqa: F811
    stereo, mono = expected(files), expected(files, mono=True)
    assert np.abs(stereo.astype(int) - mono).max() > 40
    assert stereo[:, EDGE:].max() > 60  # the side wall shows some of it
    with Cave(display, files, "--no-adapt", *options, "--json") as cave:
        cave.until(is_near(stereo))
        cave.focus("front")
        cave.hand("key", "m")
        cave.until(is_near(mono))
        cave.hand("key", "m")
        cave.until(is_near(stereo))
        cave.hand("keydown", "w")  # the head walks forward
        cave.until(lambda picture: not is_near(stereo)(picture))
        cave.hand("keyup", "w")
        cave.hand("key", "r")  # and back
        cave.until(is_near(stereo))
        cave.hand("key", "Escape")
        said = json.loads(cave.leave())
    assert said["walls"] == ["front", "side"]
    assert said["compositings_per_frame"] == 2
    assert said["ms"] > 0 and said["composite_ms"] > 0 and said["swap_ms"] > 0


def test_at_rest_the_walls_are_refined_to_full_quality_and_keys_hold_it(display, files):  # noqa: F811
    full, held = expected(files, quality=2.0), expected(files, quality=2.0 / QUALITY_STEP**4)
    assert np.abs(full.astype(int) - held).max() > 2 * SCREEN_STEPS
    trace = files / "trace.jsonl"
    with Cave(display, files, "--rate", "50", "--trace", str(trace), "--json") as cave:
        cave.until(is_near(full))
        cave.focus("front")
        for _ in range(4):
            cave.hand("key", "minus")
        cave.until(is_near(held))
        cave.hand("key", "0")
        cave.until(is_near(full))
        cave.hand("key", "Escape")
        cave.leave()
    header, *frames = map(json.loads, trace.read_text().splitlines())
    assert header["max_quality"] == 2.0 and header["target_hz"] == 50.0
    assert all(frame["target_ms"] == 20.0 for frame in frames)
    assert any(frame.get("refined") for frame in frames)
    assert {frame["why"] for frame in frames} >= {"held", "refined"}
    assert max(frame["quality"] for frame in frames) == 2.0


def test_so_many_frames_then_it_ends_by_itself(display, files):  # noqa: F811
    with Cave(display, files, "--frames", "5", "--json") as cave:
        said = json.loads(cave.leave())
    assert said["timed_frames"] == 4


def test_ctrl_c_ends_it_cleanly(display, files):  # noqa: F811
    with Cave(display, files) as cave:
        cave.until(lambda picture: picture.max() > 100)
        cave.interrupt()
        assert "compositings" in cave.leave()
