"""OpenGL for tests: one context without a screen, and opaque polygons to draw beside the volume."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np
import pytest

from persp_sw import Eye, OffscreenContext
from persp_sw.errors import GraphicsError, MissingPackageError
from persp_sw.warp.context import opengl
from persp_sw.warp.gl_objects import Program


@cache
def _offscreen() -> OffscreenContext | str:
    """The one context of all tests, or why there is none."""
    try:
        return OffscreenContext()
    except (GraphicsError, MissingPackageError) as error:
        return str(error)


@contextmanager
def clean_offscreen_context() -> Iterator[OffscreenContext]:
    """The tests' context, current; skips where there is none, except in CI. Errors of OpenGL fail."""
    context = _offscreen()
    if isinstance(context, str):
        if os.environ.get("CI") == "true":
            pytest.fail(f"CI needs OpenGL: {context}")
        pytest.skip(context)
    gl = opengl()
    context.make_current()
    try:
        assert gl.glGetError() == gl.GL_NO_ERROR, "an earlier test left an OpenGL error"
        yield context
        context.make_current()
        assert gl.glGetError() == gl.GL_NO_ERROR
    finally:
        context.release()


_VERTEX = """#version 330 core
uniform vec4 points[36];
void main() { gl_Position = points[gl_VertexID]; }
"""
_FRAGMENT = """#version 330 core
uniform vec4 shade[1];
out vec4 colour;
void main() { colour = shade[0]; }
"""


def draw_triangles(points: np.ndarray, clip_from_world: np.ndarray, colour: tuple[float, ...]) -> None:
    """Opaque triangles, (3 n, 3) world points, depth-tested and depth-written, without any other state."""
    gl = opengl()
    clip = np.column_stack([points, np.ones(len(points))]) @ np.asarray(clip_from_world).T
    program = Program(_VERTEX, _FRAGMENT)
    vertex_array = gl.glGenVertexArrays(1)
    gl.glBindVertexArray(vertex_array)
    gl.glUseProgram(program.name)
    gl.glEnable(gl.GL_DEPTH_TEST)
    for first in range(0, len(clip), 36):
        part = clip[first : first + 36]
        program.set(points=part, shade=np.array([colour]))
        gl.glDrawArrays(gl.GL_TRIANGLES, 0, len(part))
    gl.glDisable(gl.GL_DEPTH_TEST)
    gl.glUseProgram(0)
    gl.glBindVertexArray(0)
    gl.glDeleteVertexArrays(1, [vertex_array])
    gl.glDeleteProgram(program.name)


def sides_towards(corners: np.ndarray, eye: Eye, *, facing: bool) -> np.ndarray:
    """(3 n, 3) triangles of a parallelepiped's sides that face the eye, or of those that do not.

    `corners` (2, 2, 2, 3): by low or high along each of its axes.
    """
    middle = corners.reshape(-1, 3).mean(0)
    triangles = []
    for axis in range(3):
        for end in (0, 1):
            a, b, c, d = np.moveaxis(corners, axis, 0)[end].reshape(4, 3)[[0, 1, 3, 2]]
            normal = np.cross(b - a, d - a)
            normal *= np.sign(normal @ (a - middle))
            if (normal @ (eye.position - eye.w * a) > 0) == facing:
                triangles += [a, b, c, a, c, d]
    return np.array(triangles)
