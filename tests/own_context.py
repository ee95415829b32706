"""A context of OpenGL for one test alone, checked for errors, and framebuffers to look into."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
import pytest

import persp_sw as psw
from persp_sw.errors import GraphicsError, MissingPackageError


@pytest.fixture
def gl() -> Iterator[psw.OffscreenContext]:
    """A context of its own for each test; skipped where there is no EGL, which CI may not lack."""
    try:
        context = psw.OffscreenContext()
    except (GraphicsError, MissingPackageError) as error:
        if os.environ.get("CI") == "true":
            raise
        pytest.skip(f"no OpenGL without a screen: {error}")
    from OpenGL import GL

    with context:
        yield context
        context.make_current()
        assert GL.glGetError() == GL.GL_NO_ERROR


def framebuffer(size: tuple[int, int], kind: int, attachments: int = 1) -> int:
    """A bound framebuffer with colours of OpenGL's format `kind`; deleted with its context."""
    from OpenGL import GL

    name = int(GL.glGenFramebuffers(1))
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, name)
    for number in range(attachments):
        colour = int(GL.glGenRenderbuffers(1))
        GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, colour)
        GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, kind, *size)
        GL.glFramebufferRenderbuffer(
            GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0 + number, GL.GL_RENDERBUFFER, colour
        )
    assert GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER) == GL.GL_FRAMEBUFFER_COMPLETE
    GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, 0)
    return name


def read_floats(size: tuple[int, int], attachment: int = 0) -> np.ndarray:
    """An attachment of the bound framebuffer: (h, w, 4), row 0 on top."""
    from OpenGL import GL

    image = np.empty((size[1], size[0], 4), np.float32)
    GL.glReadBuffer(GL.GL_COLOR_ATTACHMENT0 + attachment)
    GL.glReadPixels(0, 0, *size, GL.GL_RGBA, GL.GL_FLOAT, image)
    return image[::-1].copy()
