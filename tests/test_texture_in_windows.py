"""The texture warp in windows' contexts, before and after contexts without a screen in the same program."""

import pytest
from tolerances import TEXTURE_FLOAT32
from virtual_screen import Program, display  # noqa: F401  (a fixture)

# A step of 8 bits. Where the window's pixels are sRGB, which the window system says, they are stored encoded,
# and OpenGL allows 0.6 of a step for that.
STORED = 1 / 255

CODE = """
import json
import numpy as np, glfw
import persp_sw as psw
from persp_sw.warp.context import opengl

rng = np.random.default_rng(2001)
volume = psw.Volume(rng.integers(0, 255, (20, 20, 20)).astype(np.uint8))
view = psw.View.look_at((60, 40, 50), volume.centre, (0, 1, 0), 30, (160, 120))
transfer = psw.TransferFunction([(0, (1, 0.5, 0.2), 0), (255, (0.3, 1, 1), 0.3)], 1.0)
renderer = psw.Renderer(volume, transfer)
image = renderer.composite(view.eye, [view.wall])
truth = renderer.warp(image, view)[..., :3]

def offscreen():
    with psw.OffscreenContext(), psw.TextureWarp() as warp:
        target = psw.Framebuffer(*view.size)
        target.clear()
        warp.upload(image)
        warp.draw_view(view)
        picture = target.read()[..., :3]
        target.close()
    return float(np.abs(picture - truth).max())

def window(api):
    glfw.default_window_hints()
    for hint, value in (
        (glfw.CONTEXT_VERSION_MAJOR, 3), (glfw.CONTEXT_VERSION_MINOR, 3), (glfw.VISIBLE, False),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE), (glfw.CONTEXT_CREATION_API, api),
    ):
        glfw.window_hint(hint, value)
    handle = glfw.create_window(*view.size, "w", None, None)
    glfw.make_context_current(handle)
    gl = opengl()
    gl.glViewport(0, 0, *view.size)
    gl.glClear(gl.GL_COLOR_BUFFER_BIT | gl.GL_DEPTH_BUFFER_BIT)
    with psw.TextureWarp() as warp:
        warp.upload(image)
        warp.draw_view(view, near=1, far=500)
    assert not gl.glIsEnabled(gl.GL_FRAMEBUFFER_SRGB)
    picture = np.empty((*truth.shape[:2], 4), np.float32)
    gl.glReadPixels(0, 0, *view.size, gl.GL_RGBA, gl.GL_FLOAT, picture)
    encoding = gl.glGetFramebufferAttachmentParameteriv(
        gl.GL_FRAMEBUFFER, gl.GL_BACK_LEFT, gl.GL_FRAMEBUFFER_ATTACHMENT_COLOR_ENCODING
    )
    expected = psw.images.srgb(truth) if int(np.ravel(encoding)[0]) == gl.GL_SRGB else truth
    try:
        psw.OffscreenContext().close()
        advice = ""
    except psw.PerspSWError as error:
        advice = str(error)
    glfw.make_context_current(None)
    glfw.destroy_window(handle)
    print(json.dumps([float(np.abs(picture[::-1, :, :3] - expected).max()), advice]), flush=True)

assert glfw.init()
order = ORDER
for kind in order:
    if kind == "offscreen":
        print(json.dumps([offscreen(), ""]), flush=True)
    else:
        window(glfw.NATIVE_CONTEXT_API if kind == "glx" else glfw.EGL_CONTEXT_API)
glfw.terminate()
"""


@pytest.mark.gl
@pytest.mark.parametrize(
    "order", [("glx", "offscreen", "egl", "glx"), ("offscreen", "egl", "offscreen", "glx")]
)
@pytest.mark.parametrize("platform", ["", "egl"])
def test_it_draws_in_every_context(display, order, platform):  # noqa: F811
    """GLX and EGL windows and no window at all, whatever window system PyOpenGL was bound to."""
    more = {"PYOPENGL_PLATFORM": platform} if platform else {}
    with Program(display, CODE.replace("ORDER", repr(order)), **more) as program:
        for kind in order:
            error, advice = program.value()
            assert error < (TEXTURE_FLOAT32 if kind == "offscreen" else STORED)
            assert ("release the window's context" in advice) == (kind == "glx")
        code, words = program.end()
        assert code == 0, words
