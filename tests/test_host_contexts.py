"""The plug-in in several OpenGL contexts, and what it says where it cannot draw."""

from __future__ import annotations

import numpy as np
import pytest
from samples import ball
from tolerances import TEXTURE_FLOAT32

from persp_sw import Framebuffer, OffscreenContext, Renderer, View, Volume
from persp_sw.errors import GraphicsError, ViewError
from persp_sw.warp.context import opengl
from vr_plugin.host import VolumeInHost
from vr_plugin.host_view import HostView

SIZE = (64, 48)


@pytest.fixture
def plugin():
    return VolumeInHost(Renderer(Volume(ball(12))))


@pytest.fixture
def view(plugin):
    return plain_view(plugin)


def plain_view(plugin, towards=(1, 2, 1.5)):
    centre = plugin.renderer.volume.centre
    seen = View.look_at(centre + 14 * np.array(towards), centre, (0, 0, 1), 30, SIZE)
    return HostView(seen.clip_from_world(1, 100), np.eye(4), SIZE)


def drawn(plugin, view, context=""):
    target = Framebuffer(*SIZE)
    target.clear()
    plugin.draw(view, context)
    picture = target.read()
    target.close()
    return picture


def things(gl):
    """How many textures, programs and vertex arrays there are, of the first hundred names."""
    kinds = gl.glIsTexture, gl.glIsProgram, gl.glIsVertexArray, gl.glIsBuffer, gl.glIsFramebuffer
    return [sum(bool(exists(name)) for name in range(1, 100)) for exists in kinds]


@pytest.mark.gl
def test_contexts_that_share_upload_once(gl_context, plugin, view, monkeypatch):
    plugin.start()
    plugin.prepare([view])
    first = drawn(plugin, view)
    assert first[..., 3].max() > 0.3
    uploads = []
    warp = plugin._contexts[""]._warp
    monkeypatch.setattr(warp, "upload", lambda *given: uploads.append(given))
    with OffscreenContext(share=gl_context):
        assert np.array_equal(drawn(plugin, view), first)
    assert not uploads
    plugin.stop()


@pytest.mark.gl
def test_contexts_that_share_nothing_have_names(gl_context, plugin, view):
    """Composited once, uploaded into each; each is stopped on its own."""
    plugin.start("first")
    plugin.prepare([view])
    first = drawn(plugin, view, "first")
    with OffscreenContext() as other:
        plugin.start("second")
        assert np.abs(drawn(plugin, view, "second") - first).max() < TEXTURE_FLOAT32
        plugin.prepare([plain_view(plugin), view])
        assert (plugin.compositings, plugin.reused) == (1, 0)  # one eye: now two walls
        plugin.stop("second")
        assert not sum(things(opengl()))
        other.release()
    gl_context.make_current()
    assert np.abs(drawn(plugin, view, "first") - first).max() < 0.05
    plugin.stop("first")


@pytest.mark.gl
def test_stop_deletes_everything_and_start_begins_anew(gl_context, plugin, view):
    with OffscreenContext() as context:
        gl = opengl()
        pictures = []
        for _ in range(2):
            plugin.start()
            plugin.prepare([view, plain_view(plugin, (-1, 2, 1))])
            assert plugin.compositings == 2
            pictures.append(drawn(plugin, view))
            assert things(gl)[:2] == [1, 1]
            plugin.stop()
            assert not sum(things(gl))
            assert plugin.images == []
        assert np.array_equal(*pictures)
        plugin.stop()  # of what was not started: nothing
        context.release()


@pytest.mark.gl
def test_what_cannot_be_drawn_is_said(gl_context, plugin, view):
    plugin.prepare([view])  # needs no OpenGL
    with pytest.raises(GraphicsError, match="context '' is not started; call start"):
        plugin.draw(view)
    plugin.start()
    with pytest.raises(GraphicsError, match="started already"):
        plugin.start()
    with pytest.raises(ViewError, match="not prepared"):
        plugin.draw(plain_view(plugin))
    plugin.stop()
    with pytest.raises(GraphicsError, match="not started"):
        plugin.draw(view)
    gl_context.release()
    with pytest.raises(GraphicsError, match="no OpenGL context is current"):
        plugin.start()
    gl_context.make_current()
    plugin.start()  # the failed one left nothing behind
    plugin.stop()


@pytest.mark.parametrize(
    "matrix, said",
    [
        (np.diag([1.0, 1, 2, 1]), "stretches or shears"),
        (np.diag([1.0, 1, -1, 1]), "mirrors"),
        (np.diag([1.0, 1, 0, 1]), "singular"),
        (np.eye(4)[:3], r"host_from_world is a \(4, 4\) matrix"),
        (np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1.0]]), "the last row"),
    ],
)
def test_a_volume_is_placed_by_a_similarity(plugin, matrix, said):
    before = plugin.host_from_world
    with pytest.raises(ViewError, match=said):
        plugin.update(host_from_world=matrix)
    assert np.array_equal(plugin.host_from_world, before)


def test_a_frame_that_fails_changes_nothing(plugin, view):
    plugin.prepare([view])
    images = plugin.images
    with pytest.raises(ViewError, match="near"):
        plugin.prepare([view], near=-1)
    with pytest.raises(ViewError, match="singular"):
        plugin.prepare([view, HostView(np.zeros((4, 4)), np.eye(4), SIZE)])
    assert plugin.images[0] is images[0] and plugin.compositings == 1


def test_a_precision_that_is_none():
    with pytest.raises(GraphicsError, match="precision"):
        VolumeInHost(Renderer(Volume(ball(6))), precision="float8")


def test_the_matrix_given_out_is_a_copy(plugin):
    plugin.host_from_world[0, 0] = 7
    assert plugin.host_from_world[0, 0] == 1
