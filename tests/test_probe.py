"""Rays of marks and picks against plain numpy, closed forms, surfaces in known places and the reference."""

from __future__ import annotations

import numpy as np
import pytest
from tolerances import (
    PROBE_EDGES,
    PROBE_GRADIENTS,
    PROBE_PIECES,
    PROBE_SMOOTH,
    PROBE_SURFACE,
    PROBE_TABLE,
    PROBE_TWIN,
    ROUNDING,
)
from views import DIRECTIONS, random_pose

import persp_sw as psw
from persp_sw.errors import SettingsError, ViewError
from persp_sw.kernels.march import GRADIENT, composite_rays, hit_rays
from persp_sw.probe import Probe
from persp_sw.volume.phantoms import constant, linear, paraboloid, synthetic_ct

SOLID = 1 - 1e-6
HALF_WAY = np.log(2) / -np.log(1e-6)  # voxels of the most opaque there is, after which half is hidden
FOG = psw.TransferFunction([(0, (1, 0.5, 0.2), 0.3)], 1.0)
SMOOTH = psw.TransferFunction([(0, (0.2, 0.3, 0.8), 0), (200, (1, 0.6, 0.3), 0.3)], 1.0)


def surface(value: float) -> psw.TransferFunction:
    """Nothing below a value, as opaque as can be from it on."""
    return psw.TransferFunction([(value, (1, 1, 1), 0), (value, (0.9, 0.4, 0.1), 1)], 1.0)


# --- The kernels against plain numpy ------------------------------------------------------------------------


def interpolated(voxels, points):
    """Trilinear values at (n, 3) points xyz, clamped to the box."""
    size = np.array(voxels.shape[::-1])
    points = np.clip(points, 0, size - 1)
    cell = np.minimum(points.astype(int), size - 2)
    share, total = points - cell, 0.0
    for x, y, z in np.ndindex(2, 2, 2):
        corner = cell + (x, y, z)
        weight = np.prod(np.where((x, y, z), share, 1 - share), -1)
        total = total + weight * voxels[corner[:, 2], corner[:, 1], corner[:, 0]].astype(float)
    return total


def mean_row(rows, one, other):
    """Mean of a table's rows, the first and last without an end, between two places in it, by overlaps."""
    low, high = min(one, other), max(one, other)
    begins = np.append(-np.inf, np.arange(1.0, len(rows)))
    ends = np.append(np.arange(1.0, len(rows)), np.inf)
    if high - low < 1e-6:
        return rows[np.clip(int(np.floor(one)), 0, len(rows) - 1)]
    return np.clip(np.minimum(ends, high) - np.maximum(begins, low), 0, None) @ rows / (high - low)


def pieces_of(voxels, rows, origin, scale, parts, ray, step):
    """(distance, length, extinction · colour, extinction) of all pieces of a ray, front to back."""
    for part in parts:
        heights, rises = part[:, :3] @ ray[:3] + part[:, 3], part[:, :3] @ ray[3:6]
        near = max([ray[6], *(-heights / rises)[rises > 0]])
        far = min([ray[7], *(-heights / rises)[rises < 0]])
        if far <= near:
            continue
        at = np.linspace(near, far, int(np.ceil((far - near) / step)) + 1)
        values = interpolated(voxels, ray[:3] + at[:, None] * ray[3:6])
        places = (values - origin) * scale + 0.5
        for n in range(len(at) - 1):
            if np.isfinite(places[n : n + 2]).all():
                yield at[n], at[n + 1] - at[n], mean_row(rows, *places[n : n + 2])


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.float32])
def test_composited_rays_are_plain_numpys(rng: np.random.Generator, dtype: type):
    voxels = rng.uniform(0, 200, (5, 6, 7)).astype(dtype)
    if dtype is np.float32:
        voxels[2, 3, 3] = np.nan
    rows = rng.uniform(0, 1, (40, 4)) * rng.integers(0, 2, (40, 1))
    sums = np.concatenate([np.zeros((1, 4)), np.cumsum(rows, 0)])
    box = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, -1, 0, 5], [0, 0, -1, 4.0]])
    parts = [np.vstack([box, [-1, 0, 0, 2.4]]), np.vstack([box, [1, 0, 0, -3.3], [-1, 0, 0, 6]])]
    rays = np.empty((50, 8))
    rays[:, :3] = rng.uniform(-3, 1, (50, 3))
    rays[:, 3:6] = rng.uniform(0.1, 1, (50, 3))
    rays[:, 6], rays[:, 7] = 0.3, rng.uniform(1, 12, 50)
    ends, out = np.cumsum([len(part) for part in parts]), np.empty((50, 4))
    composite_rays(
        voxels, sums[None], 30.0, 0.2, np.zeros(GRADIENT), np.concatenate(parts), ends, rays, 0.4, 0.0, out
    )
    seen = 0
    for ray, ours in zip(rays, out, strict=True):
        colour, clear = np.zeros(3), 1.0
        for _, length, (*glow, extinction) in pieces_of(voxels, rows, 30.0, 0.2, parts, ray, 0.4):
            if extinction > 0:
                alpha = 1 - np.exp(-extinction * length)
                colour += clear * alpha * np.array(glow) / extinction
                clear *= 1 - alpha
        seen += clear < 0.9
        np.testing.assert_allclose(ours, [*colour, 1 - clear], atol=PROBE_TWIN)
    assert seen > 20


def test_hits_are_where_plain_numpy_reaches_the_threshold(rng: np.random.Generator):
    voxels = rng.uniform(90, 110, (5, 6, 7)).astype(np.float32)
    rows = rng.uniform(0, 1, (40, 4))
    sums = np.concatenate([np.zeros((1, 4)), np.cumsum(rows, 0)])
    part = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [-1, 0, 0, 6], [0, -1, 0, 5], [0, 0, -1, 4.0]])
    rays = np.empty((50, 8))
    rays[:, :3], rays[:, 6:] = rng.uniform(-3, 1, (50, 3)), (0, np.inf)
    rays[:, 3:6] = rng.uniform(0.1, 1, (50, 3))
    out = np.empty((50, 3))
    hit_rays(voxels, sums[None], 30.0, 0.2, np.zeros(GRADIENT), part, np.array([6]), rays, 0.4, 0.6, out)
    found = ~np.isnan(out[:, 0])
    assert 20 < found.sum() < 50
    for ray, (distance, value, opacity) in zip(rays, out, strict=True):
        fine = list(pieces_of(voxels, rows, 30.0, 0.2, [part], ray, 0.001))
        depth = np.cumsum([row[3] * length for _, length, row in fine]) if fine else [0.0]
        beyond = np.flatnonzero(1 - np.exp(-np.array(depth)) >= 0.6)
        if not len(beyond):
            assert np.isnan(distance)
            continue
        assert distance == pytest.approx(fine[beyond[0]][0], abs=PROBE_PIECES)
        at = ray[:3] + distance * ray[3:6]
        assert value == pytest.approx(interpolated(voxels, at[None])[0], abs=PROBE_TWIN * 1e3)
        assert opacity == 0.6


# --- What lies in front -------------------------------------------------------------------------------------


@pytest.mark.parametrize("pose", range(3))
@pytest.mark.parametrize("share", [-0.3, 0.0, 0.4, 1.0, 1.7])
def test_a_homogeneous_medium_in_front_of_a_point_is_exact(rng: np.random.Generator, pose: int, share: float):
    """Eyes outside and inside; points before the box, in it and behind it."""
    for _ in range(pose):
        rng.normal(size=30)
    volume = constant((12, 14, 10), 1.0, random_pose(rng, spacing=(1, 0.7, 1.3), shear=0.2 * pose))
    probe = Probe(volume, FOG, residual=0)
    corner = np.array(volume.size) - 1.0
    matrix = volume.world_from_object
    start, end = (
        matrix[:3, :3] @ p + matrix[:3, 3] for p in (corner * (0, 0.4, 0.5), corner * (1, 0.7, 0.3))
    )
    way = end - start
    for eye in (start - 1.5 * way, start + 0.25 * way):
        point = start + share * way
        if (point - eye) @ way <= 0:
            continue
        inside = [np.clip((p - start) @ way / (way @ way), 0, 1) for p in (eye, point)]
        depth = -np.log(0.7) * np.linalg.norm(way) * (inside[1] - inside[0])
        expected = -np.expm1(-depth) * np.array([1, 0.5, 0.2, 1])
        np.testing.assert_allclose(probe.in_front(psw.Eye(eye), point), expected, atol=ROUNDING)


def test_near_distances_and_parallel_eyes(rng: np.random.Generator):
    volume = constant((11, 11, 11), 1.0)
    probe = Probe(volume, FOG, residual=0)
    tau = -np.log(0.7)
    seen = probe.in_front(psw.Eye((-5, 5, 5), near=7), [(6, 5, 5), (1, 5, 5)])
    np.testing.assert_allclose(seen[:, 3], [-np.expm1(-4 * tau), 0], atol=ROUNDING)
    seen = probe.in_front(psw.Eye.at_infinity((0, 0, 1)), [(5, 5, 8), (5, 5, 20), (5, 5, -3), (-1, 5, 0)])
    np.testing.assert_allclose(seen[:, 3], -np.expm1(-tau * np.array([2, 0, 10, 0])), atol=ROUNDING)


@pytest.mark.parametrize("towards", DIRECTIONS[:4])
def test_what_is_in_front_is_the_references_picture_cut_at_the_point(towards: np.ndarray):
    volume = synthetic_ct(24)
    regions = psw.Regions(crop=(2, 20, 0, 23, 3, 23), clip=[(0.3, 0.2, 1, -8)], cut=[
        {"plane": (1, 0, 0.2, -12), "thickness": 3, "show": "outside"}
    ])  # fmt: skip
    probe = Probe(volume, SMOOTH, regions, residual=0)
    eye = volume.centre + 40 * towards
    for point in volume.centre + np.array([(0, 0, 0), (5, -3, 4), (-30 * towards)]):
        way = (point - eye) / np.linalg.norm(point - eye)
        before = psw.Regions(
            regions.crop, [*regions.clip, (*-way, way @ point)], regions.cut, regions.crop_flags
        )
        up = np.eye(3)[np.argmin(np.abs(way))]
        view = psw.View.look_at(eye, point, up, 1.0, (1, 1))
        truth = psw.reference.render(volume, SMOOTH, view, regions=before)[0, 0]
        np.testing.assert_allclose(probe.in_front(psw.Eye(eye), point), truth, atol=PROBE_EDGES)
        assert truth[3] > 0.05


def test_finer_steps_come_nearer_to_the_reference():
    """Order 2: where the value is smooth, half the step leaves a quarter of the error."""
    z, y, x = np.indices((24, 24, 24))
    data = 100 + 90 * np.sin(x / 4) * np.cos(y / 5) * np.sin(z / 6 + 1)
    volume = psw.Volume(data.astype(np.float32))
    view = psw.View.look_at((60, 50, 40), volume.centre, (0, 1, 0), 1.0, (1, 1))
    truth = psw.reference.render(volume, SMOOTH, view, tolerance=1e-9)[0, 0]
    steps = np.array([4.0, 2.0, 1.0])
    point = volume.centre - 50 * (view.eye.position - volume.centre) / np.linalg.norm(
        view.eye.position - volume.centre
    )
    errors = [
        np.abs(Probe(volume, SMOOTH, step=step, residual=0).in_front(view.eye, point) - truth).max()
        for step in steps
    ]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope > 1.5
    assert errors[-1] < PROBE_SMOOTH


# --- First hits ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("towards", DIRECTIONS)
def test_a_flat_surface_is_hit_where_it_is(rng: np.random.Generator, towards: np.ndarray):
    pose = random_pose(rng, spacing=(1, 1.5, 0.8))
    volume = linear((20, 16, 18), -7.0, (0.5, 0.25, 0.375), pose)
    probe = Probe(volume, surface(0.0))
    origin = volume.centre + 40 * towards
    pick = probe.first_hit(origin, -3 * towards)
    start = np.linalg.inv(pose)[:3] @ (*origin, 1)
    way = np.linalg.inv(pose)[:3, :3] @ -towards
    gradient = np.array([0.5, 0.25, 0.375])
    rise = gradient @ way
    sides = np.sort([-start / way, (np.array(volume.size) - 1 - start) / way], 0)
    entry = sides[0].max()
    expected = entry if rise < 0 else max(entry, (7.0 - gradient @ start) / rise)
    expected += HALF_WAY
    assert pick.distance == pytest.approx(expected, abs=PROBE_SURFACE)
    np.testing.assert_allclose(pick.position_world, origin - pick.distance * towards, atol=1e-9)
    inverse = np.linalg.inv(pose)
    np.testing.assert_allclose(
        pick.position_object, inverse[:3, :3] @ pick.position_world + inverse[:3, 3], atol=1e-9
    )
    assert pick.value == pytest.approx(gradient @ pick.position_object - 7, abs=1e-5)
    assert pick.opacity == 0.5


def test_a_ball_is_hit_on_its_surface(rng: np.random.Generator):
    """Interpolation lowers r² by ¾ at most, which brings the surface in by ¾ / 2r / cos of the slant."""
    radius = 12.0
    volume = paraboloid((40, 40, 40), radius)
    probe = Probe(volume, surface(0.0))
    for _ in range(50):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        across = np.cross(direction, rng.normal(size=3))
        off = rng.uniform(0, 0.7) * radius * across / np.linalg.norm(across)
        pick = probe.first_hit(volume.centre + off - 50 * direction, direction)
        chord = np.sqrt(radius**2 - off @ off)
        error = pick.distance - (50 - chord)
        assert -PROBE_SURFACE <= error - HALF_WAY <= 0.75 / 2 / chord + PROBE_SURFACE


@pytest.mark.parametrize("threshold", [0.2, 0.5, 0.8])
def test_hits_in_fog_and_structure_are_the_references(threshold: float):
    """The reference's opacity, cut at the distance that we tell, is the threshold."""
    volume = synthetic_ct(32)
    transfer = psw.TransferFunction([(40, (1, 1, 1), 0), (160, (1, 0.8, 0.6), 0.5)], 1.0)
    probe = Probe(volume, transfer)
    view = psw.View.look_at(volume.centre + (30, -45, 20), volume.centre, (0, 0, 1), 40, (12, 9))
    found = 0
    for row, column in np.ndindex(9, 12):
        pick = probe.pick(view, (column + 0.5, row + 0.5), threshold)
        way = view.directions()[row, column] / np.linalg.norm(view.directions()[row, column])
        whole = psw.View.look_at(view.eye.position, view.eye.position + 60 * way, (0, 0, 1), 1, (1, 1))
        if pick is None:
            assert psw.reference.render(volume, transfer, whole)[0, 0, 3] < threshold + PROBE_EDGES
            continue
        found += 1
        np.testing.assert_allclose(pick.position_world, view.eye.position + pick.distance * way, atol=1e-9)
        cut = psw.Regions(clip=[(*-way, way @ pick.position_world)])
        opacity = psw.reference.render(volume, transfer, whole, regions=cut)[0, 0, 3]
        assert opacity == pytest.approx(threshold, abs=PROBE_EDGES)
    assert found > 10


def test_a_thin_shell_between_two_samples_is_not_missed():
    volume = linear((16, 16, 40), 0.0, (0, 0, 8.0))
    shell = psw.TransferFunction(
        [(101.9, (1, 1, 1), 0), (101.9, (1, 1, 1), SOLID), (102.1, (1, 1, 1), SOLID), (102.1, (1, 1, 1), 0)],
        0.001,
    )
    pick = Probe(volume, shell).first_hit((8, 8, -10), (0, 0, 1))
    assert pick.distance == pytest.approx(10 + 102 / 8, abs=PROBE_SURFACE)


def test_what_is_not_shown_is_not_hit():
    volume = constant((20, 20, 20), 1.0)
    solid = psw.TransferFunction([(0, (1, 1, 1), 1)], 1.0)

    def hit(regions: psw.Regions, **options: float) -> float | None:
        pick = Probe(volume, solid, regions).first_hit((-10, 9, 9), (1, 0, 0), **options)
        return None if pick is None else pick.distance - HALF_WAY

    assert hit(psw.Regions()) == pytest.approx(10, abs=PROBE_TABLE)
    assert hit(psw.Regions(crop=(4, 19, 0, 19, 0, 19))) == pytest.approx(14, abs=PROBE_TABLE)
    assert hit(psw.Regions(clip=[(1, 0, 0, -7)])) == pytest.approx(17, abs=PROBE_TABLE)
    hole = {"plane": (1, 0, 0, -2), "thickness": 5, "show": "outside"}
    assert hit(psw.Regions(cut=[hole])) == pytest.approx(14.5, abs=PROBE_TABLE)
    assert hit(psw.Regions(crop=(4, 9, 0, 19, 0, 19), crop_flags=0x7FFFFFF ^ 0x0002000)) == pytest.approx(10)
    assert hit(psw.Regions(crop=(0, 19, 0, 8, 0, 19))) is None
    assert hit(psw.Regions(), near=13) == pytest.approx(13, abs=PROBE_TABLE)
    assert hit(psw.Regions(), far=10.01) is None
    clear = psw.TransferFunction([(0, (1, 1, 1), 0.01)], 1.0)
    assert Probe(volume, clear).first_hit((-10, 9, 9), (1, 0, 0)) is None


def test_cells_without_a_value_are_transparent():
    data = np.full((12, 12, 12), 100.0, np.float32)
    data[:, :, 4] = np.nan
    probe = Probe(psw.Volume(data), FOG, residual=0)
    seen = probe.in_front(psw.Eye((-5, 5.5, 5.5)), [(30, 5.5, 5.5)])[0, 3]
    tau = -np.log(0.7)
    depths = np.array([11 - 2 - 2 * probe.step, 11 - 2])
    assert -np.expm1(-tau * depths[0]) <= seen <= -np.expm1(-tau * depths[1]) + ROUNDING


def test_picks_of_parallel_views_count_from_the_wall():
    volume = constant((20, 20, 20), 1.0)
    view = psw.View.parallel((9.5, 9.5, 60), volume.centre, (0, 1, 0), 40, (20, 20))
    pick = Probe(volume, surface(0.5)).pick(view, (8.5, 9.0))
    # The wall stands in the middle; the face that is seen is 9.5 before it.
    assert pick.distance == pytest.approx(-9.5 + HALF_WAY, abs=PROBE_TABLE)
    np.testing.assert_allclose(pick.position_world, (6.5, 11.5, 19 - HALF_WAY), atol=1e-9)
    assert Probe(volume, surface(0.5)).pick(view, (1, 1)) is None


def test_a_volume_one_voxel_thick_shows_nothing():
    probe = Probe(psw.Volume(np.ones((1, 5, 5), np.float32)), FOG)
    assert probe.first_hit((2, 2, -5), (0, 0, 1), threshold=0.01) is None
    assert probe.in_front(psw.Eye((2, 2, -5)), (2, 2, 5)).max() == 0


def test_a_renderers_probe_sees_what_it_shows_now():
    renderer = psw.Renderer(constant((8, 8, 8), 1.0), FOG)
    renderer.regions = psw.Regions(crop=(3, 7, 0, 7, 0, 7))
    renderer.transfer = surface(0.5)
    pick = psw.Probe.of(renderer).first_hit((-10, 4, 4), (1, 0, 0))
    assert pick.distance == pytest.approx(13 + HALF_WAY, abs=PROBE_TABLE)


def test_bad_numbers_are_refused():
    probe = Probe(constant((4, 4, 4), 1.0), FOG)
    with pytest.raises(ViewError, match="direction is not zero"):
        probe.first_hit((0, 0, 0), (0, 0, 0))
    with pytest.raises(ViewError, match="points are finite"):
        probe.in_front(psw.Eye((0, 0, 9)), [(0, np.nan, 0)])
    with pytest.raises(SettingsError, match="threshold"):
        probe.first_hit((0, 0, 9), (0, 0, 1), threshold=1.0)
    for options in ({"step": 0.0}, {"residual": 0.7}, {"threads": 10**6}):
        with pytest.raises(SettingsError):
            Probe(probe.volume, FOG, **options)


@pytest.mark.parametrize("side", [-1, 1])
def test_parts_are_met_front_to_back_from_infinity_too(side: int):
    """Two solid halves of two colours, parted by a slab that is not shown, on the far side of the world."""
    data = np.repeat(np.repeat([[[10.0]], [[20.0]]], 12, 1), 12, 2).repeat(6, 0).astype(np.float32)
    pose = np.eye(4)
    pose[2, 3] = -100.0
    volume = psw.Volume(data, world_from_object=pose)
    two = psw.TransferFunction([(10, (1, 0, 0), 1), (15, (1, 0, 0), 1), (15, (0, 1, 0), 1)], 1.0)
    gap = {"plane": (0, 0, 1, 94.5), "thickness": 3, "show": "outside"}
    probe = Probe(volume, two, psw.Regions(cut=[gap]))
    seen = probe.in_front(psw.Eye.at_infinity((0, 0, side)), (5, 5, -94.5 - 50 * side))
    np.testing.assert_allclose(seen[:2], (0, 1) if side > 0 else (1, 0), atol=probe.residual)
    view = psw.View.parallel((5, 5, -94.5 + side), (5, 5, -94.5), (0, 1, 0), 10, (4, 4))
    assert probe.pick(view, (2, 2)).value == (20 if side > 0 else 10)


BOX = psw.TransferFunction2D([psw.Box((60, 180), (3, 30), (0.9, 0.5, 0.2), 0.4, 1.0)], 1.0)
STRONG = psw.Look(modulation=psw.Modulation(0.02, 0.2, 0.9, 0.6))


@pytest.mark.parametrize(
    ("transfer", "look"),
    [
        (BOX, psw.Look()),
        (SMOOTH, STRONG),
        (BOX, psw.Look(modulation=psw.Modulation(0.0, 0.15), gradient_distance=2.0)),
    ],
)
def test_what_depends_on_gradients_does_so_in_front_of_points_too(transfer, look: psw.Look):
    """Against the reference cut at the point, in a smooth volume of skew and unequal axes."""
    z, y, x = np.indices((20, 20, 20))
    data = 100 + 90 * np.sin(x / 4) * np.cos(y / 5) * np.sin(z / 6 + 1)
    pose = np.array([[1, 0.2, 0, 3], [0, 1.3, 0.1, -4], [0, 0, 0.8, 5], [0, 0, 0, 1.0]])
    volume = psw.Volume(data.astype(np.float32), world_from_object=pose)
    probe = Probe(volume, transfer, None, look, residual=0)
    plain = Probe(volume, transfer if transfer is BOX else SMOOTH, residual=0)
    different = 0.0
    for towards in DIRECTIONS[:4]:
        eye = volume.centre + 40 * towards
        for point in volume.centre + np.array([(2, -3, 1), -30 * towards]):
            way = (point - eye) / np.linalg.norm(point - eye)
            view = psw.View.look_at(eye, point, np.eye(3)[np.argmin(np.abs(way))], 1.0, (1, 1))
            before = psw.Regions(clip=[(*-way, way @ point)])
            truth = psw.reference.render(volume, transfer, view, regions=before, look=look, tolerance=1e-4)
            found = probe.in_front(view.eye, point)
            np.testing.assert_allclose(found, truth[0, 0], atol=PROBE_GRADIENTS)
            different = max(different, np.abs(found - plain.in_front(view.eye, point)).max())
            pick = probe.first_hit(eye, way, threshold=0.3)
            if pick is not None:
                cut = psw.Regions(clip=[(*-way, way @ pick.position_world)])
                at = psw.reference.render(volume, transfer, view, regions=cut, look=look, tolerance=1e-4)
                assert at[0, 0, 3] == pytest.approx(0.3, abs=PROBE_GRADIENTS)
    assert different > 0.1 or look.is_plain


def test_a_renderers_probe_has_its_look():
    renderer = psw.Renderer(constant((8, 8, 8), 150.0), SMOOTH, look=STRONG)
    assert psw.Probe.of(renderer).in_front(psw.Eye((4, 4, -5)), (4, 4, 20))[3] < 0.2
    renderer.look = None
    assert psw.Probe.of(renderer).in_front(psw.Eye((4, 4, -5)), (4, 4, 20))[3] > 0.7
