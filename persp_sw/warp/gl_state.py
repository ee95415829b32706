"""What drawing a quad or uploading a texture changes in OpenGL, kept and put back."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from .context import integers, opengl


@contextmanager
def drawing() -> Iterator[None]:
    """Within, OpenGL draws filled polygons laid over what is there, premultiplied and linear.

    Left as they are: framebuffer, viewport, scissor, stencil and colour mask, which say where the host wants
    pictures, and whether nearer depths are less or greater; depths are tested, never written. Afterwards all
    is as it was.
    """
    gl = opengl()
    on = gl.GL_BLEND, gl.GL_FRAMEBUFFER_SRGB
    off = (
        gl.GL_CULL_FACE,
        gl.GL_COLOR_LOGIC_OP,
        gl.GL_SAMPLE_ALPHA_TO_COVERAGE,
    )
    switches = {name: gl.glIsEnabled(name) for name in (*on, *off, gl.GL_DEPTH_TEST)}
    equations = [integers(name)[0] for name in (gl.GL_BLEND_EQUATION_RGB, gl.GL_BLEND_EQUATION_ALPHA)]
    factors = [
        integers(name)[0]
        for name in (gl.GL_BLEND_SRC_RGB, gl.GL_BLEND_DST_RGB, gl.GL_BLEND_SRC_ALPHA, gl.GL_BLEND_DST_ALPHA)
    ]
    (depth_function,), (depth_mask,) = integers(gl.GL_DEPTH_FUNC), integers(gl.GL_DEPTH_WRITEMASK)
    polygon_mode = integers(gl.GL_POLYGON_MODE)[0]
    (program,), (vertex_array,) = integers(gl.GL_CURRENT_PROGRAM), integers(gl.GL_VERTEX_ARRAY_BINDING)
    reversed_depth = depth_function in (gl.GL_GREATER, gl.GL_GEQUAL)
    try:
        with _texture_unit():
            for name in on:
                gl.glEnable(name)
            for name in off:
                gl.glDisable(name)
            gl.glEnable(gl.GL_DEPTH_TEST)
            gl.glDepthFunc(gl.GL_GEQUAL if reversed_depth else gl.GL_LEQUAL)
            gl.glDepthMask(gl.GL_FALSE)
            gl.glBlendEquation(gl.GL_FUNC_ADD)
            gl.glBlendFunc(gl.GL_ONE, gl.GL_ONE_MINUS_SRC_ALPHA)
            gl.glPolygonMode(gl.GL_FRONT_AND_BACK, gl.GL_FILL)
            yield
    finally:
        for name, value in switches.items():
            (gl.glEnable if value else gl.glDisable)(name)
        gl.glDepthFunc(depth_function)
        gl.glDepthMask(depth_mask)
        gl.glBlendEquationSeparate(*equations)
        gl.glBlendFuncSeparate(*factors)
        gl.glPolygonMode(gl.GL_FRONT_AND_BACK, polygon_mode)
        gl.glBindVertexArray(vertex_array)
        gl.glUseProgram(program)


@contextmanager
def uploading() -> Iterator[None]:
    """Within, pixels are read from the processor's memory, row after row without gaps."""
    gl = opengl()
    rows = {
        gl.GL_UNPACK_SWAP_BYTES: 0,
        gl.GL_UNPACK_LSB_FIRST: 0,
        gl.GL_UNPACK_ROW_LENGTH: 0,
        gl.GL_UNPACK_IMAGE_HEIGHT: 0,
        gl.GL_UNPACK_SKIP_ROWS: 0,
        gl.GL_UNPACK_SKIP_PIXELS: 0,
        gl.GL_UNPACK_SKIP_IMAGES: 0,
        gl.GL_UNPACK_ALIGNMENT: 4,
    }
    before = {name: integers(name)[0] for name in rows}
    (buffer,) = integers(gl.GL_PIXEL_UNPACK_BUFFER_BINDING)
    try:
        with _texture_unit():
            gl.glBindBuffer(gl.GL_PIXEL_UNPACK_BUFFER, 0)
            for name, value in rows.items():
                gl.glPixelStorei(name, value)
            yield
    finally:
        gl.glBindBuffer(gl.GL_PIXEL_UNPACK_BUFFER, buffer)
        for name, value in before.items():
            gl.glPixelStorei(name, value)


@contextmanager
def _texture_unit() -> Iterator[None]:
    """Texture unit 0 is active, its textures free to be bound and no sampler object over them."""
    gl = opengl()
    (active,) = integers(gl.GL_ACTIVE_TEXTURE)
    gl.glActiveTexture(gl.GL_TEXTURE0)
    array, flat = (gl.glGetIntegerv(n) for n in (gl.GL_TEXTURE_BINDING_2D_ARRAY, gl.GL_TEXTURE_BINDING_2D))
    (sampler,) = integers(gl.GL_SAMPLER_BINDING)
    gl.glBindSampler(0, 0)
    try:
        yield
    finally:
        gl.glBindTexture(gl.GL_TEXTURE_2D_ARRAY, array)
        gl.glBindTexture(gl.GL_TEXTURE_2D, flat)
        gl.glBindSampler(0, sampler)
        gl.glActiveTexture(active)
