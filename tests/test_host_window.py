"""The example as people run it: in a window of pyglet's, with mouse and keys."""

from __future__ import annotations

import time

import numpy as np
import pytest
from samples import ball
from virtual_screen import SECONDS, Program, display  # noqa: F401

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
