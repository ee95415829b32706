"""The eye at infinity: which lines face pixels and view pixels stand for, and the reference along them."""

import numpy as np
import pytest
import twins
from tolerances import CLOSED_FORM, PICTURE_SURFACE_DB, ROUNDING, WARP_LINEAR
from views import DIRECTIONS, random_pose

from persp_sw import (
    Eye,
    EyeImage,
    Regions,
    Renderer,
    Settings,
    TransferFunction,
    View,
    Volume,
    Wall,
    reference,
)
from persp_sw.errors import SceneError, ViewError
from persp_sw.geometry.faces import EyeGeometry, faces_for, needs_of
from persp_sw.measure.exact import Slab
from persp_sw.measure.metrics import psnr
from persp_sw.optics.classification import Classification
from persp_sw.scene import Scene
from persp_sw.volume.levels import STANDARD_AXES, standard_rows
from persp_sw.warp.software import warp_eye_image

GOOD = {"eye": (0, 0, 5), "centre": (0, 0, 0), "up": (0, 1, 0), "height": 3, "size": (10, 8)}


def parallel_view(volume, towards, height=1.5, size=(32, 24)):
    up = (0, 1, 0) if abs(towards[1]) < 0.95 else (0, 0, 1)
    return View.parallel(volume.centre + towards, volume.centre, up, height * max(volume.extent), size)


def plan(volume, *views, quality=1.0, previous=()):
    inverse = np.linalg.inv(volume.world_from_object)
    eye = inverse[:3] @ (*views[0].eye.position, 0)
    geometry = EyeGeometry(eye, np.zeros(3), np.array(volume.size) - 1.0, views, inverse, 0.0, True)
    return faces_for(needs_of(geometry, 3, previous), quality=quality, max_size=4096)


def poses(rng):
    yield np.eye(4)
    yield random_pose(rng, spacing=(1, 2, 0.5))
    yield random_pose(rng, mirrored=True)
    yield random_pose(rng, shear=0.5)


# --- Views ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change, message",
    [
        ({"height": 0}, "height"),
        ({"height": np.nan}, "height"),
        ({"eye": (0, 0, 0)}, "same point"),
        ({"up": (0, 0, 1)}, "parallel to the line"),
        ({"size": (10, 0)}, "pixels"),
    ],
)
def test_impossible_views_are_refused(change, message):
    View.parallel(**GOOD)
    with pytest.raises(ViewError, match=message):
        View.parallel(**{**GOOD, **change})


def test_impossible_eyes_are_refused():
    for arguments in (((0, 0, 1), 0.0, 0.5), ((0, 0, 1), 1.0, 0.0), ((0, 0, 0), 0.0, 0.0)):
        with pytest.raises(ViewError):
            Eye(*arguments)
    wall = Wall((-1, -1, 0), (1, -1, 0), (-1, 1, 0), (4, 4))
    with pytest.raises(ViewError, match="edge-on"):
        View(Eye.at_infinity((1, 0, 0)), wall)


def test_rays_are_parallel_square_and_projected_back():
    view = View.parallel((3, 2, 9), (0.5, 0, 1), (0.1, 1, 0), 8, (32, 20))
    starts, directions = view.starts(), view.directions()
    assert np.ptp(directions, axis=(0, 1)).max() == 0
    np.testing.assert_allclose(np.linalg.norm(directions[0, 0]), 1)
    np.testing.assert_allclose(directions[0, 0], (np.array([0.5, 0, 1]) - (3, 2, 9)) / np.sqrt(74.25))
    steps = np.linalg.norm(starts[0, 1] - starts[0, 0]), np.linalg.norm(starts[1, 0] - starts[0, 0])
    np.testing.assert_allclose(steps, 8 / 20)
    column, row = np.meshgrid(np.arange(32) + 0.5, np.arange(20) + 0.5)
    for distance in (-7.0, 0.0, 2.7):
        at = view.project(starts + distance * directions)
        np.testing.assert_allclose(at, np.stack([column, row], -1), atol=1e-9)


def test_it_is_the_limit_of_perspective_from_far_away():
    centre, towards, up = np.array([3.0, 4, 5]), np.array([0.3, 0.5, 0.8]), (0, 1, 0)
    parallel = View.parallel(centre + towards, centre, up, 10, (16, 16))
    distance = 1e7 * np.linalg.norm(towards)
    far = View.look_at(centre + 1e7 * towards, centre, up, np.degrees(2 * np.arctan(5 / distance)), (16, 16))
    points = centre + np.random.default_rng(0).uniform(-4, 4, (50, 3))
    assert np.abs(parallel.project(points) - far.project(points)).max() < 1e-5


# --- Faces ------------------------------------------------------------------------------------------------


def test_every_ray_that_matters_is_covered(rng):
    for pose in poses(rng):
        volume = Volume(np.zeros((25, 30, 20), np.uint8), world_from_object=pose)
        inverse = np.linalg.inv(pose)
        for towards in DIRECTIONS:
            for height in (0.3, 1.5):
                view = parallel_view(volume, towards, height)
                (face,) = plan(volume, view)
                starts = view.starts().reshape(-1, 3) @ inverse[:3, :3].T + inverse[:3, 3]
                direction = inverse[:3, :3] @ view.directions()[0, 0]
                with np.errstate(divide="ignore"):
                    one, other = -starts / direction, (np.array(volume.size) - 1 - starts) / direction
                met = np.minimum(one, other).max(1) < np.maximum(one, other).min(1)
                assert met.any()
                i, j, k = STANDARD_AXES[face.axis]
                assert abs(direction[k]) == np.abs(direction).max()
                at_0 = (starts - starts[:, [k]] / direction[k] * direction)[met][:, [i, j]]
                u = (at_0 - face.origin) / face.pitch - 0.5
                assert (u >= 0).all() and (u <= np.array(face.size) - 1).all()


def test_face_pixels_are_the_lines_they_say(rng):
    """Face.rays, in object space, against the eye's direction, and the views' pixels that project there."""
    for pose in poses(rng):
        volume = Volume(np.zeros((25, 30, 20), np.uint8), world_from_object=pose)
        for towards in DIRECTIONS:
            view = parallel_view(volume, towards)
            (face,) = plan(volume, view)
            offset, offset_pitch, tangents, tangent_pitch, k_0 = face.rays(np.full(3, np.nan))
            assert (tangent_pitch, k_0) == (0, 0)
            axes = list(STANDARD_AXES[face.axis])
            u = np.array([3.5, 7.5])
            points = np.empty((2, 3))
            for n, k in enumerate((0.0, 17.0)):
                points[n, axes[:2]] = np.array(offset) + u * offset_pitch + np.array(tangents) * face.sign * k
                points[n, axes[2]] = k
            world = points @ pose[:3, :3].T + pose[:3, 3]
            np.testing.assert_allclose(*view.project(world), atol=1e-8)  # one line, one pixel
            along = (world[1] - world[0]) / np.linalg.norm(world[1] - world[0])
            ray = view.directions()[0, 0]
            np.testing.assert_allclose(along, ray * np.sign(along @ ray), atol=1e-9)
            assert face.sign == np.sign(np.linalg.solve(pose[:3, :3], ray)[face.axis])


def test_a_pixel_is_a_voxel_or_the_walls():
    volume = Volume(np.zeros((65, 65, 65), np.uint8), (2, 2, 2))
    magnified = parallel_view(volume, np.array([0, 0, 1.0]), 1.2, (400, 400))
    minified = parallel_view(volume, np.array([0, 0, 1.0]), 1.2, (20, 20))
    assert plan(volume, magnified)[0].pitch == 1
    assert plan(volume, magnified, quality=2)[0].pitch == 0.5
    assert plan(volume, minified)[0].pitch == pytest.approx(1.2 * 128 / 2 / 20)
    aside = View.parallel((1000, 0, 1), (1000, 0, 0), (0, 1, 0), 9, (8, 8))
    assert plan(volume, aside) == []


def test_the_axis_of_the_frame_before_stays_by_a_margin():
    volume = Volume(np.zeros((33, 33, 33), np.uint8))
    views = [
        parallel_view(volume, np.array(towards)) for towards in ((1, 0.98, 0), (0.98, 1, 0), (0.5, 1, 0))
    ]
    (first,), (second,), (third,) = (plan(volume, view) for view in views)
    assert [face.axis for face in (first, second, third)] == [0, 1, 1]
    assert plan(volume, views[1], previous=[first])[0].axis == 0
    assert plan(volume, views[2], previous=[first])[0].axis == 1


# --- Warp and images --------------------------------------------------------------------------------------


def eye_image(volume, view):
    faces = tuple(plan(volume, view))
    total = sum(face.size[0] * face.size[1] for face in faces)
    return EyeImage(view.eye, volume.world_from_object, faces, np.zeros((total, 4), np.float32), 0)


def test_every_pixel_looks_up_its_own_ray(rng):
    """A face that holds (i, j) of its rays on slice 0: bilinear look-up reproduces them."""
    for pose in poses(rng):
        volume = Volume(np.zeros((25, 30, 20), np.uint8), world_from_object=pose)
        for towards in DIRECTIONS:
            view = parallel_view(volume, towards)
            image = eye_image(volume, view)
            (face,) = image.faces
            u, v = np.meshgrid(*(np.arange(n) + 0.5 for n in face.size))
            i, j = face.origin[0] + u * face.pitch, face.origin[1] + v * face.pitch
            image.face_pixels(0)[:] = np.stack([i, j, 0 * i, 1 + 0 * i], -1)
            picture = warp_eye_image(image, view)
            shown = picture[..., 3] != 0
            assert shown.sum() > 50
            # The pixel's point on slice 0 projects to the pixel.
            world = np.dstack([picture[..., :2].astype(float), np.ones(shown.shape)]) @ (
                image.world_from_tangents(0).T
            )
            column, row = np.meshgrid(np.arange(32) + 0.5, np.arange(24) + 0.5)
            pixel = np.linalg.norm(view.wall.world_from_pixel[:, 0])
            voxels = np.abs(view.project(world) - np.stack([column, row], -1))[shown] * pixel
            assert voxels.max() < WARP_LINEAR * 100 * max(volume.spacing)  # float32 numbers up to 100
            other = EyeImage.from_bytes(image.to_bytes())
            assert other.faces == image.faces and other.eye.is_at_infinity
            np.testing.assert_array_equal(other.eye.position, image.eye.position)


@pytest.mark.parametrize("towards", DIRECTIONS[:4])
def test_compositing_along_the_faces_rays_meets_the_reference(towards):
    """The kernel's plain twin, ray by ray along `Face.rays`, then the warp."""
    z, y, x = np.indices((9, 10, 11))
    data = 120 + 100 * np.sin(0.5 * x + 0.2) * np.cos(0.4 * y - 0.3) * np.sin(0.3 * z + 0.7)
    volume = Volume(data.astype(np.float32), (1, 1.2, 0.8))
    transfer = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.2)], 1.0)
    classification = Classification.of(transfer, volume)
    view = parallel_view(volume, towards, size=(20, 15))
    image = eye_image(volume, view)
    (face,) = image.faces
    axes = list(STANDARD_AXES[face.axis])
    offset, offset_pitch, tangents, _, k_0 = face.rays(np.full(3, np.nan))
    linear = volume.world_from_object[:3, axes]
    high = np.array(volume.size)[axes] - 1.0
    pixels = image.face_pixels(0)
    for v, u in np.ndindex(pixels.shape[:2]):
        start = np.array(offset) + (np.array([u, v]) + 0.5) * offset_pitch
        pixels[v, u] = twins.composite_pixel(
            standard_rows(volume, face.axis),
            (*start, k_0, face.sign, *tangents, -np.inf),
            np.column_stack([np.zeros(3), high]).ravel(),
            Regions().half_spaces(volume)[:, [*axes, 3]],
            linear.T @ linear,
            4,
            classification.table,
            classification.origin,
            classification.scale,
            0,
        )
    truth = reference.render(volume, transfer, view)
    assert psnr(warp_eye_image(image, view), truth) > PICTURE_SURFACE_DB  # small: mostly silhouette


# --- Reference, scenes and what is refused ----------------------------------------------------------------


@pytest.mark.parametrize("kind", range(4))
def test_the_reference_casts_parallel_rays(kind, rng):
    """A homogeneous box in closed form: path lengths along one direction; in front of and behind the wall."""
    slab = Slab(size=(9, 12, 7), pose=list(poses(rng))[kind], opacity=0.2)
    for towards in DIRECTIONS:
        view = parallel_view(slab.volume, towards)
        image = reference.render(slab.volume, slab.transfer, view)
        assert image[..., 3].max() > 0.3
        assert np.abs(image - slab.image(view)).max() < ROUNDING
    along_x = View.parallel((99, 5.5, 3), (4, 5.5, 3), (0, 0, 1), 4, (5, 5))
    box = Slab(size=(9, 12, 7), opacity=0.2)
    np.testing.assert_allclose(reference.render(box.volume, box.transfer, along_x)[..., 3], 1 - 0.8**8)


def test_scenes_may_be_parallel(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros((8, 8, 8), np.uint8))
    keys = {"volume": "a.npy", "eye": [3, 4, 50], "centre": [3, 4, 4], "up": [0, 1, 0], "size": [8, 4]}
    view = Scene({**keys, "parallel_height": 6}, tmp_path).view()
    assert view.eye.is_at_infinity
    np.testing.assert_allclose(view.eye.position, (0, 0, 1))
    np.testing.assert_allclose(view.project(np.array([3.0, 7, 0])), (4, 0), atol=1e-12)
    np.testing.assert_allclose(view.project(np.array([9.0, 1, 9])), (8, 4), atol=1e-12)
    assert Scene({"volume": "a.npy", "parallel_height": 6}, tmp_path).view().eye.is_at_infinity
    with pytest.raises(SceneError, match="parallel_height"):
        Scene({**keys, "parallel_height": 6, "fovy": 30}, tmp_path)
    with pytest.raises(SceneError, match="parallel_height"):
        Scene({**keys, "parallel_height": 0}, tmp_path)


# --- Composited ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", range(4))
@pytest.mark.parametrize("samples", [1, 2])
def test_a_homogeneous_box_seen_from_infinity_is_exact(kind, samples, rng):
    slab = Slab(size=(9, 12, 7), pose=list(poses(rng))[kind], opacity=0.2)
    settings = Settings(residual=0, samples_per_interval=samples)
    for towards in DIRECTIONS:
        view = parallel_view(slab.volume, towards)
        image = Renderer(slab.volume, slab.transfer, settings).composite(view.eye, [view.wall])
        (face,) = image.faces
        pixels = image.face_pixels(0)
        axes = list(STANDARD_AXES[face.axis])
        direction = np.empty(3)
        direction[axes] = *face.parallel, face.sign
        world = slab.volume.world_from_object[:3, :3] @ direction
        v, u = np.indices(pixels.shape[:2]) + 0.5
        start = np.zeros((*v.shape, 3))
        start[..., axes[0]] = face.origin[0] + u * face.pitch
        start[..., axes[1]] = face.origin[1] + v * face.pitch
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = -start / direction, (np.array([8, 11, 6]) - start) / direction
        way = np.minimum.reduce(np.maximum(one, other), -1) - np.maximum.reduce(np.minimum(one, other), -1)
        way = np.maximum(way, 0) * np.linalg.norm(world)
        alpha = -np.expm1(-slab.transfer.extinction(slab.volume.data[0, 0, 0]) * way)
        assert alpha.max() > 0.3
        assert np.abs(pixels[..., 3] - alpha).max() < CLOSED_FORM


def test_a_picture_from_infinity_is_that_from_far_away():
    """Not bit for bit: the pixels lie elsewhere. The volume is clear at its sides, so both converge."""
    z, y, x = (np.linspace(-1, 1, n) for n in (20, 24, 28))
    hill = (1 - x**2) * (1 - y[:, None] ** 2) * (1 - z[:, None, None] ** 2)
    volume = Volume((200 * hill).astype(np.float32))
    transfer = TransferFunction([(0, (0.2, 0.5, 1), 0), (200, (1, 0.8, 0.3), 0.2)], 1.0)
    renderer = Renderer(volume, transfer, Settings(residual=0, quality=4))
    centre = volume.centre
    for towards in DIRECTIONS:
        direction = np.array(towards) / np.linalg.norm(towards)
        eye = centre + 1e6 * direction
        up = np.roll(direction, 1) + (0.1, 0.2, 0.3)
        height = 40.0
        far = View.look_at(eye, centre, up, np.degrees(2 * np.arctan(height / 2e6)), (64, 64))
        parallel = View.parallel(eye, centre, up, height, (64, 64))
        assert psnr(renderer.render(parallel), renderer.render(far)) > 60
