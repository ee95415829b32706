"""The texture warp draws eye images and slabs for moved eyes as the software warp does."""

import numpy as np
import pytest
from gl_context import draw_triangles
from moved_eyes import coloured_noise, composited, moved
from test_texture_warp import OPAQUE, drawn, facing_sheet
from tolerances import TEXTURE_FLOAT32
from views import DIRECTIONS, random_rotation, view_of

from persp_sw import TextureWarp
from persp_sw.warp.context import opengl
from persp_sw.warp.software import warp_eye_image

pytestmark = pytest.mark.gl


@pytest.fixture
def volume(rng):
    return coloured_noise(rng)


@pytest.mark.parametrize("distance, single, faces", [(1.7, 3, 1), (0.9, 1, 3), (0.2, 3, 5)])
@pytest.mark.parametrize("slabs", [0, 1, 4])
def test_the_texture_warp_draws_the_same_for_moved_eyes(
    gl_context, volume, rng, distance, single, faces, slabs
):
    counts = set()
    with TextureWarp() as texture:
        for towards in DIRECTIONS[:4]:
            view = view_of(volume, towards, distance, fovy=100 if distance < 1 else 60, size=(90, 70))
            image = composited(volume, view, single_face_tangent=single, depth_slabs=slabs)
            counts.add(len(image.faces))
            texture.upload(image)
            for size in (0.0, 0.3, 4.0):
                other = moved(view, random_rotation(rng)[0] * size)
                truth = warp_eye_image(image, other)
                assert truth[..., 3].max() > 0.3
                error = np.abs(drawn(lambda v=other: texture.draw_view(v), view.size) - truth).max(-1)
                # A ray may lie on an edge of a face or of a picture but for rounding.
                assert (error > (1 + slabs) * TEXTURE_FLOAT32).sum() <= 2, error.max()
    assert max(counts) == faces


def test_polygons_before_and_behind_slabs(gl_context, volume):
    """Every slab asks the depth buffer: a sheet in front hides all of them, one behind shines through all."""
    view = view_of(volume, DIRECTIONS[0], 1.7, fovy=60, size=(64, 48))
    image = composited(volume, view, depth_slabs=4)
    other = moved(view, (1.5, -1, 0.5))
    truth = warp_eye_image(image, other)
    clip = other.clip_from_world(0.1, 500)
    with TextureWarp() as texture:
        texture.upload(image)
        for side, expected in (
            (1, np.float32(OPAQUE)),
            (-1, truth + (1 - truth[..., 3:]) * np.float32(OPAQUE)),
        ):
            sheet = facing_sheet(view, volume.centre + side * max(volume.extent) * DIRECTIONS[0])

            def scene(sheet=sheet):
                draw_triangles(sheet, clip, OPAQUE)
                texture.draw(clip)

            assert np.abs(drawn(scene, view.size) - expected).max() < 5 * TEXTURE_FLOAT32


def test_textures_of_slabs_are_used_again_and_go_when_there_are_fewer(gl_context, volume):
    view = view_of(volume, DIRECTIONS[0], 1.7, size=(64, 48))
    images = [composited(volume, view, depth_slabs=count) for count in (4, 2, 0)]
    gl = opengl()
    with TextureWarp() as texture:
        texture.upload(images[0])
        held = texture._slots[""].textures
        names = [each.name for each in held]
        texture.upload(images[0])
        assert texture._slots[""].textures == held and len(held) == 5
        for image in images[1:]:
            texture.upload(image)
            kept = 1 + len(image.slabs)
            assert [bool(gl.glIsTexture(name)) for name in names] == [n < kept for n in range(5)]
            for shift in ((0, 0, 0), (2, 1, 0)):
                other = moved(view, shift)
                truth = warp_eye_image(image, other)
                picture = drawn(lambda v=other: texture.draw_view(v), view.size)
                assert np.abs(picture - truth).max() < 3 * TEXTURE_FLOAT32
    assert not any(gl.glIsTexture(name) for name in names)
