"""docs/plug-in.md says what is so: its program runs, and its formulas draw the picture."""

from __future__ import annotations

import inspect
import io
import re

import moderngl
import numpy as np
import pytest
from PIL import Image
from samples import ROOT, ball, run_snippet
from tolerances import QUADS, QUADS_AT_SEAMS
from views import DIRECTIONS, random_pose, view_of

from persp_sw import Renderer, Settings, TransferFunction, View, Volume
from vr_plugin.host import VolumeInHost

TEXT = (ROOT / "docs" / "plug-in.md").read_text()
PROGRAM, QUADS_OF_BYTES = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)


@pytest.mark.gl
def test_the_program_makes_a_picture(gl_context, tmp_path):
    assert len(PROGRAM.strip().splitlines()) <= 30
    np.save(tmp_path / "head.npy", ball())
    run_snippet(PROGRAM, tmp_path)
    with Image.open(tmp_path / "picture.png") as picture:
        assert picture.size == (400, 300)
        assert np.asarray(picture)[140:160, 190:210].mean() > np.asarray(picture)[:20].mean() + 50


def test_the_calls_are_those_that_exist():
    called = dict(re.findall(r"^\| `(\w+)\((.*?)\)`", TEXT, re.MULTILINE))
    assert list(called) == ["start", "update", "prepare", "draw", "stop"]
    for name, arguments in called.items():
        known = inspect.signature(getattr(VolumeInHost, name)).parameters
        assert set(re.findall(r"(\w+)(?:=|$|,)", re.sub(r"=\d", "=", arguments))) <= set(known), name


def test_files_and_pictures_exist():
    for target in re.findall(r"\]\((?!https:)([^)]+)\)", TEXT):
        assert (ROOT / "docs" / target).is_file(), target
    for path in re.findall(r"`(vr_plugin/[\w./]+)`", TEXT):
        assert (ROOT / path).is_file(), path
    assert (ROOT / "docs" / "images" / "plug-in.png").stat().st_size <= 200_000


@pytest.mark.gl
@pytest.mark.parametrize("distance, single, most", [(1.7, 3, 1), (0.9, 1, 3), (np.inf, 3, 1)])
def test_its_quads_are_the_volumes_picture(gl_context, rng, distance, single, most):
    """By bytes and formulas alone, drawn by moderngl as ordinary textured quads, at any distance."""
    names = {"np": np, "io": io}
    exec(QUADS_OF_BYTES, names)
    pose = random_pose(rng, spacing=(1, 1.5, 0.7), shear=0.2)
    volume = Volume(ball(), world_from_object=pose)
    transfer = TransferFunction([(20, (1, 0.5, 0.2), 0), (200, (0.3, 1, 1), 0.2)], 1.0)
    renderer = Renderer(volume, transfer, Settings(single_face_tangent=single))
    gl_context.release()
    context = moderngl.create_context(standalone=True, backend="egl", require=330)
    counts = set()
    with context:
        program = context.program(
            vertex_shader="""#version 330 core
            in vec4 corner; in vec2 place; out vec2 at;
            void main() { at = place; gl_Position = corner; }""",
            fragment_shader="""#version 330 core
            uniform sampler2D face; in vec2 at; out vec4 colour;
            void main() { colour = texture(face, at); }""",
        )
        for towards in DIRECTIONS:
            if np.isfinite(distance):
                view = view_of(volume, towards, distance, fovy=60, size=(90, 70))
                clip = view.clip_from_world(1e-3, 1e4)
            else:
                view = View.parallel(volume.centre + towards, volume.centre, (0.1, 0.9, 0.3), 40, (90, 70))
                clip = view.clip_from_world(-1e4, 1e4)
            image = renderer.composite(view.eye, [view.wall])
            counts.add(len(image.faces))
            target = context.framebuffer([context.texture(view.size, 4, dtype="f4")])
            for away in (3.0, 40.0):
                target.use()
                target.clear()
                context.enable_only(moderngl.BLEND)
                context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
                for corners, places, pixels in names["quads"](image.to_bytes(), away):
                    texture = context.texture(pixels.shape[1::-1], 4, pixels.tobytes(), dtype="f4")
                    texture.repeat_x = texture.repeat_y = False
                    texture.use(0)
                    corners = np.column_stack([corners, np.ones(4)]) @ clip.T
                    vertices = np.column_stack([corners, places]).astype(np.float32)
                    data = context.buffer(vertices.tobytes())
                    array = context.vertex_array(program, [(data, "4f 2f", "corner", "place")])
                    array.render(moderngl.TRIANGLE_FAN)
                drawn = np.frombuffer(target.read(components=4, dtype="f4"), np.float32)
                truth = renderer.warp(image, view)
                assert truth[..., 3].max() > 0.5
                assert np.abs(drawn.reshape(*view.size[::-1], 4)[::-1] - truth).max() < (
                    QUADS if most == 1 else QUADS_AT_SEAMS
                )
    context.release()
    assert max(counts) == most
