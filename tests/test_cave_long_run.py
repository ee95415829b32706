"""Laps of the cave's frame loop in real windows: OpenGL must hold as much after each of them."""

import pytest
from virtual_screen import Program, display  # noqa: F401  (a fixture)

from persp_sw.warp.gl_census import growth

CODE = """
import numpy as np
from dataclasses import replace
import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct
from persp_sw.warp.gl_census import census
from rigs import rig_of, wall_keys
from vr_plugin.cave.windows import WindowLoop
from vr_plugin.loop import Loop
from vr_plugin.shown import InTurn
from vr_plugin.stereo import Stereo
from window_program import say

LAP, LAPS = LAP_AND_LAPS
MODES = ("anaglyph", "left", "interlaced", "mono", "side_by_side", "quad", "top_bottom", "right")

walls = [
    wall_keys(window={"position": [0, 0], "size": [64, 64]}, stereo="anaglyph"),
    wall_keys("side", lower_left=[1, 0.7, -2], lower_right=[1, 0.7, 0], upper_left=[1, 2.7, -2],
              window={"position": [200, 0], "size": [64, 64]}, stereo="left"),
]
rig = rig_of(*walls, quality={"target_hz": 240})
renderer = psw.Renderer(synthetic_ct(24))
loop = Loop(rig, renderer)
placed = loop.maker.room_from_world.copy()


class Changing(WindowLoop):
    def _show(self, windows, walls, warp):
        number = self.frames % LAP
        rng = np.random.default_rng(number)
        self.loop.stereo = {w.name: Stereo(MODES[rng.integers(len(MODES))]) for w in self.loop.rig.walls}
        moved = placed.copy()  # about the head and around it: one face to five
        moved[:3, 3] += rng.uniform(-1.5, 1.5, 3)
        self.loop.maker.room_from_world = moved
        renderer.settings = psw.Settings(
            quality=float(rng.choice([0.3, 1, 3])), depth_slabs=int(rng.choice([0, 1, 3]))
        )
        if number % 10 == 0:
            for wall in walls:
                wall.window.resize(*(int(n) for n in rng.integers(40, 160, 2)))
        super()._show(windows, walls, warp)
        faces.update(len(image.faces) for image in self._uploaded.images.values())
        if self.frames % LAP == 0:
            held = []
            for wall in walls:
                wall.window.make_current()
                held.append(census())
            say(held)


faces = set()
LEAK
shown = Changing(loop, InTurn(loop, 1 / 240))
with shown.source:
    shown.run(LAP * LAPS)
say([shown.frames, sorted(faces)])
"""
LEAKS = {
    "nothing": "",
    "textures": "from persp_sw.warp.gl_objects import Texture; Texture.delete = lambda self: None",
    "vertex arrays": "from OpenGL import GL; GL.glDeleteVertexArrays = lambda count, names: None",
    "programs": """
from vr_plugin.present import Composer
used = Composer._use
def use(self, *options):
    self._programs.clear()
    return used(self, *options)
Composer._use = use
""",
}


@pytest.mark.gl
@pytest.mark.parametrize("leak", LEAKS)
def test_windows_hold_no_more_after_each_lap(display, leak):  # noqa: F811
    lap, laps = (100, 3) if leak == "nothing" else (20, 2)
    code = CODE.replace("LAP_AND_LAPS", f"{lap}, {laps}").replace("LEAK", LEAKS[leak])
    with Program(display, code) as program:
        first, *_, last = (program.value() for _ in range(laps))
        frames, faces = program.value()
        assert program.end()[0] == 0
    assert frames == lap * laps
    assert len(faces) > 2 or leak != "nothing"
    grown = [growth(before, after) for before, after in zip(first, last, strict=True)]
    assert all(grown) if leak != "nothing" else not any(grown), (first, last)
