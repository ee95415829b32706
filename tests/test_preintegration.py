"""The pre-integrated mode: closed forms, its twin, both kernels, its order, and what it promises."""

import numpy as np
import pytest
import twins
from test_composite import DTYPES, composite, order_of, samples_in_packet, smooth_volume
from tolerances import CLOSED_FORM, COMPOSITE_TWIN, PREINTEGRATED_COLOUR, PREINTEGRATED_KERNELS
from views import DIRECTIONS, direction, face_view, view_of

from persp_sw import Regions, TransferFunction, View, Volume, reference
from persp_sw._jit import VECTORS
from persp_sw.kernels import packet_preintegrated_portable as portable
from persp_sw.kernels.packet import SCRATCH
from persp_sw.kernels.packet_preintegrated_portable import STEPS
from persp_sw.kernels.state import SECOND, SECTIONS, TILE, VALUE
from persp_sw.kernels.tables import IntegralTable
from persp_sw.measure.exact import Slab
from persp_sw.optics.classification import Classification
from persp_sw.volume.levels import STANDARD_AXES, standard_rows

SPIKES = TransferFunction(
    [(40, (1, 0, 0), 0), (90, (0.2, 0.4, 0.9), 0.4), (95, (0, 1, 0), 0), (150, (1, 0.7, 0.4), 0.2)], 1.0
)


# --- The table --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", DTYPES)
def test_differences_of_sums_are_means_of_rows(dtype, rng):
    classification = Classification.of(SPIKES, smooth_volume(dtype=dtype))
    table, integrals = classification.table.astype(float), classification.integrals
    for _ in range(200):
        a, b = np.sort(rng.integers(0, len(table), 2))
        mean = (table[a : b + 1, :3] * table[a : b + 1, 3:]).mean(0), table[a : b + 1, 3].mean()
        sums = integrals.sums[b + 1].astype(float) - integrals.sums[a]
        assert np.abs(sums * integrals.unit / (b + 1 - a) - np.hstack(mean)).max() <= 1.001 * integrals.unit
    invisible = table[:, 3] == 0
    assert (
        np.diff(integrals.sums[: integrals.end + 1], axis=0)[invisible] == 0
    ).all() and invisible.sum() > 1
    assert integrals.unit <= 2e-6 * classification.largest_extinction
    assert integrals.sums.nbytes <= 5 * 2**14 + 64
    # The even steps: where so much extinction is passed, on the sums' own polygon.
    even = integrals.sums[integrals.end + 1 :].astype(float)
    rows = integrals.sums[: integrals.end + 1].astype(float)
    np.testing.assert_allclose(even[:, 3], rows[-1, 3] * np.arange(STEPS + 1) / STEPS, atol=1)
    at = np.searchsorted(rows[:, 3], even[1:-1, 3])
    low, high = rows[at - 1], rows[at]
    share = ((even[1:-1, 3] - low[:, 3]) / (high[:, 3] - low[:, 3]))[:, None]
    np.testing.assert_allclose(even[1:-1], low + share * (high - low), atol=2)


# --- Exact ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 2, 4])
@pytest.mark.parametrize("distance", [0.7, 1.7])
def test_homogeneous_box_is_exact_where_crop_and_clip_planes_cut_intervals(samples, distance):
    slab = Slab(size=(9, 12, 7), opacity=0.3)
    cuts = Regions(crop=(1.3, 6.8, 0, 9.25, 0.5, 5.1), clip=[(0.3, -0.5, 0.8, -1.1), (-1, 0, 0, 6.1)])
    for towards in DIRECTIONS:
        view = view_of(slab.volume, towards, distance)
        for regions in (Regions(), cuts):
            image = composite(
                slab.volume, slab.transfer, view, regions, samples_per_interval=samples, preintegrated=True
            )
            for number in range(len(image.faces)):
                expected = slab.image(face_view(image, number), regions)
                assert np.abs(image.face_pixels(number) - expected).max() < CLOSED_FORM


def test_a_linear_field_is_exact_but_for_the_table_however_sharp_the_function():
    """The scalar is linear on every piece; a spike a tenth of a voxel's step wide weighs what it should."""
    x = np.arange(9, dtype=np.float32)
    volume = Volume(np.broadcast_to(x[:, None, None], (9, 9, 9)).copy())
    spike = TransferFunction([(3.2, (1, 1, 1), 0), (3.25, (1, 1, 1), 0.99), (3.3, (1, 1, 1), 0)], 1.0)
    view = view_of(volume, direction(0.1, 0.05, 1), fovy=10)
    image = composite(volume, spike, view, preintegrated=True, level_of_detail=False)
    values = np.linspace(3.2, 3.3, 20001)
    depth = spike.extinction(values).mean() * 0.1
    face = image.faces[0]
    t = (np.array([face.size[0], face.size[1]]) // 2 + 0.5) * face.pitch + face.origin
    pixel = image.face_pixels(0)[face.size[1] // 2, face.size[0] // 2]
    expected = -np.expm1(-depth * np.sqrt(1 + t @ t))
    assert expected > 0.05
    assert pixel[3] == pytest.approx(expected, rel=1e-3)


# --- The plain twin, and both kernels ---------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 2, 4])
@pytest.mark.parametrize("dtype", DTYPES)
def test_every_pixel_equals_the_plain_twin(dtype, samples):
    volume = smooth_volume((6, 5, 7), dtype)
    regions = Regions(crop=(0.4, 5.5, 0, 4, 0.6, 5), clip=[(0.2, 0.3, -1, 3.4)])
    for towards in DIRECTIONS[:5]:
        view = view_of(volume, towards, distance=1.5, size=(10, 8))
        mode = {"samples_per_interval": samples, "preintegrated": True, "single_face_tangent": 8}
        assert_equals_twin(composite(volume, SPIKES, view, regions, **mode), volume, regions, samples)


def test_twin_with_the_eye_inside():
    volume = smooth_volume((6, 5, 7), np.float32)
    for towards in DIRECTIONS[:5]:
        view = view_of(volume, towards, distance=0.21, size=(10, 8), fovy=70)
        image = composite(volume, SPIKES, view, preintegrated=True, samples_per_interval=1)
        if len(image.faces) == 1:  # pixels on seams are the mean of two
            assert_equals_twin(image, volume, Regions(), 1)


def assert_equals_twin(image, volume, regions, samples):
    classification = Classification.of(SPIKES, volume)
    low, high = regions.box(volume)
    eye = np.linalg.solve(volume.world_from_object, (*image.eye.position, 1))[:3]
    for number, face in enumerate(image.faces):
        axes = list(STANDARD_AXES[face.axis])
        linear = volume.world_from_object[:3, axes]
        pixels = image.face_pixels(number)
        assert pixels.max() > 0.1
        for v, u in np.ndindex(pixels.shape[:2]):
            t = np.array(face.origin) + (np.array([u, v]) + 0.5) * face.pitch
            expected = twins.preintegrated_pixel(
                standard_rows(volume, face.axis),
                (*eye[axes], face.sign, *t, 0.0),
                np.column_stack([low, high])[axes].ravel(),
                regions.half_spaces(volume)[:, [*axes, 3]],
                linear.T @ linear,
                samples_in_packet(face, u, v, samples),
                classification.table,
                classification.origin,
                classification.scale,
            )
            error = np.abs(pixels[v, u] - expected)
            assert error[3] < COMPOSITE_TWIN, (face, u, v)
            assert error[:3].max() < PREINTEGRATED_COLOUR, (face, u, v)


@pytest.mark.skipif(not VECTORS, reason="the vector kernels are not in use here")
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("width", [20, 60])
def test_vector_kernels_equal_the_portable_ones(dtype, width, rng):
    from persp_sw.kernels import packet_preintegrated_vector as vector

    classification = Classification.of(SPIKES, smooth_volume(dtype=dtype))
    integrals = classification.integrals
    table = IntegralTable(
        integrals.sums,
        integrals.beyond,
        np.float32(classification.origin),
        np.float32(classification.scale),
        np.float32(integrals.end),
        np.float32(integrals.unit),
        np.float32(integrals.steps),
    )
    voxels = rng.integers(0, 120, 800).astype(dtype)
    f = np.float32
    x, step, end = f(-0.7), f((width - 3) / 15), f(width - 1)
    path = tuple(f(p) for p in (-0.4, 0.05, 0.3, -1.0, 3.1, 2.6, 3.6))
    start = rng.uniform(0, 0.3, TILE * SECTIONS).astype(f)
    start[TILE * 4 : TILE * 5], start[TILE * 5 : TILE * 6] = rng.uniform(2.4, 2.8, 16), rng.uniform(3, 4, 16)
    start[TILE * 7 : TILE * 8] = 0.995
    slots = np.array([[2.6, 3.6, 1, 0], [3.6, 4.6, 0.7, 0.02]], f)
    results = []
    for kernels in (portable, vector):
        lanes, scratch, cells = start.copy(), np.empty(SCRATCH, f), np.empty(TILE, np.int32)
        for section, first in ((VALUE, 0), (SECOND, 100)):
            kernels.sample(
                TILE, width, voxels, first, first + 100, first + 200, first + 300, f(0.3), f(0.5), x, step,
                f(0), f(width - 1), end, f(2), end, path, table, scratch, cells, lanes, 0, section,
            )  # fmt: skip
        kernels.blend(TILE, table, slots, scratch, cells, lanes, 0)
        results.append(lanes)
    one, other = results
    assert np.isnan(one[TILE * 8]) and np.isfinite(one[TILE * 8 : TILE * 9]).sum() > 8
    np.testing.assert_array_equal(np.isnan(one), np.isnan(other))
    apart = np.abs(one - other).reshape(-1, TILE)
    there = ~np.isnan(one.reshape(-1, TILE))
    for section, end_section in ((8, 10), (9, 11)):  # a rounding may fall on the next row
        assert apart[[section, end_section]][:, there[section]].max() <= 1
    assert np.abs(one[: TILE * 4] - other[: TILE * 4]).max() < PREINTEGRATED_KERNELS
    assert np.abs(one[: TILE * 4] - start[: TILE * 4]).max() > 0.02


# --- Order ------------------------------------------------------------------------------------------------


def test_order_in_slice_spacing_where_samples_alone_have_first():
    """A smooth field on finer and finer grids; what is seen begins within a fraction of a step.

    A ray that leaves a cell of i or j within a piece keeps that cell's slope, so the ends of neighbouring
    pieces differ by O(h²): the order is near 2 in the mean, and lower in the rms of few rays.
    """
    errors = {False: [], True: []}
    sharp = TransferFunction([(0.55, (0.1, 0.5, 1), 0), (0.551, (0.1, 0.5, 1), 0.5)], 1.0)
    for n in (9, 17, 33, 65):
        h = 8 / (n - 1)
        z, y, x = np.indices((n, n, n)) * h
        data = 0.5 + 0.04 * (z - 4) + 0.05 * np.sin(0.7 * x + 0.3) * np.cos(0.5 * y) + 0.05 * np.sin(0.9 * z)
        volume = Volume(data.astype(np.float32), (h, h, h))
        narrow = view_of(volume, direction(0.2, 0.15, 1), distance=1.2, fovy=15, size=(16, 16))
        for preintegrated, found in errors.items():
            image = composite(volume, sharp, narrow, samples_per_interval=1, preintegrated=preintegrated)
            truth = reference.render(volume, sharp, face_view(image, 0))
            found.append(np.sqrt(np.mean((image.face_pixels(0) - truth) ** 2)))
    assert order_of(errors[True]) > 1.3
    assert order_of(errors[False]) < 1.2
    assert (np.array(errors[True]) < 0.02 * np.array(errors[False])).all()


# --- The promise ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("function", ["linear", "sharp"])
def test_a_bright_voxel_keeps_its_integrated_brightness_at_a_quarter_quality(function, rng):
    """Mean over shifts of the eye by parts of a voxel, four voxels a pixel.

    Coarser levels keep the mean of values, so of a function that is not linear the finest level is asked.
    """
    data = np.zeros((33, 33, 33), np.uint8)
    data[16, 16, 16] = 255
    volume = Volume(data)
    white = (1, 1, 1)
    opacities = {"linear": [(0, 0), (255, 0.02)], "sharp": [(100, 0), (110, 0.05), (120, 0)]}[function]
    transfer = TransferFunction([(value, white, opacity) for value, opacity in opacities], 1.0)
    sums = []
    for shift in rng.uniform(-2, 2, (150, 2)):
        towards = direction(0.1, 0.05, 1)
        centre = volume.centre + (*shift, 0)
        view = View.look_at(centre + 96 * towards, centre, (0, 1, 0), 20, (48, 48))
        modes = [
            {"quality": 0.25, "preintegrated": True, "level_of_detail": function == "linear"},
            {"quality": 2, "samples_per_interval": 4},
        ]
        images = [composite(volume, transfer, view, **mode) for mode in modes]
        sums.append([image.pixels[:, 3].sum() * image.faces[0].pitch ** 2 for image in images])
    coarse, fine = np.mean(sums, axis=0)
    assert coarse == pytest.approx(fine, rel=0.1)


def test_what_a_surface_hides_within_a_piece_does_not_colour_it():
    """A step within one voxel from nothing to opaque; red just behind it, then blue. Seen from either side.

    The closed form: on the way the scalar grows evenly, so the colour is the mean over values v of the two
    colours with weight τ·exp(−∫τ).
    """
    data = np.zeros((3, 3, 12), np.uint8)
    data[:, :, 6:] = 200
    volume = Volume(data)
    points = [(80, (1, 0, 0), 0), (80, (1, 0, 0), 1), (110, (1, 0, 0), 1), (110, (0, 0, 1), 1)]
    transfer = TransferFunction([*points, (255, (0, 0, 1), 1)], 1.0)
    for towards, expected in (((-1, 0.02, 0.01), (1, 0, 0)), ((1, 0.02, 0.01), (0, 0, 1))):
        view = view_of(volume, direction(*towards), fovy=2, size=(9, 9))
        image = composite(volume, transfer, view, preintegrated=True)
        pixel = image.face_pixels(0)[image.faces[0].size[1] // 2, image.faces[0].size[0] // 2]
        # 30 of 200 values are a seventh of the piece: 13.8 / 7 ≈ 2 optical depths are red, exp(−2) behind.
        red = 1 - np.exp(-transfer.extinction(100.0) * 30 / 200 * np.linalg.norm(towards))
        colour = np.array([red, 0, 1 - red]) if expected[0] else np.array(expected)
        assert np.abs(pixel[:3] - colour).max() < np.exp(-2)  # two optical depths are looked at, no more
        assert pixel[3] > 0.995
