"""Our volume in the scene of a host that we did not write: moderngl draws the rest, with its own matrices."""

from __future__ import annotations

import moderngl
import numpy as np
import pytest
from samples import ball
from tolerances import TEXTURE_FLOAT32

from persp_sw import (
    Regions,
    Renderer,
    Settings,
    TransferFunction,
    View,
    Volume,
)
from persp_sw.warp.context import opengl
from vr_plugin.examples.moderngl_scene import HostScene, cuboid
from vr_plugin.host import VolumeInHost
from vr_plugin.host_view import HostView, seen_in_world
from vr_plugin.rigs.similarity import similarity

SIZE = (160, 120)
TF = TransferFunction([(20, (1, 0.5, 0.2), 0), (200, (0.3, 1, 1), 0.12)], 1.0)
UPRIGHT = similarity((0.2, 1.2, -0.1), ("x", "z", "-y"), 30, 0.04)  # some 1 m large


@pytest.fixture
def volume():
    """A ball in its own millimetres, far from the origin."""
    pose = np.eye(4)
    pose[:3, 3] = -11.5 + np.array([0.4, 0.1, -0.3])
    return Volume(ball(), world_from_object=pose)


@pytest.fixture
def host(gl_context):
    """A moderngl context without a screen, and a float32 picture of it, which are current."""
    gl_context.release()
    context = moderngl.create_context(standalone=True, backend="egl", require=330)
    with context:
        target = context.framebuffer([context.texture(SIZE, 4, dtype="f4")], context.depth_renderbuffer(SIZE))
        target.use()
        yield context, target
        gl = opengl()
        assert gl.glGetError() == gl.GL_NO_ERROR
    context.release()


@pytest.fixture
def plugin(volume, host):
    plugin = VolumeInHost(Renderer(volume, TF), UPRIGHT)
    plugin.start()
    yield plugin
    plugin.stop()


def camera(eye, centre=(0.2, 1.2, -0.1), fovy=45, size=SIZE, near=0.05, far=60.0):
    """Matrices as a host makes them: of a camera in its own space."""
    seen = View.look_at(eye, centre, (0, 1, 0), fovy, size)
    forward = np.subtract(centre, eye) / np.linalg.norm(np.subtract(centre, eye))
    right = np.cross(forward, (0, 1, 0)) / np.linalg.norm(np.cross(forward, (0, 1, 0)))
    view = np.eye(4)
    view[:3, :3] = right, np.cross(right, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return HostView(seen.clip_from_world(near, far) @ np.linalg.inv(view), view, size)


EYES = [(1.3, 1.7, 1.6), (-1.4, 0.6, 0.9), (0.1, 2.6, 0.4), (0.3, 1.25, 0.0)]  # the last one is inside


def picture_of(target):
    pixels = np.frombuffer(target.read(components=4, dtype="f4"), np.float32)
    return pixels.reshape(*target.size[::-1], 4)[::-1]


def alone(plugin, view):
    """The volume by the software warp, as seen by the view that the plug-in derives."""
    return plugin.renderer.render(seen_in_world(view, plugin.host_from_world, plugin.renderer.volume))


@pytest.mark.gl
@pytest.mark.parametrize("eye", EYES)
def test_the_volume_drawn_is_the_renderers_picture(host, plugin, eye):
    _, target = host
    view = camera(eye)
    plugin.prepare([view])
    target.clear(0, 0, 0, 0)
    plugin.draw(view)
    truth = alone(plugin, view)
    assert truth[..., 3].max() > 0.4
    assert np.abs(picture_of(target) - truth).max() < TEXTURE_FLOAT32


@pytest.mark.gl
@pytest.mark.parametrize("eye", EYES[:3])
def test_objects_before_it_hide_it_and_objects_behind_shine_through(host, plugin, eye):
    """(1 − α)·object + volume behind; the object alone in front; also where they touch the volume's box."""
    context, target = host
    view = camera(eye)
    clip = view.clip_from_host
    middle = UPRIGHT[:3, 3]
    away = (middle - eye) / np.linalg.norm(middle - np.array(eye))
    behind = cuboid(middle + 1.3 * away - 0.5, middle + 1.3 * away + 0.5, (0.9, 0.1, 0.1))
    side = np.cross(away, (0, 1, 0)) * 0.15
    before = cuboid(middle - 0.85 * away + side - 0.12, middle - 0.85 * away + side + 0.12, (0.1, 0.2, 0.9))
    pictures = {}
    for name, objects in (("behind", [behind]), ("before", [before]), ("both", [behind, before])):
        scene = HostScene(context, objects)
        target.clear(0.1, 0.2, 0.3, 1)
        scene.draw(clip)
        pictures[name] = picture_of(target)
        if name == "both":
            plugin.prepare([view])
            plugin.draw(view)
        scene.close()
    hidden = (pictures["before"][..., :3] != np.float32((0.1, 0.2, 0.3))).any(-1)
    truth = alone(plugin, view)
    through = truth + (1 - truth[..., 3:]) * pictures["behind"]
    objects = (pictures["behind"][..., :3] != np.float32((0.1, 0.2, 0.3))).any(-1)
    shows = truth[..., 3] > 0.1
    assert min((shows & hidden).sum(), (shows & ~hidden & objects).sum(), (shows & ~hidden).sum()) > 150
    expected = np.where(hidden[..., None], pictures["before"], through)
    assert np.abs(picture_of(target) - expected).max() < 2 * TEXTURE_FLOAT32


@pytest.mark.gl
def test_a_pair_of_eyes_and_views_that_share_one(host, plugin):
    """Compositings are counted by eyes, not by views; a frame in which nothing changed has none."""
    _, target = host
    left, right = (camera((x, 1.5, 1.6), (x, 1.2, -0.1)) for x in (0.17, 0.23))
    beside = camera((0.17, 1.5, 1.6), (0.6, 1.1, -0.1), fovy=80)
    plugin.prepare([left, right, beside])
    assert (plugin.compositings, plugin.reused, len(plugin.images)) == (2, 0, 2)
    assert all(s["samples"] > 0 for s in plugin.statistics)
    drawn = []
    for view in (left, right, beside):
        target.clear(0, 0, 0, 0)
        plugin.draw(view)
        drawn.append(picture_of(target))
        # Of three views one is wider: the eye image's grid is not that of a picture of its own.
        assert np.abs(drawn[-1] - alone(plugin, view)).max() < 0.05
    assert np.abs(drawn[0] - drawn[1]).max() > 0.05
    shared = plugin.renderer.warp(plugin.images[0], seen_in_world(beside, UPRIGHT, plugin.renderer.volume))
    assert np.abs(drawn[2] - shared).max() < TEXTURE_FLOAT32

    plugin.prepare([camera((0.17, 1.5, 1.6), (0.17, 1.2, -0.1)), right, beside])
    assert (plugin.compositings, plugin.reused) == (0, 2)
    plugin.prepare([right])
    assert (plugin.compositings, plugin.reused) == (1, 0)
    away = camera((0.2, 1.5, 1.6), (0.2, 1.5, 9.0))
    plugin.prepare([away, right])
    assert (plugin.compositings, len(plugin.images[0].faces)) == (1, 0)  # sees nothing: costs nothing
    target.clear(0.5, 0.5, 0.5, 0.5)
    plugin.draw(away)
    assert (picture_of(target) == 0.5).all()


@pytest.mark.gl
def test_float32_matrices_of_one_eye_are_one_eye(host, plugin):
    def rounded(matrix):
        return np.asarray(matrix, np.float32)

    views = [camera((1.3, 1.7, 1.6), centre) for centre in ((0.2, 1.2, -0.1), (0.4, 1.3, 0.1), (0, 1, 0))]
    views = [HostView(rounded(v.clip_from_view), rounded(v.view_from_host), v.pixels) for v in views]
    plugin.prepare(views)
    assert plugin.compositings == 1
    plugin.same_eye = 0.0
    plugin.prepare(views)
    assert plugin.compositings + plugin.reused == 3


@pytest.mark.gl
def test_update_changes_looks_and_place(host, plugin, volume):
    """Each change shows in the next frame, and is what a plug-in made so shows at once."""
    _, target = host
    view = camera(EYES[0])
    changes = [
        {"transfer": TransferFunction([(20, (0, 1, 0), 0), (200, (1, 1, 1), 0.3)], 1.0)},
        {"settings": Settings(quality=0.5)},
        {"regions": Regions(clip=[(1, 0, 0, 0)])},
        {"host_from_world": similarity((0.4, 1.3, 0), ("x", "z", "-y"), 75, 0.03)},
    ]
    before = None
    for change in changes:
        plugin.update(**change)
        plugin.prepare([view])
        assert (plugin.compositings, plugin.reused) == (1, 0)
        target.clear(0, 0, 0, 0)
        plugin.draw(view)
        drawn = picture_of(target)
        assert before is None or np.abs(drawn - before).max() > 0.02
        before = drawn
        assert np.abs(drawn - alone(plugin, view)).max() < TEXTURE_FLOAT32
    plugin.prepare([view])
    assert (plugin.compositings, plugin.reused) == (0, 1)


@pytest.mark.gl
def test_a_new_place_holds_from_the_next_frame_on(host, plugin):
    _, target = host
    view = camera(EYES[0])
    plugin.prepare([view])
    truth = alone(plugin, view)
    plugin.update(host_from_world=similarity((0, 2, 0), scale=0.01))
    target.clear(0, 0, 0, 0)
    plugin.draw(view)
    assert np.abs(picture_of(target) - truth).max() < TEXTURE_FLOAT32


@pytest.mark.gl
def test_the_hosts_unit_changes_nothing(host, plugin):
    """A host in millimetres, with a near distance: the same picture as one in metres."""
    _, target = host
    eye, centre = np.array(EYES[0]), np.array((0.2, 1.2, -0.1))
    pictures = []
    for unit in (1.0, 1000.0):
        plugin.update(host_from_world=np.diag([unit, unit, unit, 1]) @ UPRIGHT)
        view = camera(unit * eye, unit * centre, near=0.05 * unit, far=60 * unit)
        plugin.prepare([view], near=2.0 * unit)
        target.clear(0, 0, 0, 0)
        plugin.draw(view)
        pictures.append(picture_of(target))
    assert np.abs(pictures[0] - pictures[1]).max() < TEXTURE_FLOAT32
    assert np.abs(pictures[0] - alone(plugin, view)).max() > 0.05  # the near half is gone


@pytest.mark.gl
def test_the_host_draws_on_as_if_nothing_had_been(host, plugin):
    """Whatever it had set: its next picture, made without setting anything again, has the same bits."""
    context, target = host
    view = camera(EYES[0])
    scene = HostScene(context, [cuboid((-1, 0, -1), (1, 0.5, 1), (0.4, 0.8, 0.2))])
    marks = context.program(
        vertex_shader="""#version 330 core
        void main() {  // the whole picture, behind the box; and again the other way round, which is culled
            int corner = gl_VertexID % 3;
            vec2 at = vec2(corner & 1, corner >> 1) * 4.0 - 1.0;
            gl_Position = gl_VertexID < 3 ? vec4(at, 0.99, 1.0) : vec4(at.yx, 0.98, 1.0);
        }""",
        fragment_shader="""#version 330 core
        uniform sampler2D marks; out vec4 colour;
        void main() { colour = texelFetch(marks, ivec2(gl_FragCoord.xy) % 4, 0); }""",
    )
    texture = context.texture((4, 4), 4, np.linspace(0, 1, 64, dtype=np.float32).tobytes(), dtype="f4")
    whole = context.vertex_array(marks, [])

    def frame(between):
        target.use()
        target.clear(0.2, 0.2, 0.2, 1)
        scene.draw(view.clip_from_host)
        context.enable_only(moderngl.BLEND | moderngl.CULL_FACE | moderngl.DEPTH_TEST)
        context.blend_func = moderngl.DST_COLOR, moderngl.SRC_ALPHA
        context.depth_func = "!="
        context.cull_face = "front"
        context.front_face = "cw"
        target.viewport = 10, 5, 130, 100
        target.scissor = 20, 10, 90, 80
        target.color_mask = True, False, True, True
        texture.use(0)
        between()
        whole.render(moderngl.TRIANGLES, 6)
        target.color_mask = True, True, True, True
        target.scissor = None
        target.viewport = 0, 0, *SIZE
        return picture_of(target)

    other = context.framebuffer([context.texture(SIZE, 4, dtype="f4")], context.depth_renderbuffer(SIZE))
    other.clear()

    def goes_elsewhere(drawing=lambda: None):
        other.use()
        drawing()
        target.use()

    def draws():
        plugin.prepare([view])
        plugin.draw(view)

    frame(goes_elsewhere)
    untouched, untouched_there = frame(lambda: None), frame(goes_elsewhere)
    # The first time it makes textures and programs, then it uploads other pictures into them.
    assert np.array_equal(frame(lambda: goes_elsewhere(draws)), untouched_there)
    plugin.update(settings=Settings(quality=0.7))
    assert np.array_equal(frame(lambda: goes_elsewhere(draws)), untouched_there)
    assert picture_of(other)[..., 3].max() > 0.4
    drawn_here = frame(lambda: plugin.draw(view))
    inside = np.zeros(SIZE[::-1], bool)
    inside[30:110, 20:110] = True  # rows from the top
    changed = (drawn_here != untouched).any(-1)
    assert changed.any() and not (changed & ~inside).any()  # the host's scissor holds
