"""The compositing kernel: closed forms, its plain twin, invariants, and the order of convergence."""

import numpy as np
import pytest
import twins
from tolerances import CLOSED_FORM, COMPOSITE_TWIN, FLOAT32_IMAGE
from views import DIRECTIONS, direction, face_view, random_pose, view_of

from persp_sw import Eye, Regions, Renderer, Settings, TransferFunction, Volume, Wall, reference
from persp_sw.kernels.scanline import STEEP, TILE
from persp_sw.measure.exact import Slab
from persp_sw.optics.classification import Classification
from persp_sw.volume.levels import STANDARD_AXES, standard_rows
from persp_sw.volume.phantoms import synthetic_ct

DTYPES = [np.uint8, np.int16, np.uint16, np.float32]
HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (255, (1, 0.7, 0.4), 0.5)], 1.0)


def smooth_volume(shape=(9, 10, 11), dtype=np.uint8, **pose):
    z, y, x = np.indices(shape)
    data = 120 + 100 * np.sin(0.5 * x + 0.2) * np.cos(0.4 * y - 0.3) * np.sin(0.3 * z + 0.7)
    return Volume(data.astype(dtype), **pose)


def composite(volume, transfer, view, regions=None, **settings):
    renderer = Renderer(volume, transfer, Settings(residual=0, **settings), regions)
    return renderer.composite(view.eye, [view.wall])


def poses(rng):
    return {
        "identity": np.eye(4),
        "anisotropic": np.diag([1.0, 0.5, 3.0, 1.0]),
        "oblique": random_pose(rng, spacing=(0.7, 1.1, 0.9)),
        "mirrored": random_pose(rng, mirrored=True),
        "sheared": random_pose(rng, shear=0.4),
    }


# --- Exact ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pose", ["identity", "anisotropic", "oblique", "mirrored", "sheared"])
@pytest.mark.parametrize("distance", [0.7, 1.7, 40.0])
def test_homogeneous_box_equals_the_closed_form_everywhere(pose, distance, rng):
    """Sides and edges included: the range rule makes every pixel exact, whatever the eye."""
    slab = Slab(size=(9, 12, 7), pose=poses(rng)[pose], opacity=0.3)
    for towards in DIRECTIONS:
        view = view_of(slab.volume, towards, distance, fovy=60 if distance < 2 else 3)
        image = composite(slab.volume, slab.transfer, view)
        assert image.faces
        for number in range(len(image.faces)):
            expected = slab.image(face_view(image, number))
            assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM


@pytest.mark.parametrize("samples", [1, 2, 4])
def test_homogeneous_box_is_exact_where_crop_and_clip_planes_cut_intervals(samples):
    slab = Slab(size=(9, 12, 7), opacity=0.3)
    regions = Regions(crop=(1.3, 6.8, 0, 9.25, 0.5, 5.1), clip=[(0.3, -0.5, 0.8, -1.1), (-1, 0, 0, 6.1)])
    for towards in DIRECTIONS:
        view = view_of(slab.volume, towards)
        image = composite(slab.volume, slab.transfer, view, regions, samples_per_interval=samples)
        for number in range(len(image.faces)):
            expected = slab.image(face_view(image, number), regions)
            assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM


def test_the_near_distance_cuts_along_the_ray():
    slab = Slab(size=(9, 12, 7), opacity=0.3)
    view = view_of(slab.volume, DIRECTIONS[0])
    eye = Eye(view.eye.position, near=float(np.linalg.norm(slab.volume.centre - view.eye.position)))
    image = Renderer(slab.volume, slab.transfer, Settings(residual=0)).composite(eye, [view.wall])
    for number in range(len(image.faces)):
        expected = slab.image(face_view(image, number))
        assert expected.max() > 0.1
        assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM


@pytest.mark.parametrize("opacity", [1e-6, 1.0])
def test_faintest_and_strongest_opacity(opacity):
    slab = Slab(size=(9, 12, 7), opacity=opacity)
    image = composite(slab.volume, slab.transfer, view_of(slab.volume, DIRECTIONS[0]))
    expected = slab.image(face_view(image, 0))
    assert np.abs(image.face_pixels(0) - expected).max() < CLOSED_FORM * max(expected.max(), 1e-3)


# --- The plain twin ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 2, 4])
@pytest.mark.parametrize("dtype", DTYPES)
def test_every_pixel_equals_the_plain_twin(dtype, samples):
    volume = smooth_volume((6, 5, 7), dtype)
    regions = Regions(crop=(0.4, 5.5, 0, 4, 0.6, 5), clip=[(0.2, 0.3, -1, 3.4)])
    for towards in DIRECTIONS[:5]:
        view = view_of(volume, towards, distance=1.5, size=(10, 8))
        mode = {"samples_per_interval": samples, "single_face_tangent": 8}  # steep rays, too
        assert_equals_twin(composite(volume, HAZE, view, regions, **mode), volume, HAZE, regions, samples)


@pytest.mark.parametrize("shape", [(2, 2, 2), (2, 9, 3), (3, 2, 300), (40, 3, 2)])
def test_twin_for_small_and_long_volumes(shape):
    volume = Volume(np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8))
    view = view_of(volume, DIRECTIONS[1], distance=1.2, size=(6, 5))
    image = composite(
        volume, HAZE, view, samples_per_interval=1, single_face_tangent=8, level_of_detail=False
    )
    assert len(image.faces) == 1
    assert_equals_twin(image, volume, HAZE, Regions(), 1)


def samples_in_packet(face, u, v, least):
    """What the steepest ray of pixel (u, v)'s packet takes in a slice interval."""
    ends = face.origin[0] + (u // TILE + np.array([0, 1])) * TILE * face.pitch
    steepest = max(*np.abs(ends), abs(face.origin[1] + (v + 0.5) * face.pitch))
    return max(least, 4 if steepest > 2 * STEEP else 2 if steepest > STEEP else 1)


def assert_equals_twin(image, volume, transfer, regions, samples):
    classification = Classification.of(transfer, volume)
    low, high = regions.box(volume)
    eye = np.linalg.solve(volume.world_from_object, (*image.eye.position, 1))[:3]
    for number, face in enumerate(image.faces):
        axes = list(STANDARD_AXES[face.axis])
        linear = volume.world_from_object[:3, axes]
        pixels = image.face_pixels(number)
        for v, u in np.ndindex(pixels.shape[:2]):
            t = np.array(face.origin) + (np.array([u, v]) + 0.5) * face.pitch
            expected = twins.composite_pixel(
                standard_rows(volume, face.axis),
                (*eye[axes], face.sign, *t, 0.0),
                np.column_stack([low, high])[axes].ravel(),
                regions.half_spaces(volume)[:, [*axes, 3]],
                linear.T @ linear,
                samples_in_packet(face, u, v, samples),
                classification.table,
                classification.origin,
                classification.scale,
                0,
            )
            assert np.abs(pixels[v, u] - expected).max() < COMPOSITE_TWIN, (face, u, v)


# --- Relations --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("preintegrated", [False, True])
def test_skipping_changes_no_bit(dtype, samples, preintegrated):
    rng = np.random.default_rng(3)
    data = rng.integers(0, 60, (20, 24, 40))
    data[5:12, 8:15, 10:30] += 120
    data[rng.random(data.shape) < 0.01] = 200
    volume = Volume(data.astype(dtype))
    transfer = TransferFunction([(90, (1, 1, 1), 0), (120, (1, 0.5, 0), 0.9), (190, (0, 0, 1), 0)], 1.0)
    for towards in DIRECTIONS:
        view = view_of(volume, towards)
        mode = {"samples_per_interval": samples, "preintegrated": preintegrated}
        kept = composite(volume, transfer, view, **mode)
        # The same rectangle for both: what can be seen bounds it, so everything is asked for here.
        full = composite(volume, transfer, view, skip_empty=False, **mode)
        skipping = Renderer(volume, transfer, Settings(residual=0, **mode))
        skipping.runs._box = np.zeros(3), np.array(volume.size) - 1.0
        same = skipping.composite(view.eye, [view.wall])
        assert same.faces == full.faces
        np.testing.assert_array_equal(same.pixels, full.pixels)
        assert kept.samples < 0.7 * full.samples


@pytest.mark.parametrize("towards", DIRECTIONS[:3])
def test_threads_change_no_bit(towards):
    volume = synthetic_ct(40)
    view = view_of(volume, towards)
    one = composite(volume, HAZE, view, threads=1)
    two = composite(volume, HAZE, view, threads=2)
    np.testing.assert_array_equal(one.pixels, two.pixels)
    assert one.samples == two.samples


@pytest.mark.parametrize("axis", range(3))
def test_mirroring_the_volume_mirrors_the_image(axis):
    volume = smooth_volume((9, 10, 11))
    mirrored = Volume(np.ascontiguousarray(np.flip(volume.data, 2 - axis)))
    for towards in DIRECTIONS:
        flipped = towards.copy()
        flipped[axis] *= -1
        view, other = view_of(volume, towards), view_of(mirrored, flipped)
        one = {"single_face_tangent": 8}
        image, reflection = composite(volume, HAZE, view, **one), composite(mirrored, HAZE, other, **one)
        assert len(image.faces) == len(reflection.faces) == 1
        face = image.faces[0]
        pixels = reflection.face_pixels(0)
        if axis != face.axis:
            pixels = np.flip(pixels, 1 if STANDARD_AXES[face.axis][0] == axis else 0)
        assert np.abs(image.face_pixels(0) - pixels).max() < FLOAT32_IMAGE


@pytest.mark.parametrize("towards", DIRECTIONS[:5])
def test_permuting_the_axes_changes_no_bit(towards):
    """x, y, z → y, z, x: the standard space of the other axis is the same numbers."""
    volume = smooth_volume((9, 10, 11))
    turned = Volume(np.ascontiguousarray(volume.data.transpose(2, 0, 1)))
    order = [1, 2, 0]  # turned's x is the volume's y, and so on
    assert turned.size == tuple(np.array(volume.size)[order])
    view = view_of(volume, towards)
    wall = view.wall
    corners = [np.asarray(c)[order] for c in (wall.lower_left, wall.lower_right, wall.upper_left)]
    eye = Eye(view.eye.position[order])
    other = Renderer(turned, HAZE, Settings(residual=0)).composite(eye, [Wall(*corners, pixels=wall.pixels)])
    image = composite(volume, HAZE, view)
    for number, face in enumerate(image.faces):
        its = [(order[f.axis], f.sign) for f in other.faces].index((face.axis, face.sign))
        assert face.size == other.faces[its].size
        assert np.abs(image.face_pixels(number) - other.face_pixels(its)).max() < FLOAT32_IMAGE


def test_lengths_times_k_and_extinction_by_k_give_the_same_image():
    volume, k = smooth_volume(), 7.3
    larger = Volume(volume.data, (k, k, k))
    slower = TransferFunction(HAZE.points, opacity_unit=k)
    a = composite(volume, HAZE, view_of(volume, DIRECTIONS[0]))
    b = composite(larger, slower, view_of(larger, DIRECTIONS[0]))
    assert np.abs(a.pixels - b.pixels).max() < FLOAT32_IMAGE


def test_early_termination_errs_by_its_bound_and_saves_work():
    volume = synthetic_ct(48)
    view = view_of(volume, DIRECTIONS[0])
    transfer = TransferFunction([(0, (1, 1, 1), 0), (60, (1, 1, 1), 0.6), (255, (1, 1, 1), 0.9)], 1.0)
    full = Renderer(volume, transfer, Settings(residual=0)).composite(view.eye, [view.wall])
    early = Renderer(volume, transfer, Settings(residual=0.01)).composite(view.eye, [view.wall])
    assert np.abs(full.pixels - early.pixels).max() <= 0.01
    assert early.samples < full.samples


def test_front_over_back_is_the_whole():
    """A homogeneous medium cut by a clip plane: the halves, one OVER the other, are the whole."""
    slab = Slab(size=(9, 12, 7), opacity=0.3)
    view = view_of(slab.volume, direction(0.3, 0.2, 1))
    plane = np.array([1 / 8, -1 / 11, 0.1 / 6, -0.05])  # both halves reach to all sides: the same face
    whole = composite(slab.volume, slab.transfer, view)
    front = composite(slab.volume, slab.transfer, view, Regions(clip=[plane]))
    back = composite(slab.volume, slab.transfer, view, Regions(clip=[-plane]))
    assert whole.faces == front.faces == back.faces
    over = front.pixels + (1 - front.pixels[:, 3:]) * back.pixels
    assert np.abs(over - whole.pixels).max() < CLOSED_FORM


@pytest.mark.parametrize("settings", [{}, {"quality": 3}, {"quality": 0.3}, {"samples_per_interval": 4}])
@pytest.mark.parametrize("spacing", [(1, 1, 1), (2, 2, 2), (0.5, 1, 4)])
def test_opacity_does_not_depend_on_quality_spacing_or_view(settings, spacing):
    """The same world-sized homogeneous box, whatever grid it is sampled on and however it is rendered."""
    size = tuple(int(8 / s) + 1 for s in spacing)
    slab = Slab(size=size, pose=np.diag([*spacing, 1.0]), opacity=0.2)
    for towards in DIRECTIONS[:4]:
        view = view_of(slab.volume, towards, distance=1.4)
        image = composite(slab.volume, slab.transfer, view, **settings)
        for number in range(len(image.faces)):
            expected = slab.image(face_view(image, number))
            assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM


@pytest.mark.parametrize(("samples", "missed"), [(None, 2), (1, 1)])
def test_cells_with_a_nan_corner_are_transparent_and_the_rest_is_not_touched(samples, missed):
    data = np.full((8, 8, 8), 100, np.float32)
    data[4, 4, 4] = np.nan
    transfer = TransferFunction([(100, (1, 1, 1), 0.3)], 1.0)
    whole = Volume(np.full((8, 8, 8), 100, np.float32))
    view = view_of(whole, (0, 0, 1))
    volumes = Volume(data), whole
    holed, full = (composite(v, transfer, view, samples_per_interval=samples) for v in volumes)
    assert np.isfinite(holed.pixels).all()
    assert (holed.pixels <= full.pixels + FLOAT32_IMAGE).all()
    t = np.array(holed.faces[0].origin) + holed.faces[0].pitch / 2
    eye = holed.eye.position
    u, v = np.rint(((4 - eye[:2]) / (eye[2] - 4) - t) / holed.faces[0].pitch).astype(int)
    # The ray through the hole misses two cells of 2×2×2, or one plain sample's interval, and no more.
    alpha, lost = full.face_pixels(0)[v, u, 3], holed.face_pixels(0)[v, u, 3]
    assert 1 - (1 - alpha) / 0.7 ** (missed - 0.05) > lost > 1 - (1 - alpha) / 0.7 ** (missed + 0.1)
    assert (holed.pixels == full.pixels).all(1).mean() > 0.7


# --- Order ------------------------------------------------------------------------------------------------


def order_of(errors, refinement=2.0):
    steps = np.arange(len(errors))
    return -np.polyfit(steps, np.log(errors), 1)[0] / np.log(refinement)


def test_second_order_in_slice_spacing():
    """The same smooth field on finer and finer grids, rays fixed: midpoint samples converge with order 2."""
    errors = []
    transfer = TransferFunction([(0, (0.1, 0.5, 1), 0), (1, (1, 0.6, 0.2), 0.4)], 1.0)
    for n in (9, 17, 33, 65):
        h = 8 / (n - 1)
        z, y, x = np.indices((n, n, n)) * h
        data = 0.5 + 0.2 * np.sin(0.7 * x + 0.3) * np.cos(0.5 * y) + 0.2 * np.sin(0.9 * z + 0.4 * x)
        volume = Volume(data.astype(np.float32), (h, h, h))
        # So narrow that the view, not the volume, sets the pitch and the same rays are cast on every grid.
        narrow = view_of(volume, direction(0.2, 0.15, 1), distance=1.2, fovy=15, size=(16, 16))
        image = composite(volume, transfer, narrow, samples_per_interval=1)
        truth = reference.render(volume, transfer, face_view(image, 0))
        errors.append(np.sqrt(np.mean((image.face_pixels(0) - truth) ** 2)))
    assert image.faces[0].size[1] < 20
    assert order_of(errors) > 1.8
    assert errors[-1] < 5e-5


def test_order_in_samples_per_interval():
    """Steep extinction: two and four samples an interval reduce the error at least in proportion."""
    volume = synthetic_ct(32)
    transfer = TransferFunction([(60, (1, 1, 1), 0), (200, (1, 0.5, 0.2), 0.95)], 1.0)
    view = view_of(volume, DIRECTIONS[0])
    errors = []
    for samples in (1, 2, 4):
        image = composite(volume, transfer, view, samples_per_interval=samples, single_face_tangent=8)
        truth = reference.render(volume, transfer, face_view(image, 0))
        errors.append(np.sqrt(np.mean((image.face_pixels(0) - truth) ** 2)))
    assert order_of(errors) > 0.9


# --- Work -------------------------------------------------------------------------------------------------


def test_a_second_frame_compiles_nothing_and_the_work_is_what_is_visible():
    volume = synthetic_ct(32)
    renderer = Renderer(volume, HAZE)
    view = view_of(volume, DIRECTIONS[0])
    renderer.render(view)
    renderer.render(view)
    assert renderer.last["compile_ms"] == 0
    data = np.zeros((64, 64, 64), np.uint8)
    data[20:24, 20:24, 20:24] = 200
    small = Volume(data)
    view = view_of(small, DIRECTIONS[0])
    image = Renderer(small, HAZE).composite(view.eye, [view.wall])
    assert 0 < image.samples < 64**3 / 100
