"""The texture warp draws the software warp's picture, at the volume's depth, and leaves OpenGL as it was."""

import numpy as np
import pytest
from gl_context import draw_triangles, sides_towards
from tolerances import TEXTURE_CONSTANT, TEXTURE_FLOAT16, TEXTURE_FLOAT32, TEXTURE_RGBA8
from views import DIRECTIONS, random_pose, random_rotation, view_of

from persp_sw import (
    Eye,
    EyeImage,
    Framebuffer,
    OffscreenContext,
    Regions,
    Renderer,
    Settings,
    TextureWarp,
    TransferFunction,
    View,
    Volume,
    Wall,
)
from persp_sw.errors import GraphicsError, ViewError
from persp_sw.geometry.regions import box_rows
from persp_sw.warp.context import opengl
from vr_plugin.projection import clip_from_view_space

pytestmark = pytest.mark.gl

TF = TransferFunction([(0, (1, 0.5, 0.2), 0), (255, (0.3, 1, 1), 0.3)], 1.0)
OPAQUE = (0.1, 0.2, 0.3, 1.0)


@pytest.fixture
def volume(rng):
    """Coloured noise in a turned, sheared, mirrored pose."""
    pose = random_pose(rng, spacing=(1, 1.5, 0.7), shear=0.2, mirrored=True)
    return Volume(rng.integers(0, 255, (20, 24, 22)).astype(np.uint8), world_from_object=pose)


@pytest.fixture
def warp(gl_context):
    with TextureWarp() as made:
        yield made


def pictures(volume, view, regions=None, **settings):
    """The eye image of a view and the software warp's picture."""
    renderer = Renderer(volume, TF, Settings(**settings), regions)
    image = renderer.composite(view.eye, [view.wall])
    return image, renderer.warp(image, view)


def drawn(draw, size, colour=(0, 0, 0, 0), kind="float32"):
    """What is in a framebuffer of `colour` after draw()."""
    target = Framebuffer(*size, kind)
    target.clear(colour)
    draw()
    picture = target.read()
    target.close()
    return picture


def over(picture, colour):
    return picture + (1 - picture[..., 3:]) * np.array(colour, np.float32)


def corners_of(image, grow):
    """World corners (2, 2, 2, 3) of what is shown, its box scaled about its middle."""
    low, high = image.box
    middle, half = (low + high) / 2, (high - low) / 2 * grow
    signs = np.stack(np.meshgrid(*[(-1, 1)] * 3, indexing="ij"), -1)
    pose = image.world_from_object
    return (middle + signs * half) @ pose[:3, :3].T + pose[:3, 3]


def pieces(image, view):
    """Where rays enter and leave what is shown, (h, w) each, as parts of `view.directions()`; in float64."""
    object_from_world = np.linalg.inv(image.world_from_object)
    starts = view.starts() @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    along = view.directions() @ object_from_world[:3, :3].T
    rows = np.concatenate([box_rows(*image.box), image.half_spaces])
    at, slope = starts @ rows[:, :3].T + rows[:, 3], along @ rows[:, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        enter = np.where(slope > 0, -at / slope, -np.inf).max(-1)
        leave = np.where(slope < 0, -at / slope, np.inf).min(-1)
    return np.maximum(enter, 0), leave


def meets(image, view):
    """(h, w) rays that meet what is shown for more than a point.

    Others, which the outermost pixels' bilinear look-up shows faintly, have no depth that one could test.
    """
    enter, leave = pieces(image, view)
    return leave > enter + 1e-6


def facing_sheet(view, middle, reach=100.0):
    """Two triangles, parallel to the view's wall, about a world point."""
    wall = view.wall
    across, up = wall.lower_right - wall.lower_left, wall.upper_left - wall.lower_left
    across, up = reach * across / np.linalg.norm(across), reach * up / np.linalg.norm(up)
    a, b, c, d = (middle + u * across + v * up for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([a, b, c, a, c, d])


@pytest.mark.parametrize(
    "precision, bound",
    [("float32", TEXTURE_FLOAT32), ("float16", TEXTURE_FLOAT16), ("rgba8", TEXTURE_RGBA8)],
)
@pytest.mark.parametrize("distance, single, faces", [(1.7, 3, 1), (0.9, 1, 3), (0.2, 3, 5)])
def test_the_picture_is_the_software_warps(gl_context, volume, precision, bound, distance, single, faces):
    """One face, several from without, several from within; over black and over a colour."""
    counts = set()
    with TextureWarp(precision) as warp:
        for towards in DIRECTIONS:
            view = view_of(volume, towards, distance, fovy=100 if distance < 1 else 60, size=(130, 97))
            image, truth = pictures(volume, view, single_face_tangent=single)
            assert truth[..., 3].max() > 0.5
            counts.add(len(image.faces))
            warp.upload(image)
            assert np.abs(drawn(lambda v=view: warp.draw_view(v), view.size) - truth).max() < bound
            picture = drawn(lambda v=view: warp.draw_view(v), view.size, OPAQUE)
            assert np.abs(picture - over(truth, OPAQUE)).max() < 2 * bound
    assert max(counts) == faces


def test_parallel_views_too(warp, volume):
    for towards in DIRECTIONS:
        view = View.parallel(volume.centre + towards, volume.centre, (0.1, 0.9, 0.3), 40, (90, 70))
        image, truth = pictures(volume, view)
        warp.upload(image)
        assert truth[..., 3].max() > 0.5
        for depths in ({}, {"near": -500, "far": 500}):
            picture = drawn(lambda v=view, d=depths: warp.draw_view(v, **d), view.size)
            assert np.abs(picture - truth).max() < TEXTURE_FLOAT32


def test_any_hosts_matrix_will_do(warp, volume):
    """Kooima's, a scaled one, and one whose near and far planes are both in front of or behind the volume."""
    view = view_of(volume, DIRECTIONS[0], 1.4, fovy=50, size=(80, 60))
    image, truth = pictures(volume, view)
    warp.upload(image)
    ranges = [(0.1, 1e4), (1e-4, 1e-3), (1e5, 1e6), (view.wall_distance, view.wall_distance * 1.01)]
    for near, far in ranges:
        projection, world = clip_from_view_space(view.eye.position, view.wall, near, far)
        for matrix in (projection @ world, -3e-3 * -(projection @ world)):
            for depth_test in (True, False):
                picture = drawn(lambda m=matrix, d=depth_test: warp.draw(m, depth_test=d), view.size)
                assert np.abs(picture - truth).max() < TEXTURE_FLOAT32


def test_six_faces_have_no_crack_and_no_pixel_twice(warp, rng):
    """One colour all around the eye: every pixel of every wall has it, whatever its direction."""
    volume = Volume(np.ones((9, 8, 7), np.uint8), world_from_object=random_pose(rng, shear=0.3))
    constant = np.array([0.3, 0.2, 0.1, 0.6], np.float32)
    for _ in range(12):
        eye = volume.centre + rng.uniform(-1, 1, 3)
        rotation = random_rotation(rng)
        walls = [
            Wall(
                *(eye + rotation @ np.roll(c, axis) * sign for c in ((-1, -1, 1), (1, -1, 1), (-1, 1, 1))),
                (61, 53),
            )
            for axis in range(3)
            for sign in (-1, 1)
        ]
        image = Renderer(volume, TF).composite(Eye(eye), walls)
        assert len(image.faces) == 6
        image.pixels[:] = constant
        warp.upload(image)
        for wall in walls:
            for depths in ({}, {"near": 0.1, "far": 100}):
                view = View(Eye(eye), wall)
                picture = drawn(lambda v=view, d=depths: warp.draw_view(v, **d), view.size)
                assert np.abs(picture - constant).max() < TEXTURE_CONSTANT


def test_of_several_faces_each_shows_its_own_rays_only(warp, volume):
    """Where a face ends and no other begins, nothing is shown, whatever its margin holds; as in software."""
    for towards in DIRECTIONS[:3]:
        view = view_of(volume, towards, 0.1, fovy=40, size=(64, 48))
        wide = view_of(volume, towards, 0.1, fovy=140, size=(64, 48))
        renderer = Renderer(volume, TF, Settings(single_face_tangent=1))
        image = renderer.composite(view.eye, [view.wall])
        image.pixels[:] = 1
        truth = renderer.warp(image, wide)
        assert len(image.faces) > 1
        assert 0.02 < truth[..., 3].mean() < 0.9
        warp.upload(image)
        error = np.abs(drawn(lambda v=wide: warp.draw_view(v), wide.size) - truth).max(-1)
        assert (error > TEXTURE_FLOAT32).sum() <= 1  # a ray may lie on a face's edge but for rounding


def test_depths_are_not_written(warp, volume):
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    warp.upload(image)
    clip = view.clip_from_world(0.1, 500)
    sheet = facing_sheet(view, volume.centre - max(volume.extent) * DIRECTIONS[0])

    def scene():
        warp.draw(clip)
        warp.draw_picture(truth, -0.5)
        draw_triangles(sheet, clip, OPAQUE)

    assert (drawn(scene, view.size) == np.float32(OPAQUE)).all()


@pytest.mark.parametrize("distance, single", [(1.7, 3), (1.1, 1)])
def test_polygons_that_hug_the_volume_hide_it_or_are_behind_it(warp, volume, distance, single):
    """In front on every ray or behind on every ray, though they are nowhere parallel to a slice or a wall."""
    for towards in DIRECTIONS:
        view = view_of(volume, towards, distance, fovy=60, size=(64, 48))
        image, truth = pictures(volume, view, single_face_tangent=single)
        clip = view.clip_from_world(0.1, 500)
        _check_hugged(warp, view, image, truth, clip)


def test_polygons_before_and_behind_in_a_parallel_view(warp, volume):
    for towards in DIRECTIONS[:3]:
        view = View.parallel(volume.centre + towards, volume.centre, (0.1, 0.9, 0.3), 40, (64, 48))
        image, truth = pictures(volume, view)
        _check_hugged(warp, view, image, truth, view.clip_from_world(-200, 200))


def test_depth_is_half_way_through_what_is_shown(warp, volume):
    """A sheet across the volume: in front where it is nearer than the middle of the ray's piece."""
    for towards in DIRECTIONS:
        view = view_of(volume, towards, 1.4, fovy=40, size=(64, 48))
        image, truth = pictures(volume, view)
        clip = view.clip_from_world(0.1, 500)
        warp.upload(image)
        for share in (-0.3, -0.1, 0.0, 0.2):  # of the longest edge, from the middle
            sheet = facing_sheet(view, volume.centre + share * max(volume.extent) * towards)

            def scene(sheet=sheet, clip=clip):
                draw_triangles(sheet, clip, OPAQUE)
                warp.draw(clip)

            enter, leave = pieces(image, view)
            place = view.clip_from_world(0.1, 500)[3] @ np.append(
                sheet[0], 1
            )  # a part of the wall's distance
            ahead = place < (enter + leave) / 2
            clear = meets(image, view) & (np.abs(place - (enter + leave) / 2) > 1e-4)
            expected = np.where(ahead[..., None], np.float32(OPAQUE), over(truth, OPAQUE))
            assert clear.sum() > 100
            assert np.abs(drawn(scene, view.size) - expected)[clear].max() < TEXTURE_FLOAT32
        assert ahead[clear].any()


def test_depth_counts_what_clip_planes_leave(warp, volume):
    """Polygons where the volume was clipped away, close to the plane: before what is left, or behind it."""
    for towards in DIRECTIONS[:4]:
        view = view_of(volume, towards, 1.7, fovy=60, size=(64, 48))
        for side in (-1, 1):  # the farther part is left, or the nearer
            depth = side * 5
            plane = side * np.append(towards, -towards @ (volume.centre + depth * towards))
            image, truth = pictures(volume, view, Regions(clip=[plane]))
            assert len(image.half_spaces) == 1 and truth[..., 3].max() > 0.2
            warp.upload(image)
            clip = view.clip_from_world(0.1, 500)
            across = 100 * np.linalg.svd(towards[None])[2][1:]
            middle = volume.centre + (depth - 0.2 * side) * towards
            a, b, c, d = (middle + across.T @ uv for uv in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
            triangles = np.array([a, b, c, a, c, d])

            def scene(triangles=triangles, clip=clip):
                draw_triangles(triangles, clip, OPAQUE)
                warp.draw(clip)

            expected = np.broadcast_to(np.float32(OPAQUE), truth.shape) if side < 0 else over(truth, OPAQUE)
            met = meets(image, view)
            assert met.sum() > 100
            assert np.abs(drawn(scene, view.size) - expected)[met].max() < TEXTURE_FLOAT32


def test_depth_counts_what_the_near_distance_leaves(warp, volume):
    view = view_of(volume, DIRECTIONS[0], 0.3, fovy=60, size=(64, 48))
    near = 0.5 * max(volume.extent)
    view = View(Eye(view.eye.position, near), view.wall)
    image, truth = pictures(volume, view)
    assert truth[..., 3].max() > 0.2
    warp.upload(image)
    clip = view.clip_from_world(0.01, 500)
    sheet = facing_sheet(view, view.eye.position - 0.75 * near * DIRECTIONS[0], 0.4 * near)
    alone = drawn(lambda: draw_triangles(sheet, clip, OPAQUE), view.size)

    def scene():
        draw_triangles(sheet, clip, OPAQUE)
        warp.draw(clip)

    covered = alone[..., 3] == 1
    assert covered.sum() > 100 and (truth[covered, 3] > 0.05).any()
    np.testing.assert_array_equal(drawn(scene, view.size)[covered], alone[covered])


def _check_hugged(warp, view, image, truth, clip):
    warp.upload(image)
    met = meets(image, view)
    assert met.sum() > 100 and (truth[met, 3] > 0).mean() > 0.9
    for facing in (True, False):
        triangles = sides_towards(corners_of(image, 1.02), view.eye, facing=facing)
        alone = drawn(lambda t=triangles: draw_triangles(t, clip, OPAQUE), view.size)
        assert (alone[met, 3] == 1).all()

        def scene(triangles=triangles):
            draw_triangles(triangles, clip, OPAQUE)
            warp.draw(clip)

        expected = alone if facing else truth + (1 - truth[..., 3:]) * alone
        assert np.abs(drawn(scene, view.size) - expected)[met].max() < TEXTURE_FLOAT32


def test_a_software_picture_has_depth_too(warp, volume):
    """Both warps: an opaque polygon wholly in front hides the volume, one wholly behind shows through."""
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    clip = view.clip_from_world(0.1, 500)
    warp.upload(image)
    depth = image.clip_depth(clip)
    right, up = view.wall.lower_right - view.wall.lower_left, view.wall.upper_left - view.wall.lower_left
    for shift, hidden in ((1.0, True), (-1.0, False)):
        middle = volume.centre + shift * max(volume.extent) * DIRECTIONS[0]
        triangle = middle + np.array([-right, 2 * right - 0.3 * up, 2 * up])  # over a part of the volume
        alone = drawn(lambda t=triangle: draw_triangles(t, clip, OPAQUE), view.size)
        assert 0.1 < (alone[..., 3] * (truth[..., 3] > 0)).sum() / (truth[..., 3] > 0).sum() < 1
        expected = (
            np.where(alone[..., 3:] == 1, alone, truth) if hidden else truth + (1 - truth[..., 3:]) * alone
        )
        for draw in (lambda: warp.draw(clip), lambda: warp.draw_picture(truth, depth)):

            def scene(draw=draw, triangle=triangle):
                draw_triangles(triangle, clip, OPAQUE)
                draw()

            assert np.abs(drawn(scene, view.size) - expected).max() < TEXTURE_FLOAT32


def test_depths_may_run_from_zero_and_backwards(warp, volume):
    """A host with reversed depths, 1 near and 0 far, and a depth range of its own."""
    gl = opengl()
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    warp.upload(image)
    clip = view.clip_from_world(0.1, 500)
    clip[2] = (clip[3] - clip[2]) / 2  # z from w at the near plane to 0 at the far one
    corners = corners_of(image, 1.02)
    gl.glClipControl(gl.GL_LOWER_LEFT, gl.GL_ZERO_TO_ONE)
    gl.glDepthFunc(gl.GL_GREATER)
    gl.glDepthRange(0.2, 0.7)
    try:
        for facing in (True, False):
            triangles = sides_towards(corners, view.eye, facing=facing)
            target = Framebuffer(*view.size)
            target.clear(depth=0.2)
            draw_triangles(triangles, clip, OPAQUE)
            alone = target.read()
            warp.draw(clip)
            expected = alone if facing else truth + (1 - truth[..., 3:]) * alone
            assert np.abs(target.read() - expected)[meets(image, view)].max() < TEXTURE_FLOAT32
            target.close()
    finally:
        gl.glClipControl(gl.GL_LOWER_LEFT, gl.GL_NEGATIVE_ONE_TO_ONE)
        gl.glDepthFunc(gl.GL_LESS)
        gl.glDepthRange(0, 1)


def test_colours_are_blended_as_light(warp, volume):
    """FACTS of sRGB framebuffers: premultiplied 0.25 with alpha ½ over ½ is 0.5, which is 188 of 255."""
    gl = opengl()
    half = np.full((8, 8, 4), 0.25, np.float32)
    half[..., 3] = 0.5
    gl.glEnable(gl.GL_FRAMEBUFFER_SRGB)
    target = Framebuffer(8, 8, "srgb8")
    target.clear((0.5, 0.5, 0.5, 1))
    gl.glDisable(gl.GL_FRAMEBUFFER_SRGB)
    warp.draw_picture(half)
    assert (np.round(255 * target.read()[..., :3]) == 188).all()
    target.close()
    view = view_of(volume, DIRECTIONS[0], 0.2, fovy=60, size=(8, 8))
    image, _ = pictures(volume, view)
    image.pixels[:] = half[0, 0]
    warp.upload(image)
    target = Framebuffer(8, 8, "srgb8")
    gl.glEnable(gl.GL_FRAMEBUFFER_SRGB)
    target.clear((0.5, 0.5, 0.5, 1))
    gl.glDisable(gl.GL_FRAMEBUFFER_SRGB)
    warp.draw_view(view)
    assert (np.round(255 * target.read()[..., :3]) == 188).all()
    target.close()


def test_a_picture_is_shown_pixel_by_pixel_and_upright(warp, rng):
    picture = rng.random((37, 53, 4)).astype(np.float32)
    expected = over(picture, OPAQUE)
    got = drawn(lambda: warp.draw_picture(picture), (53, 37), OPAQUE)
    np.testing.assert_allclose(got, expected, atol=TEXTURE_CONSTANT)
    double = drawn(lambda: warp.draw_picture(picture), (106, 74), OPAQUE)
    np.testing.assert_allclose(double, expected.repeat(2, 0).repeat(2, 1), atol=TEXTURE_CONSTANT)


def test_an_eye_that_moved_sees_a_plane_in_the_volume(warp, volume):
    """A lone pixel of the image lies where its ray meets the quad, at the harmonic mean of the depths."""
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=50, size=(200, 150))
    image, _ = pictures(volume, view)
    face = image.faces[0]
    pixels = np.zeros_like(image.pixels)
    lone = EyeImage(image.eye, image.world_from_object, image.faces, pixels, 0, image.box)
    u, v = face.size[0] // 2 - 3, face.size[1] // 2 + 2
    lone.face_pixels(0)[v, u] = 1
    warp.upload(lone)
    eye = np.linalg.solve(image.world_from_object, [*view.eye.position, 1])[:3]
    depths = np.sort(face.sign * (image.box - eye)[:, face.axis])
    depth = 2 * depths.prod() / depths.sum()
    tangents = np.array(face.origin) + (np.array([u, v]) + 0.5) * face.pitch
    point = view.eye.position + image.world_from_tangents(0) @ (*tangents, 1) * depth
    for shift in (0, 0.5, -3):
        moved = View.look_at(
            view.eye.position + shift * np.array([0.4, 0.7, -0.3]), volume.centre, (0, 1, 0), 50, (200, 150)
        )
        picture = drawn(lambda m=moved: warp.draw_view(m), (200, 150))[..., 3]
        rows, columns = np.indices(picture.shape) + 0.5
        centroid = np.array([(columns * picture).sum(), (rows * picture).sum()]) / picture.sum()
        assert np.abs(centroid - moved.project(point)).max() < 0.06  # of a tent some 5 pixels wide


@pytest.mark.parametrize(
    "precision, bound", [("float32", 0.51 / 255), ("float16", TEXTURE_FLOAT16 + 0.51 / 255)]
)
def test_all_state_is_as_it_was(gl_context, volume, precision, bound):
    """Nor does odd state change the picture, here of 8 bits, which logic operations would."""
    warp = TextureWarp(precision)
    view = view_of(volume, DIRECTIONS[0], 0.9, fovy=80, size=(64, 48))
    image, truth = pictures(volume, view, single_face_tangent=1)
    clip = view.clip_from_world(0.1, 500)

    def draw_all():
        warp.upload(image)
        warp.draw(clip)
        warp.draw_view(view)
        warp.draw_picture(truth, 0.5)

    target = Framebuffer(*view.size, "rgba8")
    with _odd_state() as names:
        before = _state(names)
        draw_all()
        after = _state(names)
        target.clear()
        warp.draw(clip)
        picture = target.read()
    assert after == before
    assert np.abs(picture - truth).max() < bound
    target.close()
    warp.close()


def test_coverage_by_alpha_is_off(warp, volume):
    """A host that draws foliage on several samples a pixel would thin the volume out."""
    gl = opengl()
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    warp.upload(image)
    several, single = gl.glGenFramebuffers(1), Framebuffer(*view.size)
    colour = gl.glGenRenderbuffers(1)
    gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, colour)
    gl.glRenderbufferStorageMultisample(gl.GL_RENDERBUFFER, 4, gl.GL_RGBA32F, *view.size)
    gl.glBindFramebuffer(gl.GL_FRAMEBUFFER, several)
    place = gl.GL_FRAMEBUFFER, gl.GL_COLOR_ATTACHMENT0
    gl.glFramebufferRenderbuffer(*place, gl.GL_RENDERBUFFER, colour)
    assert gl.glCheckFramebufferStatus(gl.GL_FRAMEBUFFER) == gl.GL_FRAMEBUFFER_COMPLETE
    gl.glClearBufferfv(gl.GL_COLOR, 0, np.zeros(4, np.float32))
    gl.glEnable(gl.GL_SAMPLE_ALPHA_TO_COVERAGE)
    warp.draw_view(view)
    gl.glDisable(gl.GL_SAMPLE_ALPHA_TO_COVERAGE)
    single.bind()
    gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, several)
    whole = 0, 0, *view.size
    gl.glBlitFramebuffer(*whole, *whole, gl.GL_COLOR_BUFFER_BIT, gl.GL_NEAREST)
    error = np.abs(single.read() - truth)
    assert error[meets(image, view)].max() < TEXTURE_FLOAT32  # samples beyond the outline are not covered
    single.close()
    gl.glDeleteFramebuffers(1, [several])
    gl.glDeleteRenderbuffers(1, [colour])


# Everything that a draw call could depend on, switches apart.
_STATE = """
ACTIVE_TEXTURE ARRAY_BUFFER_BINDING BLEND_DST_ALPHA BLEND_DST_RGB BLEND_EQUATION_ALPHA
BLEND_EQUATION_RGB BLEND_SRC_ALPHA BLEND_SRC_RGB COLOR_WRITEMASK CULL_FACE_MODE CURRENT_PROGRAM
DEPTH_FUNC DEPTH_RANGE DEPTH_WRITEMASK DRAW_FRAMEBUFFER_BINDING ELEMENT_ARRAY_BUFFER_BINDING
FRONT_FACE LOGIC_OP_MODE PACK_ALIGNMENT PACK_ROW_LENGTH PIXEL_PACK_BUFFER_BINDING
PIXEL_UNPACK_BUFFER_BINDING POLYGON_MODE POLYGON_OFFSET_FACTOR READ_FRAMEBUFFER_BINDING
RENDERBUFFER_BINDING SAMPLER_BINDING SCISSOR_BOX TEXTURE_BINDING_2D TEXTURE_BINDING_2D_ARRAY
UNIFORM_BUFFER_BINDING UNPACK_ALIGNMENT UNPACK_IMAGE_HEIGHT UNPACK_LSB_FIRST UNPACK_ROW_LENGTH
UNPACK_SKIP_IMAGES UNPACK_SKIP_PIXELS UNPACK_SKIP_ROWS UNPACK_SWAP_BYTES VERTEX_ARRAY_BINDING
VIEWPORT
"""
_SWITCHES = """
BLEND COLOR_LOGIC_OP CULL_FACE DEPTH_CLAMP DEPTH_TEST DITHER FRAMEBUFFER_SRGB LINE_SMOOTH
MULTISAMPLE POLYGON_OFFSET_FILL PRIMITIVE_RESTART SAMPLE_ALPHA_TO_COVERAGE SAMPLE_COVERAGE
SCISSOR_TEST STENCIL_TEST
"""


def _state(units):
    gl = opengl()
    found = {name: np.ravel(gl.glGetFloatv(getattr(gl, f"GL_{name}"))).tolist() for name in _STATE.split()}
    found |= {name: bool(gl.glIsEnabled(getattr(gl, f"GL_{name}"))) for name in _SWITCHES.split()}
    active = gl.glGetIntegerv(gl.GL_ACTIVE_TEXTURE)
    for unit in units:
        gl.glActiveTexture(gl.GL_TEXTURE0 + unit)
        for name in ("TEXTURE_BINDING_2D", "TEXTURE_BINDING_2D_ARRAY", "SAMPLER_BINDING"):
            found[name, unit] = int(gl.glGetIntegerv(getattr(gl, f"GL_{name}")))
    gl.glActiveTexture(active)
    return found


class _odd_state:
    """State that no picture survives unless a renderer sets its own; back to the default in the end."""

    def __enter__(self):
        gl = opengl()
        self.textures = gl.glGenTextures(2)
        self.sampler = gl.glGenSamplers(1)
        self.sampler = int(np.ravel(self.sampler)[0])
        gl.glSamplerParameteri(self.sampler, gl.GL_TEXTURE_MIN_FILTER, gl.GL_NEAREST)
        gl.glSamplerParameteri(self.sampler, gl.GL_TEXTURE_MAG_FILTER, gl.GL_NEAREST)
        self.buffer = gl.glGenBuffers(1)
        self.vertex_array = gl.glGenVertexArrays(1)
        for unit in (0, 3):
            gl.glActiveTexture(gl.GL_TEXTURE0 + unit)
            gl.glBindTexture(gl.GL_TEXTURE_2D, self.textures[0])
            gl.glBindTexture(gl.GL_TEXTURE_2D_ARRAY, self.textures[1])
            gl.glBindSampler(unit, self.sampler)
        gl.glBindBuffer(gl.GL_PIXEL_UNPACK_BUFFER, self.buffer)
        gl.glBindVertexArray(self.vertex_array)
        self.unpack = {
            "ALIGNMENT": 8, "ROW_LENGTH": 77, "IMAGE_HEIGHT": 88, "SKIP_ROWS": 3, "SKIP_PIXELS": 5,
            "SKIP_IMAGES": 1, "SWAP_BYTES": 1, "LSB_FIRST": 1,
        }  # fmt: skip
        for name, value in self.unpack.items():
            gl.glPixelStorei(getattr(gl, f"GL_UNPACK_{name}"), value)
        for name in ("CULL_FACE", "COLOR_LOGIC_OP", "SAMPLE_ALPHA_TO_COVERAGE", "POLYGON_OFFSET_FILL"):
            gl.glEnable(getattr(gl, f"GL_{name}"))
        gl.glCullFace(gl.GL_FRONT_AND_BACK)
        gl.glLogicOp(gl.GL_CLEAR)
        gl.glPolygonMode(gl.GL_FRONT_AND_BACK, gl.GL_POINT)
        gl.glPolygonOffset(1e3, 1e6)
        gl.glBlendEquationSeparate(gl.GL_MIN, gl.GL_FUNC_REVERSE_SUBTRACT)
        gl.glBlendFuncSeparate(gl.GL_ZERO, gl.GL_DST_COLOR, gl.GL_ZERO, gl.GL_SRC_ALPHA)
        gl.glDepthFunc(gl.GL_NEVER)
        return (0, 3)

    def __exit__(self, *_):
        gl = opengl()
        for unit in (0, 3):
            gl.glActiveTexture(gl.GL_TEXTURE0 + unit)
            gl.glBindTexture(gl.GL_TEXTURE_2D, 0)
            gl.glBindTexture(gl.GL_TEXTURE_2D_ARRAY, 0)
            gl.glBindSampler(unit, 0)
        gl.glActiveTexture(gl.GL_TEXTURE0)
        gl.glBindBuffer(gl.GL_PIXEL_UNPACK_BUFFER, 0)
        gl.glBindVertexArray(0)
        for name in self.unpack:
            gl.glPixelStorei(getattr(gl, f"GL_UNPACK_{name}"), 4 if name == "ALIGNMENT" else 0)
        for name in ("CULL_FACE", "COLOR_LOGIC_OP", "SAMPLE_ALPHA_TO_COVERAGE", "POLYGON_OFFSET_FILL"):
            gl.glDisable(getattr(gl, f"GL_{name}"))
        gl.glCullFace(gl.GL_BACK)
        gl.glLogicOp(gl.GL_COPY)
        gl.glPolygonMode(gl.GL_FRONT_AND_BACK, gl.GL_FILL)
        gl.glPolygonOffset(0, 0)
        gl.glBlendEquation(gl.GL_FUNC_ADD)
        gl.glBlendFunc(gl.GL_ONE, gl.GL_ZERO)
        gl.glDepthFunc(gl.GL_LESS)
        gl.glDeleteTextures(self.textures)
        gl.glDeleteSamplers(1, [self.sampler])
        gl.glDeleteBuffers(1, [self.buffer])
        gl.glDeleteVertexArrays(1, [self.vertex_array])


def test_contexts_that_share_draw_one_upload(gl_context, volume):
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    with TextureWarp() as warp:
        warp.upload(image)
        first = drawn(lambda: warp.draw_view(view), view.size)
        with OffscreenContext(share=gl_context):
            second = drawn(lambda: warp.draw_view(view), view.size)
        gl_context.make_current()
        third = drawn(lambda: warp.draw_view(view), view.size)
        for picture in (first, second, third):
            assert np.abs(picture - truth).max() < TEXTURE_FLOAT32
        with OffscreenContext(), pytest.raises(GraphicsError, match="another OpenGL context"):
            warp.draw_view(view)
        gl_context.make_current()


def test_a_slot_for_each_eye_and_its_memory_used_again(warp, volume):
    views = [view_of(volume, towards, 1.7, fovy=60, size=(64, 48)) for towards in DIRECTIONS[:2]]
    made = [pictures(volume, view) for view in views]
    for name, (image, _) in zip("ab", made, strict=True):
        warp.upload(image, name)
    for name, view, (_, truth) in zip("ab", views, made, strict=True):
        picture = drawn(lambda v=view, n=name: warp.draw_view(v, n), view.size)
        assert np.abs(picture - truth).max() < TEXTURE_FLOAT32
    texture = warp._slots["a"].textures[0]
    for towards in (*DIRECTIONS, DIRECTIONS[0]):
        view = view_of(volume, towards, 1.7, fovy=60, size=(64, 48))
        image, truth = pictures(volume, view)
        warp.upload(image, "a")
        assert np.abs(drawn(lambda v=view: warp.draw_view(v, "a"), view.size) - truth).max() < TEXTURE_FLOAT32
    warp.upload(made[0][0], "a")
    again = warp._slots["a"].textures[0]
    warp.upload(made[0][0], "a")
    assert warp._slots["a"].textures[0] is again
    assert texture.precision == "float32"


def test_close_deletes_what_was_made(gl_context, volume):
    gl = opengl()
    view = view_of(volume, DIRECTIONS[0], 0.9, fovy=80, size=(64, 48))
    image, truth = pictures(volume, view, single_face_tangent=1)
    target = Framebuffer(*view.size)
    target.clear()
    kinds = gl.glIsTexture, gl.glIsProgram, gl.glIsShader, gl.glIsVertexArray, gl.glIsBuffer

    def alive():
        return [{n for n in range(1, 2000) if exists(n)} for exists in kinds]

    before = alive()
    warp = TextureWarp()
    warp.upload(image, "left")
    warp.upload(image, "right")
    warp.draw_view(view, "left")
    warp.draw(view.clip_from_world(1, 100), "right")
    warp.draw_picture(truth)
    warp.draw_picture(truth[1:], 0.1)
    made = alive()
    assert [len(m - b) for m, b in zip(made, before, strict=True)] == [3, 4, 0, 0, 0]
    warp.close()
    assert alive() == before
    warp.close()
    target.close()


def test_nothing_is_drawn_of_nothing(warp, volume):
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    behind = view_of(volume, -DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, _ = pictures(volume, view)
    warp.upload(EyeImage(image.eye, image.world_from_object, (), np.empty((0, 4), np.float32), 0))
    assert (drawn(lambda: warp.draw_view(view), view.size, OPAQUE) == np.float32(OPAQUE)).all()
    warp.upload(image)
    away = View.look_at(view.eye.position, view.eye.position + DIRECTIONS[0], (0, 1, 0), 60, (64, 48))
    assert (drawn(lambda: warp.draw_view(away), view.size, OPAQUE) == np.float32(OPAQUE)).all()
    flat = np.zeros((4, 4))
    assert (drawn(lambda: warp.draw(flat), view.size, OPAQUE) == np.float32(OPAQUE)).all()
    assert behind.size == view.size


def test_an_image_whose_depth_is_unknown_is_in_front(warp, volume):
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    clip = view.clip_from_world(0.1, 500)
    unknown = EyeImage(image.eye, image.world_from_object, image.faces, image.pixels, 0)
    assert unknown.clip_depth(clip) == -1
    within = view_of(volume, DIRECTIONS[0], 0.2).clip_from_world(0.1, 500)
    assert image.clip_depth(within) == -1 < image.clip_depth(clip) < 1
    warp.upload(unknown)
    target = Framebuffer(*view.size)
    target.clear(depth=0.0)
    warp.draw(clip)
    assert np.abs(target.read() - truth).max() < TEXTURE_FLOAT32
    target.close()


def test_mistakes_are_named(warp, volume):
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image, truth = pictures(volume, view)
    with pytest.raises(ViewError, match="slot 'left'"):
        warp.draw_view(view, "left")
    warp.upload(image)
    for matrix in (np.eye(3), "camera", np.full((4, 4), np.nan)):
        with pytest.raises(ViewError, match="clip_from_world"):
            warp.draw(matrix)
    with pytest.raises(ViewError, match="picture"):
        warp.draw_picture(truth[..., :3])
    with pytest.raises(GraphicsError, match="precision"):
        TextureWarp("float64")
    with pytest.raises(GraphicsError, match="kind"):
        Framebuffer(4, 4, "float64")


def test_without_a_context_it_says_so(gl_context, volume):
    image, _ = pictures(volume, view_of(volume, DIRECTIONS[0]))
    gl_context.release()
    with pytest.raises(GraphicsError, match="no OpenGL context is current"):
        TextureWarp().upload(image)
