"""What OpenGL composes and draws, against the same in numpy, and the context's state after it."""

from __future__ import annotations

import logging
from functools import partial

import numpy as np
import pytest
from own_context import framebuffer, gl, read_floats  # noqa: F401  (a fixture)
from tolerances import BYTE, COMPOSED, COMPOSED_HALF, ON_ITS_WALL

import persp_sw as psw
from persp_sw.errors import GraphicsError
from vr_plugin.projection import clip_from_view_space
from vr_plugin.stereo import MODES, StereoError, combine, eye_size

pytestmark = [pytest.mark.gl, pytest.mark.usefixtures("gl")]

BACKGROUND = (0.25, 0.5, 0.125)
COMBINED = [mode for mode in MODES if mode not in ("quad", "two_windows")]
NUMBERS = (
    "ACTIVE_TEXTURE", "ARRAY_BUFFER_BINDING", "BLEND_DST_ALPHA", "BLEND_DST_RGB",
    "BLEND_EQUATION_ALPHA", "BLEND_EQUATION_RGB", "BLEND_SRC_ALPHA", "BLEND_SRC_RGB",
    "COLOR_CLEAR_VALUE", "COLOR_WRITEMASK", "CURRENT_PROGRAM", "CULL_FACE_MODE", "DEPTH_CLEAR_VALUE",
    "DEPTH_FUNC", "DEPTH_RANGE", "DEPTH_WRITEMASK", "DRAW_BUFFER", "DRAW_FRAMEBUFFER_BINDING",
    "ELEMENT_ARRAY_BUFFER_BINDING", "FRONT_FACE", "LINE_WIDTH", "PACK_ALIGNMENT", "PACK_ROW_LENGTH",
    "PACK_SKIP_PIXELS", "PACK_SKIP_ROWS", "PIXEL_PACK_BUFFER_BINDING", "PIXEL_UNPACK_BUFFER_BINDING",
    "POLYGON_MODE", "POLYGON_OFFSET_FACTOR", "POLYGON_OFFSET_UNITS", "READ_BUFFER",
    "READ_FRAMEBUFFER_BINDING", "RENDERBUFFER_BINDING", "SCISSOR_BOX", "STENCIL_WRITEMASK",
    "UNPACK_ALIGNMENT", "UNPACK_ROW_LENGTH", "UNPACK_SKIP_PIXELS", "UNPACK_SKIP_ROWS",
    "VERTEX_ARRAY_BINDING", "VIEWPORT",
)  # fmt: skip
FLAGS = (
    "BLEND", "COLOR_LOGIC_OP", "CULL_FACE", "DEPTH_CLAMP", "DEPTH_TEST", "DITHER", "FRAMEBUFFER_SRGB",
    "MULTISAMPLE", "POLYGON_OFFSET_FILL", "PRIMITIVE_RESTART", "RASTERIZER_DISCARD",
    "SAMPLE_ALPHA_TO_COVERAGE", "SCISSOR_TEST", "STENCIL_TEST",
)  # fmt: skip
WHOLE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def pictures(rng: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
    """Two premultiplied pictures of random pixels."""
    both = rng.random((2, size[1], size[0], 4)).astype(np.float32)
    both[..., :3] *= both[..., 3:]
    return both


def targets(both: np.ndarray, precision: str = "float32") -> list:
    from vr_plugin.screen.eye_target import EyeTarget

    made = [EyeTarget(both.shape[2:0:-1], precision) for _ in both]
    for target, picture in zip(made, both, strict=True):
        target.upload(picture)
    return made


def floats(size: tuple[int, int], attachments: int = 1) -> int:
    from OpenGL import GL

    return framebuffer(size, GL.GL_RGBA32F, attachments)


def window_bytes(size: tuple[int, int]) -> int:
    from OpenGL import GL

    return framebuffer(size, GL.GL_RGBA8)


# --- stereo modes ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", COMBINED)
@pytest.mark.parametrize(("size", "first_row"), [((64, 48), 0), ((64, 48), 1), ((37, 29), 1081)])
def test_a_mode_is_the_split_pair(mode, size, first_row, rng):
    from vr_plugin.present import Composer

    both = pictures(rng, eye_size(mode, size))
    floats(size)
    Composer().compose(*targets(both), mode, size, background=BACKGROUND, first_row=first_row, encode=False)
    expected = combine(*both, mode, size, background=BACKGROUND, first_row=first_row)
    np.testing.assert_allclose(read_floats(size), expected, rtol=0, atol=COMPOSED)


@pytest.mark.parametrize("mode", COMBINED)
def test_half_precision_is_close(mode, rng):
    from vr_plugin.present import Composer

    size = (64, 48)
    both = pictures(rng, eye_size(mode, size))
    floats(size)
    Composer().compose(*targets(both, "float16"), mode, size, background=BACKGROUND, encode=False)
    expected = combine(*both, mode, size, background=BACKGROUND)
    np.testing.assert_allclose(read_floats(size), expected, rtol=0, atol=COMPOSED_HALF)


@pytest.mark.parametrize("mode", COMBINED)
@pytest.mark.parametrize("size", [(64, 48), (37, 29)])
def test_the_screen_gets_srgb_bytes(mode, size, rng):
    from vr_plugin.present import Composer, read_screen

    both = pictures(rng, eye_size(mode, size))
    window_bytes(size)
    Composer().compose(*targets(both), mode, size, background=BACKGROUND)
    shown = read_screen(size).astype(int)
    expected = psw.images.presented(combine(*both, mode, size, background=BACKGROUND)).astype(int)
    assert np.abs(shown - expected).max() <= BYTE
    assert (shown == expected).mean() > 0.98  # and that only half way between two


def test_pictures_of_another_size_are_stretched(rng):
    from vr_plugin.present import Composer

    flat = np.empty((2, 7, 5, 4), np.float32)
    flat[0], flat[1] = (0.5, 0, 0, 0.75), (0, 0, 1, 1)
    size = (40, 30)
    floats(size)
    Composer().compose(*targets(flat), "side_by_side", size, background=BACKGROUND, encode=False)
    large = flat[:, :1, :1].repeat(30, 1).repeat(20, 2)
    expected = combine(*large, "side_by_side", size, background=BACKGROUND)
    np.testing.assert_allclose(read_floats(size), expected, rtol=0, atol=COMPOSED)


def test_quad_fills_two_buffers(rng, monkeypatch):
    """Mesa has no quad-buffered screens: two attachments stand for the left and the right buffer."""
    from OpenGL import GL

    from vr_plugin.present import Composer

    size = (32, 24)
    both = pictures(rng, size)
    composer, pair = Composer(), targets(both)
    monkeypatch.setattr(composer, "has_quad_buffers", lambda: True)
    monkeypatch.setattr(composer, "_quad_buffers", (GL.GL_COLOR_ATTACHMENT0, GL.GL_COLOR_ATTACHMENT1))
    floats(size, attachments=2)
    composer.compose(*pair, "quad", size, background=BACKGROUND, encode=False)
    for attachment, picture in enumerate(both):
        expected = combine(picture, picture, "mono", background=BACKGROUND)
        np.testing.assert_allclose(read_floats(size, attachment), expected, rtol=0, atol=COMPOSED)
    assert GL.glGetIntegerv(GL.GL_DRAW_BUFFER) == GL.GL_COLOR_ATTACHMENT0


def test_without_quad_buffers_mono_is_shown_and_said_once(rng, caplog):
    from vr_plugin import present

    present._say_without_quad_buffers.cache_clear()
    size = (32, 24)
    both = pictures(rng, size)
    floats(size)
    with caplog.at_level(logging.WARNING, "persp_sw"):
        for _ in range(2):
            composer = present.Composer()
            assert composer.possible_mode("quad") == "mono"
            composer.compose(*targets(both), "quad", size, encode=False)
    np.testing.assert_allclose(read_floats(size), combine(*both, "mono"), rtol=0, atol=COMPOSED)
    assert len(caplog.records) == 1
    assert "showing mono instead" in caplog.text and "choose another stereo mode" in caplog.text
    assert composer.possible_mode("anaglyph") == "anaglyph"


def test_two_windows_are_composed_one_by_one(rng):
    from vr_plugin.present import Composer

    pair = targets(pictures(rng, (8, 8)))
    with pytest.raises(StereoError, match="modes left and right"):
        Composer().compose(*pair, "two_windows", (8, 8))
    with pytest.raises(StereoError, match="choose one of"):
        Composer().compose(*pair, "shutter", (8, 8))


# --- eye targets -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("precision", ["float16", "float32", "srgb8"])
def test_light_adds_up_before_it_is_encoded(precision):
    """0.25 with opacity 0.5 over 0.5 is 0.5, which is 188 of 255; blended as bytes it would be 128."""
    from vr_plugin.present import Composer, read_screen
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes

    target, shapes = EyeTarget((8, 8), precision), Shapes()
    with target.drawing():
        shapes.polygon(np.eye(4), WHOLE, (0.5, 0.5, 0.5), hidden=False)
        shapes.polygon(np.eye(4), WHOLE, (0.5, 0.5, 0.5, 0.5), hidden=False)
    window_bytes((8, 8))
    Composer().compose(target, target, "mono", (8, 8))
    allowed = BYTE if precision == "srgb8" else 0  # it has bytes itself
    assert np.abs(read_screen((8, 8)).astype(int) - 188).max() <= allowed
    with target.drawing():
        shapes.polygon(np.eye(4), WHOLE, (0.5, 0.5, 0.5, 0.5), hidden=False)
    Composer().compose(target, target, "mono", (8, 8), background=(0.5, 0.5, 0.5))
    assert np.abs(read_screen((8, 8)).astype(int) - 188).max() <= allowed


@pytest.mark.parametrize(("precision", "tolerance"), [("float16", 2**-12), ("float32", 0.0)])
def test_pictures_go_in_and_out_upright(precision, tolerance, rng):
    picture = pictures(rng, (13, 7))
    for target, expected in zip(targets(picture, precision), picture, strict=True):
        np.testing.assert_allclose(target.read(), expected, rtol=0, atol=tolerance)


def test_an_srgb_target_is_read_as_light():
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes

    target = EyeTarget((4, 4), "srgb8")
    with target.drawing():
        Shapes().polygon(np.eye(4), WHOLE, (0.5, 0.002, 1.0), hidden=False)
    # A step of 255 near 0.5 is 0.0071 of light; near 0.002 it is 1 / (255 · 12.92).
    error = np.abs(target.read()[0, 0] - (0.5, 0.002, 1, 1))
    assert (error <= (0.0072, 0.0003, 1e-6, 1e-6)).all()
    with pytest.raises(GraphicsError, match="float16 or float32"):
        target.upload(np.zeros((4, 4, 4), np.float32))


def test_a_target_begins_empty_and_far():
    from OpenGL import GL

    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes

    target, shapes = EyeTarget((6, 6)), Shapes()
    far = np.array(WHOLE, float) + (0, 0, 0.9)
    for _ in range(2):  # the second time, too
        with target.drawing():
            assert (np.asarray(GL.glReadPixels(0, 0, 6, 6, GL.GL_RGBA, GL.GL_FLOAT)) == 0).all()
            shapes.polygon(np.eye(4), far, (0, 1, 0))
        np.testing.assert_array_equal(target.read(), np.broadcast_to([0, 1, 0, 1], (6, 6, 4)))
    with target.drawing(clear=False):
        pass
    assert (target.read()[..., 1] == 1).all()


def test_a_target_takes_another_size(rng):
    target = targets(pictures(rng, (8, 8)))[0]
    before = target.texture
    target.resize((8, 8))
    assert target.texture == before
    target.resize((20, 10))
    assert target.size == (20, 10)
    assert target.read().shape == (10, 20, 4)


def test_targets_refuse_what_cannot_be():
    from vr_plugin.screen.eye_target import EyeTarget

    with pytest.raises(GraphicsError, match="choose one of float16, float32, srgb8"):
        EyeTarget((8, 8), "rgba4")
    with pytest.raises(GraphicsError, match="at least one pixel"):
        EyeTarget((8, 0))
    with pytest.raises(GraphicsError, match="pixels a side at most"):
        EyeTarget((1 << 20, 8))
    with pytest.raises(GraphicsError, match=r"\(h, w\) = \(8, 8\)"):
        EyeTarget((8, 8)).upload(np.zeros((8, 9, 4), np.float32))


def test_a_bad_shader_is_told_in_the_drivers_words():
    from vr_plugin.screen.gl_objects import Program

    with pytest.raises(GraphicsError, match=r"does not compile: .*nonsense"):
        Program("void main() { nonsense; }", "void main() {}")


# --- shapes ------------------------------------------------------------------------------------------------


def drawn(size: tuple[int, int], draw) -> np.ndarray:
    """What `draw(shapes)` draws into a target of floats."""
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes

    target, shapes = EyeTarget(size, "float32"), Shapes()
    with target.drawing():
        draw(shapes)
    return target.read()


def test_a_line_covers_its_width():
    from vr_plugin.screen.shapes import clip_from_pixels

    size = (20, 12)
    segments = [[(4, 5, 0), (16, 5, 0)]]
    shown = drawn(size, lambda shapes: shapes.lines(clip_from_pixels(size), segments, (1, 0.5, 0.25), 2))
    np.testing.assert_allclose(shown[4:6, 4:16], np.broadcast_to([1, 0.5, 0.25, 1], (2, 12, 4)), atol=1e-5)
    assert shown[:3].max() < 1e-5 and shown[7:].max() < 1e-5
    assert shown[4, 2, 3] == 0 and shown[4, 17, 3] == 0  # a half width beyond its ends, no more


def test_a_slanted_line_has_smooth_edges_and_the_right_weight():
    from vr_plugin.screen.shapes import clip_from_pixels

    size = (100, 100)
    segments = [[(10, 20, 0), (90, 70, 0)]]
    shown = drawn(size, lambda shapes: shapes.lines(clip_from_pixels(size), segments, (1, 1, 1), 3))
    length = np.hypot(80, 50) + 3
    assert shown[..., 3].sum() == pytest.approx(3 * length, rel=0.02)
    assert len(np.unique(shown[..., 3].round(3))) > 10


def test_a_line_ends_at_the_near_plane():
    """From before the eye to behind it: only the points before it are seen, where they project."""
    wall = psw.Wall((-1, -1, -1), (1, -1, -1), (-1, 1, -1), (80, 80))
    eye = np.zeros(3)
    projection, view = clip_from_view_space(eye, wall, 0.1, 100)
    a, b = np.array([-0.5, 0.2, -2.0]), np.array([0.4, 0.3, 3.0])
    shown = drawn((80, 80), lambda shapes: shapes.lines(projection @ view, [[a, b]], (1, 1, 1), 3))
    points = a + np.linspace(0, 1, 4000)[:, None] * (b - a)
    seen = points[points[:, 2] < -0.1]
    column, row = psw.View.through_wall(eye, wall).project(seen).T
    inside = (column >= 0) & (column < 80) & (row >= 0) & (row < 80)
    hit = np.zeros((80, 80), bool)
    hit[row[inside].astype(int), column[inside].astype(int)] = True
    assert hit.sum() > 20
    assert shown[hit, 3].min() > 0.5
    lit = np.argwhere(shown[..., 3] > 0.01)
    distance = np.abs(lit[:, None] - np.argwhere(hit)[None]).max(-1).min(1)
    assert distance.max() <= 3  # and nothing elsewhere
    behind = [[(0.1, 0.1, 1.0), (0.5, 0.2, 5.0)]]
    shown = drawn((80, 80), lambda shapes: shapes.lines(projection @ view, behind, (1, 1, 1), 3))
    assert shown.max() == 0


def test_what_is_nearer_hides():
    near, far = (np.array(WHOLE, float) + (0, 0, z) for z in (-0.5, 0.5))

    def draw(shapes):
        shapes.polygon(np.eye(4), near, (1, 0, 0))
        shapes.polygon(np.eye(4), far, (0, 1, 0))
        shapes.lines(np.eye(4), [[(-1, 0, 0.2), (1, 0, 0.2)]], (0, 0, 1), 2)

    assert (drawn((9, 9), draw) == [1, 0, 0, 1]).all()

    def in_front(shapes):
        draw(shapes)
        shapes.polygon(np.eye(4), far, (0, 0, 1), hidden=False)

    assert (drawn((9, 9), in_front) == [0, 0, 1, 1]).all()


def test_an_outline_lies_before_its_face_however_slanted(rng):
    wall = psw.Wall((-2, -1, -4), (2, -1, -4), (-2, 2, -4), (120, 90))
    for _ in range(10):
        eye = np.array([rng.uniform(-3, 3), rng.uniform(-2, 2), rng.uniform(0, 2)])
        projection, view = clip_from_view_space(eye, wall, 0.05, 60)
        a, b = rng.normal(size=(2, 3)) * 0.7
        corners = np.array([-a - b, a - b, a + b, b - a]) + (0, 0.3, -4.5)
        edges = [[corners[i], corners[(i + 1) % 4]] for i in range(4)]

        def draw(shapes, face, clip_from_room=projection @ view, corners=corners, edges=edges):
            if face:
                shapes.polygon(clip_from_room, corners, (0, 0, 0))
            shapes.lines(clip_from_room, edges, (1, 1, 1), 2)

        alone, both = (drawn((120, 90), partial(draw, face=face))[..., 0] for face in (False, True))
        assert alone.max() == 1
        np.testing.assert_allclose(both, alone, atol=1e-6)


def test_a_picture_on_its_own_wall_is_seen_as_it_is(rng):
    size = (48, 36)
    picture = pictures(rng, size)[:1]
    wall = psw.Wall((-1.3, 0.1, -1), (0.9, 0.4, -1.7), (-1.2, 1.9, -1.2), size)
    projection, view = clip_from_view_space(np.array([0.2, 1.1, 0.6]), wall, 0.05, 50)
    corner = wall.lower_right + wall.upper_left - wall.lower_left
    corners = [wall.lower_left, wall.lower_right, corner, wall.upper_left]
    texture = targets(picture)[0].texture
    shown = drawn(size, lambda shapes: shapes.picture(projection @ view, corners, texture))
    np.testing.assert_allclose(shown, picture[0], rtol=0, atol=ON_ITS_WALL)
    over = drawn(
        size, lambda s: s.picture(projection @ view, corners, texture, background=BACKGROUND, opacity=0.5)
    )
    expected = 0.5 * combine(picture[0], picture[0], "mono", background=BACKGROUND)
    np.testing.assert_allclose(over, expected, rtol=0, atol=ON_ITS_WALL)


def test_mipmaps_keep_the_mean_of_what_is_seen_small():
    picture = np.ones((1, 64, 64, 4), np.float32)
    picture[0, ..., :3] = 0
    picture[0, :, ::8, :3] = 1  # without smaller copies 8 × 8 pixels see what is between these columns
    target = targets(picture)[0]
    target.make_mipmaps()
    shown = drawn((8, 8), lambda shapes: shapes.picture(np.eye(4), WHOLE, target.texture, mipmaps=True))
    np.testing.assert_allclose(shown[..., :3], 1 / 8, atol=1e-3)


def test_nothing_to_draw_is_no_error():
    shown = drawn((4, 4), lambda shapes: shapes.lines(np.eye(4), np.empty((0, 2, 3)), (1, 1, 1)))
    assert shown.max() == 0

    def into_nothing(shapes):  # as of an iconified window
        from OpenGL import GL

        GL.glViewport(0, 0, 0, 0)
        shapes.lines(np.eye(4), [[(-1, 0, 0), (1, 0, 0)]], (1, 1, 1))

    assert drawn((4, 4), into_nothing).max() == 0


# --- text --------------------------------------------------------------------------------------------------


def test_text_shows_and_is_made_anew_only_when_it_changes():
    from vr_plugin.present import Composer, read_screen
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.lettering import text_panel
    from vr_plugin.screen.shapes import Shapes
    from vr_plugin.screen.text_overlay import Overlay

    size = (240, 120)
    target, overlay, composer = EyeTarget(size), Overlay(Shapes()), Composer()
    window_bytes(size)

    def shown(text: str, corner: str = "upper left") -> np.ndarray:
        with target.drawing():
            overlay.draw(text, size, corner)
        composer.compose(target, target, "mono", size, background=BACKGROUND)
        return read_screen(size)

    empty = shown("")
    assert (empty == empty[0, 0]).all() and overlay.redrawn == 0
    first = shown("60.0 Hz\nwarp 3 ms")
    panel = text_panel("60.0 Hz\nwarp 3 ms")
    high, wide = panel.shape[:2]
    expected = psw.images.presented(panel, BACKGROUND).astype(int)
    there = first[8 : 8 + high, 8 : 8 + wide].astype(int)
    assert np.abs(there - expected).max() <= BYTE
    outside = first.copy()
    outside[8 : 8 + high, 8 : 8 + wide] = empty[0, 0]
    assert (outside == empty).all()
    shown("60.0 Hz\nwarp 3 ms")
    assert overlay.redrawn == 1
    again = shown("60.1 Hz\nwarp 3 ms", "lower right")
    assert overlay.redrawn == 2
    assert (again[:50, :100] == empty[0, 0]).all()
    assert (again[-8 - high : -8, -8 - wide : -8].astype(int).max() > 200).all()


def test_text_is_light_on_a_dark_panel_in_columns(monkeypatch):
    from persp_sw.marks import lettering
    from vr_plugin.screen.lettering import INK, PANEL, text_panel

    for fonts in (lettering.FONTS, ()):  # those of the system, and what Pillow brings itself
        monkeypatch.setattr(lettering, "FONTS", fonts)
        lettering._font.cache_clear()
        panel = text_panel("Hz 62.4\n|", 20)
        assert panel.dtype == np.float32
        assert panel[..., 3].min() == pytest.approx(PANEL[3]) and panel[..., 3].max() == pytest.approx(1)
        assert panel[..., :3].max() == pytest.approx(max(INK))
        assert (panel[..., :3].max(-1) <= panel[..., 3] + 1e-6).all()
        assert text_panel("iiii", 20).shape == text_panel("MMMM", 20).shape
        assert text_panel("a\nb\nc", 20).shape[0] - text_panel("a", 20).shape[0] == 52
        # The fifth character stands in the same column, whatever stands before it.
        columns = [np.flatnonzero(text_panel(text, 20)[..., 0].max(0) > 0.5) for text in ("iiii|", "WWWW|")]
        assert columns[0].max() == pytest.approx(columns[1].max(), abs=1)
    lettering._font.cache_clear()


def test_text_in_half_a_window_is_half_as_wide():
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes
    from vr_plugin.screen.text_overlay import Overlay

    overlay = Overlay(Shapes())
    covered = {}
    for size in ((200, 100), (100, 100)):
        target = EyeTarget(size)
        with target.drawing():
            overlay.draw("quality 1.00", (200, 100))
        covered[size] = np.flatnonzero(target.read()[..., 3].max(0) > 0)
    assert len(covered[100, 100]) == pytest.approx(len(covered[200, 100]) / 2, abs=1)
    assert overlay.redrawn == 1


# --- the context -------------------------------------------------------------------------------------------


def state() -> dict[str, object]:
    """All of the context's state that drawing could touch."""
    from OpenGL import GL

    found: dict[str, object] = {
        name: np.ravel(GL.glGetDoublev(getattr(GL, f"GL_{name}"))).tolist() for name in NUMBERS
    }
    found |= {name: bool(GL.glIsEnabled(getattr(GL, f"GL_{name}"))) for name in FLAGS}
    unit = GL.glGetIntegerv(GL.GL_ACTIVE_TEXTURE)
    for number in range(4):
        GL.glActiveTexture(GL.GL_TEXTURE0 + number)
        for name in ("TEXTURE_BINDING_2D", "SAMPLER_BINDING"):
            found[f"{name} {number}"] = int(GL.glGetIntegerv(getattr(GL, f"GL_{name}")))
    GL.glActiveTexture(unit)
    return found


def everything() -> None:
    """Draw all there is to draw, and delete it."""
    from vr_plugin.present import Composer, read_screen
    from vr_plugin.screen.eye_target import EyeTarget
    from vr_plugin.screen.shapes import Shapes
    from vr_plugin.screen.text_overlay import Overlay

    shapes, composer = Shapes(), Composer()
    overlay, pair = Overlay(shapes), [EyeTarget((24, 16)), EyeTarget((24, 16))]
    for target in pair:
        with target.drawing():
            shapes.polygon(np.eye(4), WHOLE, (1, 0, 0, 0.5))
            shapes.lines(np.eye(4), [[(-1, 0, 0), (1, 0, 0)]], (1, 1, 1))
            overlay.draw("text", (24, 16))
        target.make_mipmaps()
        target.resize((20, 16))
        target.upload(np.zeros((16, 20, 4), np.float32))
        target.read()
    shapes.picture(np.eye(4), WHOLE, pair[0].texture)
    for mode in COMBINED:
        composer.compose(*pair, mode, (23, 15))
    read_screen((8, 8))
    for thing in (*pair, overlay, shapes, composer):
        thing.close()
        thing.close()  # twice is once


def test_state_is_left_as_it_was():
    from OpenGL import GL

    from vr_plugin.screen.gl_objects import Program, Texture

    floats((32, 32))
    before = state()
    everything()
    assert state() == before
    # And from a state as unlike the usual one as can be.
    program = Program("void main() { gl_Position = vec4(0); }", "out vec4 c; void main() { c = vec4(1); }")
    texture = Texture((4, 4))
    for number in range(3):
        GL.glActiveTexture(GL.GL_TEXTURE0 + number)
        GL.glBindTexture(GL.GL_TEXTURE_2D, texture.name)
        GL.glBindSampler(number, int(GL.glGenSamplers(1)))
    GL.glUseProgram(program.name)
    GL.glBindVertexArray(int(GL.glGenVertexArrays(1)))
    for target in (GL.GL_ARRAY_BUFFER, GL.GL_PIXEL_PACK_BUFFER, GL.GL_PIXEL_UNPACK_BUFFER):
        GL.glBindBuffer(target, int(GL.glGenBuffers(1)))
    GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, int(GL.glGenRenderbuffers(1)))
    for name in (
        GL.GL_BLEND, GL.GL_CULL_FACE, GL.GL_DEPTH_CLAMP, GL.GL_DEPTH_TEST, GL.GL_FRAMEBUFFER_SRGB,
        GL.GL_POLYGON_OFFSET_FILL, GL.GL_RASTERIZER_DISCARD, GL.GL_SAMPLE_ALPHA_TO_COVERAGE,
        GL.GL_SCISSOR_TEST, GL.GL_STENCIL_TEST, GL.GL_COLOR_LOGIC_OP,
    ):  # fmt: skip
        GL.glEnable(name)
    GL.glBlendFuncSeparate(GL.GL_DST_COLOR, GL.GL_ZERO, GL.GL_ONE_MINUS_DST_ALPHA, GL.GL_SRC_ALPHA)
    GL.glBlendEquationSeparate(GL.GL_MAX, GL.GL_FUNC_REVERSE_SUBTRACT)
    GL.glDepthFunc(GL.GL_GREATER)
    GL.glDepthMask(False)
    GL.glColorMask(True, False, True, False)
    GL.glPolygonMode(GL.GL_FRONT_AND_BACK, GL.GL_LINE)
    GL.glPolygonOffset(-3, 7)
    GL.glViewport(3, 4, 5, 6)
    GL.glScissor(1, 1, 2, 2)
    GL.glClearColor(0.1, 0.2, 0.3, 0.4)
    GL.glClearDepth(0.25)
    for name in (GL.GL_PACK_ALIGNMENT, GL.GL_UNPACK_ALIGNMENT):
        GL.glPixelStorei(name, 8)
    for name in (GL.GL_PACK_ROW_LENGTH, GL.GL_UNPACK_ROW_LENGTH, GL.GL_UNPACK_SKIP_ROWS):
        GL.glPixelStorei(name, 77)
    before = state()
    everything()
    assert state() == before


def test_pictures_do_not_depend_on_the_state_they_find(rng):
    from OpenGL import GL

    from vr_plugin.present import Composer

    size = (16, 12)
    both = pictures(rng, size)
    pair = targets(both)
    floats(size)
    for name in (GL.GL_BLEND, GL.GL_CULL_FACE, GL.GL_SCISSOR_TEST, GL.GL_STENCIL_TEST, GL.GL_DEPTH_TEST):
        GL.glEnable(name)
    GL.glColorMask(False, True, False, True)
    GL.glScissor(2, 2, 3, 3)
    GL.glFrontFace(GL.GL_CW)
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 8)
    GL.glPolygonMode(GL.GL_FRONT_AND_BACK, GL.GL_LINE)
    Composer().compose(*pair, "anaglyph", size, encode=False)
    np.testing.assert_allclose(read_floats(size), combine(*both, "anaglyph"), rtol=0, atol=COMPOSED)


def test_all_that_was_made_is_deleted():
    from OpenGL import GL

    kinds = (
        GL.glIsTexture, GL.glIsFramebuffer, GL.glIsRenderbuffer, GL.glIsBuffer, GL.glIsVertexArray,
        GL.glIsSampler, GL.glIsProgram, GL.glIsShader,
    )  # fmt: skip

    def there() -> list[tuple[str, int]]:
        return [(kind.__name__, name) for kind in kinds for name in range(1, 200) if kind(name)]

    floats((32, 32))
    before = there()
    everything()
    assert there() == before
