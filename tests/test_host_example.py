"""The example as people run it: without a screen, and in a window of pyglet's with mouse and keys."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest
from samples import ROOT, ball
from tolerances import HOST_PICTURE_HALF
from virtual_screen import SECONDS, Program, display  # noqa: F401

from persp_sw import Renderer, Scene
from vr_plugin.host_view import seen_in_world

_TITLE = "A volume in a moderngl-window program"
_CODE = """
import sys
import warnings

warnings.simplefilter("ignore")  # moderngl-window imports PyGLM by its old name
from vr_plugin.examples.moderngl_host import main

sys.exit(main([{path!r}, "--size", "320", "240"]))
"""


def shown_by(program: Program, before: np.ndarray | None = None) -> np.ndarray:
    """The window, once it shows the scene, and another picture than before."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        picture = program.grab()[:240, :320].astype(int)
        if picture.std() > 20 and (before is None or np.abs(picture - before).mean() > 2):
            return picture
        time.sleep(0.05)
    pytest.fail("the window shows nothing new")


@pytest.mark.gl
def test_the_example_in_a_window(display, tmp_path):  # noqa: F811
    np.save(tmp_path / "ball.npy", ball())
    with Program(display, _CODE.format(path=str(tmp_path / "ball.npy"))) as program:
        program.focus(_TITLE)
        program.hand("mousemove", 300, 20)
        first = shown_by(program)
        red = (first[..., 0] > 2 * first[..., 2]) & (first[..., 0] > 60)
        teal = first[..., 2] > 1.8 * first[..., 0] + 20
        assert red.sum() > 300 and teal.sum() > 300  # ball and cube
        program.hand("mousemove", 100, 100, "mousedown", 1)
        for step in range(1, 6):
            program.hand("mousemove", 100 + 15 * step, 100)
        program.hand("mouseup", 1)
        shown_by(program, first)
        program.hand("key", "Escape")
        code, words = program.end()
        assert code == 0, words


@pytest.mark.gl
def test_the_examples_picture_in_a_process_of_its_own(tmp_path, gl_context):
    """What the cube hides is the cube's, what the volume covers of the rest is (1 − α)·scene + volume."""
    gl_context.release()
    np.save(tmp_path / "ball.npy", np.maximum(ball(), 60))  # something in the corners, too
    shown, nothing = tmp_path / "shown.json", tmp_path / "nothing.json"
    for path, opacity in ((shown, 0.3), (nothing, 0)):
        points = [[20, 1, 0.6, 0.2, 0], [200, 0.2, 1, 1, opacity]]
        path.write_text(json.dumps({"volume": "ball.npy", "tf": points}))
    size = (240, 180)
    pictures = [run_example(path, size) for path in (shown, nothing)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # moderngl-window imports PyGLM by its old name
        from vr_plugin.examples import moderngl_host as example
    scene = Scene.load(shown)
    volume = scene.volume
    ((view, viewport),) = example.views_of_camera(*example.START, size)
    assert viewport == (0, 0, *size)
    truth = Renderer(volume, scene.transfer).render(seen_in_world(view, example.standing(volume), volume))
    drawn, around = pictures
    through = truth + (1 - truth[..., 3:]) * around
    shows = truth[..., 3] > 0.1
    behind = shows & (np.abs(drawn - through).max(-1) < HOST_PICTURE_HALF)
    before = shows & (np.abs(drawn - around).max(-1) < HOST_PICTURE_HALF)
    assert behind.sum() > 3000 and before.sum() > 300
    # What is left are pixels on the edge of an object in front, of which it covers a part.
    rest = shows & ~behind & ~before
    shifted = [np.roll(around[..., :3], (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    edges = (np.max(shifted, 0) - np.min(shifted, 0)).max(-1) > 0.01
    assert rest.sum() < 0.06 * shows.sum() and not (rest & ~edges).any()
    red = around[..., 0] > 4 * around[..., 2]
    assert (behind & red).sum() > 300  # the ball behind, through the volume
    teal = around[..., 2] > 3 * around[..., 0]
    assert (before & teal).sum() > 300  # the cube in front


def run_example(path, size):
    output = path.with_suffix(".out.npy")
    command = [sys.executable, "-m", "vr_plugin.examples.moderngl_host", "--offscreen", "-o", str(output)]
    done = subprocess.run(
        [*command, "--size", *map(str, size), str(path)],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert f"{0 if 'nothing' in path.name else 1} compositings" in done.stdout
    return np.load(output)
