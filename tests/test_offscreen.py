"""Contexts without a screen, and what is said where there are none."""

import os
import subprocess
import sys

import numpy as np
import pytest
from samples import ROOT, ball, fails, result_of, run
from tolerances import TEXTURE_FLOAT32

from persp_sw import Eye, Framebuffer, OffscreenContext, Renderer, TextureWarp, View, Volume, Wall
from persp_sw.commands import warps
from persp_sw.commands.warps import WarpChoice
from persp_sw.errors import GraphicsError, MissingPackageError, ViewError
from persp_sw.warp import context as context_module
from persp_sw.warp.context import opengl


@pytest.fixture
def no_pyopengl(monkeypatch):
    """As if PyOpenGL were not installed."""
    opengl.cache_clear()
    for name in [name for name in sys.modules if name.split(".")[0] == "OpenGL"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "OpenGL", None)
    yield
    opengl.cache_clear()


def python(code):
    """What a Python of its own prints, where there is no screen."""
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "PYOPENGL_PLATFORM", "XDG_SESSION_TYPE")
    environment = {name: value for name, value in os.environ.items() if name not in screens}
    environment["PYTHONPATH"] = str(ROOT)
    command = [sys.executable, "-c", f"import os, sys; {code}"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def current():
    return context_module._current(context_module._load_egl())


@pytest.mark.gl
def test_a_closed_context_leaves_the_one_before_current(gl_context):
    before = current()
    assert before[3]
    with OffscreenContext() as other:
        assert current()[3] not in (None, before[3])
        gl_context.make_current()
        other.make_current()
    assert current() == before
    other.close()
    with pytest.raises(GraphicsError, match="closed"):
        other.make_current()


@pytest.mark.gl
def test_a_context_released_or_closed_elsewhere_is_no_ones(gl_context):
    first, second = OffscreenContext(), OffscreenContext()
    assert current()[3] == second._context
    first.close()
    assert current()[3] == second._context
    second.release()
    assert current()[3] is None
    second.close()
    assert current()[3] is None
    gl_context.make_current()


@pytest.mark.gl
def test_a_device_that_is_not_there_is_named(gl_context):
    with pytest.raises(GraphicsError, match="graphics device 15"):
        OffscreenContext(device=15)


@pytest.mark.gl
@pytest.mark.parametrize("kind, step", [("float32", 0), ("float16", 2**-11), ("rgba8", 0.51 / 255)])
def test_a_framebuffer_keeps_what_is_put_in(gl_context, kind, step):
    target = Framebuffer(5, 3, kind)
    target.clear((0.1, 0.7, 0.33, 0.9))
    picture = target.read()
    assert picture.shape == (3, 5, 4) and picture.dtype == np.float32
    assert np.abs(picture - np.float32([0.1, 0.7, 0.33, 0.9])).max() <= step
    target.close()


@pytest.mark.gl
def test_row_0_of_what_is_read_is_on_top(gl_context):
    gl = opengl()
    target = Framebuffer(4, 6)
    target.clear()
    gl.glEnable(gl.GL_SCISSOR_TEST)
    gl.glScissor(0, 4, 1, 2)  # OpenGL counts from below
    gl.glClearBufferfv(gl.GL_COLOR, 0, np.ones(4, np.float32))
    gl.glDisable(gl.GL_SCISSOR_TEST)
    picture = target.read()[..., 0]
    assert (picture[:2, 0] == 1).all() and picture.sum() == 2
    target.close()


def test_without_pyopengl_it_says_what_to_install(no_pyopengl, scene_file, tmp_path):
    for made in (
        OffscreenContext,
        lambda: Framebuffer(4, 4),
        lambda: TextureWarp().draw_picture(np.zeros((2, 2, 4), "f4")),
    ):
        with pytest.raises(MissingPackageError, match=r"persp-sw\[view\]"):
            made()
    assert "persp-sw[view]" in fails("render", scene_file, "-o", tmp_path / "a.png", "--warp", "texture")
    assert result_of("render", scene_file, "-o", tmp_path / "a.png")["warp"] == "software"


def test_importing_the_package_imports_no_opengl(tmp_path):
    assert python("import persp_sw; persp_sw.TextureWarp(); print('OpenGL' in sys.modules)") == "False"


@pytest.mark.gl
def test_without_a_screen_pyopengl_uses_egl_and_child_processes_choose_for_themselves(gl_context):
    code = "from persp_sw.warp.context import opengl; opengl(); import OpenGL.platform as p; "
    code += "print(type(p.PLATFORM).__name__, 'PYOPENGL_PLATFORM' in os.environ)"
    assert python(code) == "EGLPlatform False"


@pytest.mark.gl
def test_both_warps_write_the_same_picture(gl_context, scene_file, tmp_path):
    pictures = {}
    for name in ("texture", "software"):
        out = tmp_path / f"{name}.npy"
        result = result_of("render", scene_file, "-o", out, "--warp", name)
        assert result["warp"] == name and result["warp_ms"] > 0
        pictures[name] = np.load(out)
    assert pictures["software"][..., 3].max() > 0.5
    assert np.abs(pictures["texture"] - pictures["software"]).max() < TEXTURE_FLOAT32
    assert "texture warp" in run("render", scene_file, "-o", out, "--warp", "texture").stdout
    assert "warp" in fails("render", scene_file, "--warp", "paper")


@pytest.mark.gl
def test_the_processor_is_no_graphics_card(gl_context, scene_file, tmp_path):
    """Here OpenGL is drawn by the processor, or by a card; auto takes software in the one case."""
    used = result_of("render", scene_file, "-o", tmp_path / "a.png")["warp"]
    assert used == "software" or not gl_context.is_software


class Card:
    """A stand-in for OpenGL on a graphics card, with a clock: it takes `cost`, the processor 10."""

    is_software = False

    def __init__(self, renderer, cost):
        self.context, self.cost, self.time, self.drawn, self.closed = self, cost, 0.0, 0, False
        self.warp, renderer.warp = renderer.warp, self.warp_slowly

    def warp_slowly(self, *arguments):
        self.time += 10
        return self.warp(*arguments)

    def draw(self, image, view):
        self.drawn += 1
        self.time += self.cost
        return "the card's"

    def close(self):
        self.closed = True


@pytest.mark.parametrize("cost, chosen", [(11, "software"), (9, "texture")])
def test_auto_takes_the_faster_on_a_card(monkeypatch, cost, chosen):
    view = View.look_at((60, 40, 50), (11, 11, 11), (0, 1, 0), 30, (128, 96))
    renderer = Renderer(Volume(ball()))
    card = Card(renderer, cost)
    monkeypatch.setattr(warps, "_Offscreen", lambda size: card)
    monkeypatch.setattr(warps, "perf_counter", lambda: card.time)
    with WarpChoice(renderer, "auto", view.size) as choice:
        pictures = [choice.render(view), choice.render(view)]
        assert choice.name == chosen
        assert card.drawn == (4 if chosen == "software" else 6)  # four to choose
        assert all(isinstance(picture, str) == (chosen == "texture") for picture in pictures)
        assert choice.last["warp_ms"] == 9000 or chosen == "software"
        assert not card.closed
    assert card.closed


def test_a_views_matrix_puts_the_walls_corners_at_the_windows(rng):
    """(±1, ±1), with depths −1 and 1 on the near and far plane, from a point and from infinity."""
    for _ in range(20):
        corners = rng.normal(size=(3, 3))
        wall = Wall(*corners, pixels=(64, 48))
        eye = rng.normal(size=3) * 3
        others = [*corners, corners[1] + corners[2] - corners[0]]
        expected = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        for view, forward in (
            (View.through_wall(eye, wall), normal * np.sign(normal @ (corners[0] - eye))),
            (View.through_wall(Eye.at_infinity(eye), wall), -eye / np.linalg.norm(eye)),
        ):
            at_infinity = view.eye.is_at_infinity
            clip = view.clip_from_world(0.2, 7.5)
            points = clip @ np.column_stack([others, np.ones(4)]).T
            assert (points[3] > 0).all()
            np.testing.assert_allclose((points[:2] / points[3]).T, expected, atol=1e-8)
            origin = corners[0] if at_infinity else eye
            for distance, depth in ((0.2, -1), (7.5, 1)):
                z, w = (clip @ np.append(origin + distance * forward, 1))[2:]
                assert abs(z / w - depth) < 1e-9
            for near, far in ((1, 1), (2, 1), (np.nan, 1), *([] if at_infinity else [(0, 1), (-1, 1)])):
                with pytest.raises(ViewError):
                    view.clip_from_world(near, far)
