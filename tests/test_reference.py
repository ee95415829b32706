"""The reference against pictures known in closed form, a plain-numpy twin, and relations."""

import numpy as np
import pytest
from tolerances import (
    BALL_BOUND,
    BALL_ORDER,
    MARKER_PIXELS,
    MIDPOINT_KINKS,
    MIDPOINT_STEPS,
    REFERENCE_AT_1E_10,
    ROUNDING,
)

from persp_sw import reference
from persp_sw.errors import SettingsError
from persp_sw.geometry.regions import Regions
from persp_sw.geometry.view import View, Wall
from persp_sw.measure.exact import Ball, Markers, Ramp, Slab
from persp_sw.optics.transfer import TransferFunction
from persp_sw.volume.grid import Volume

SIZE = (24, 18)

_ROTATION = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
POSES = {
    "identity": np.eye(3),
    "anisotropic": np.diag([0.5, 1.0, 3.0]),
    "mirrored": np.diag([1.0, -1.2, 0.8]),
    "rotated": _ROTATION * np.sign(np.linalg.det(_ROTATION)),
    "sheared": np.array([[1.0, 0.4, -0.2], [0.0, 0.9, 0.3], [0.1, 0.0, 1.1]]),
}
EYES = {  # in units of the volume's half diagonal, from its centre
    "front": (0.3, 0.2, -2.5),
    "corner": (1.4, 1.3, 1.5),
    "far": (0.0, 300.0, 2.0),
    "on a diagonal": (2.0, 2.0, 2.0),
    "inside": (0.15, -0.1, 0.2),
    "centre": (0.0, 0.0, 0.0),
}


def pose_of(name):
    matrix = np.eye(4)
    matrix[:3, :3] = POSES[name]
    matrix[:3, 3] = (10, -20, 5)
    return matrix


def view_of(volume, eye="front", size=SIZE, near=0.0):
    radius = np.linalg.norm(volume.extent) / 2
    offset = np.array(EYES[eye]) if isinstance(eye, str) else np.array(eye)
    inside = np.linalg.norm(offset) < 1
    target = volume.centre + np.array([0.3, 0.1, 0.4]) if inside else volume.centre
    fovy = 80 if inside else 2 * np.degrees(np.arctan(1 / np.linalg.norm(offset)))
    return View.look_at(volume.centre + offset * radius, target, (0.1, 1, 0.05), fovy, size, near)


def noise(size=(9, 8, 7), seed=3, dtype=np.uint8):
    voxels = np.random.default_rng(seed).integers(0, 256, size[::-1])
    return Volume(voxels.astype(dtype), (1.0, 1.3, 0.8))


STEPS = TransferFunction(
    [
        (60, (1, 0, 0), 0.0),
        (90, (1, 0.5, 0), 0.3),
        (90, (0, 1, 0.2), 0.02),
        (150, (0.3, 0.4, 1), 0.1),
        (151, (1, 1, 0), 0.5),
        (200, (0.2, 0.2, 0.2), 0.0),
    ],
    1.0,
)
KINKS = TransferFunction([(40, (1, 0, 0), 0.0), (120, (0, 1, 0.3), 0.3), (255, (0.2, 0.3, 1), 0.1)], 1.0)


def largest(difference):
    return float(np.abs(difference).max())


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("pose", POSES)
def test_homogeneous_slab(pose, eye):
    slab = Slab(size=(9, 6, 12), pose=pose_of(pose))
    view = view_of(slab.volume, eye)
    truth = slab.image(view)
    assert truth[..., 3].max() > 0.05
    assert largest(reference.render(slab.volume, slab.transfer, view) - truth) < ROUNDING


@pytest.mark.parametrize("near", [0.0, 2.0, 9.0])
@pytest.mark.parametrize("eye", ["front", "inside"])
def test_near_distance_along_the_ray(eye, near):
    slab = Slab(size=(9, 6, 12), pose=pose_of("sheared"))
    view = view_of(slab.volume, eye, near=near)
    assert largest(reference.render(slab.volume, slab.transfer, view) - slab.image(view)) < ROUNDING


@pytest.mark.parametrize("eye", ["front", "corner", "inside"])
@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("kind", ["colour", "opacity"])
def test_linear_ramp(kind, axis, pose, eye):
    two = {
        "colour": {},
        "opacity": {"opacities": (0.05, 0.9), "colours": ((1.0, 0.5, 0.2),) * 2},
    }
    ramp = Ramp(size=(9, 5, 17), pose=pose_of(pose), axis=axis, **two[kind])
    view = view_of(ramp.volume, eye)
    image = reference.render(ramp.volume, ramp.transfer, view, tolerance=1e-10)
    assert largest(image - ramp.image(view)) < REFERENCE_AT_1E_10


def test_ramp_up_to_full_opacity_converges_in_spite_of_the_logarithm():
    ramp = Ramp(size=(9, 9, 9), opacities=(0.0, 1 - 1e-6), colours=((1.0, 1.0, 1.0),) * 2)
    view = view_of(ramp.volume, "corner")
    image, report = reference.render_with_report(ramp.volume, ramp.transfer, view, tolerance=1e-6)
    assert report.unconverged == 0
    assert largest(image - ramp.image(view)) < 1e-6


def test_opacity_one_lets_a_millionth_through_per_unit():
    slab = Slab(size=(3, 3, 2), opacity=1.0)  # one unit thick along z
    view = View.look_at((1, 1, -50), (1, 1, 0), (0, 1, 0), 1, (3, 3))
    alpha = reference.render(slab.volume, slab.transfer, view)[1, 1, 3]
    assert abs(alpha - (1 - 1e-6)) < 1e-12


def test_opacity_is_held_at_its_limit_and_not_scaled_to_it():
    """Mean of −ln(max(1 − v, ε)) over v = 0 … 1 is 1 − ε; a line from 1 to ε instead would give 14 ε less."""
    ramp = Ramp(size=(3, 3, 17))
    full = TransferFunction([(0, (1, 1, 1), 0), (1, (1, 1, 1), 1)], 16.0)
    view = View.look_at((1, 1, -50), (1, 1, 0), (0, 1, 0), 1, (3, 3))
    alpha = reference.render(ramp.volume, full, view, tolerance=1e-10)[1, 1, 3]
    assert abs(alpha + np.expm1(-(1 - 1e-6))) < REFERENCE_AT_1E_10


@pytest.mark.parametrize("n", [9, 17, 33])
@pytest.mark.parametrize("eye", ["front", "corner", "inside", "centre"])
def test_ball_lies_within_its_bounds(n, eye):
    ball = Ball(n)
    view = view_of(ball.volume, eye, (40, 30))
    image = reference.render(ball.volume, ball.transfer, view)
    low, high = ball.bounds(view)
    assert (image > low - BALL_BOUND).all() and (image < high + BALL_BOUND).all()


def test_ball_converges_with_the_square_of_the_spacing():
    counts = np.array([9, 17, 33, 65, 129])
    errors = []
    for n in counts:
        ball = Ball(n)
        view = view_of(ball.volume, "front", (48, 48))
        errors.append(np.abs(reference.render(ball.volume, ball.transfer, view) - ball.image(view)).mean())
    order = -np.polyfit(np.log(counts - 1), np.log(errors), 1)[0]
    assert order > BALL_ORDER, errors
    assert errors[-1] < 3e-5


@pytest.mark.parametrize("width", [1e-9, 1e-5, 0.01, 0.4])
def test_no_step_is_missed_however_thin(width):
    """A ramp seen through a window of values is a slab cut to a window of positions."""
    low, high = 0.37, 0.37 + width
    opacity = -np.expm1(-0.5 / width)  # about as visible at every width, until opacity's upper limit
    ramp, colour = Ramp(size=(9, 9, 17), axis=2), (0.2, 0.7, 1.0)
    rows = [(low, colour, 0), (low, colour, opacity), (high, colour, opacity), (high, colour, 0)]
    window = TransferFunction([(0, colour, 0), *rows, (1, colour, 0)], 1.0)
    view = view_of(ramp.volume, "front")
    shown = Regions(crop=(0, 8, 0, 8, low * 16, high * 16))
    truth = Slab(ramp.size, opacity=opacity, colour=colour).image(view, shown)
    assert largest(reference.render(ramp.volume, window, view) - truth) < 1e-7  # (1 + 1e-9) keeps 7 digits


def test_markers_show_where_projection_puts_them():
    markers = Markers(pose=pose_of("sheared"))
    view = view_of(markers.volume, (0.5, 0.4, -2.0), (384, 384))
    image = reference.render(markers.volume, markers.transfer, view)
    off = markers.centroids(image, view, 12) - markers.centres(view)
    assert np.linalg.norm(off, axis=-1).max() < MARKER_PIXELS


# --- a plain-numpy twin ------------------------------------------------------------------------------------


def midpoint_pixel(volume, transfer, view, row, column, count):
    """One pixel by a midpoint sum over the whole ray: slow and obvious."""
    object_from_world = np.linalg.inv(volume.world_from_object)
    direction = view.directions()[row, column]
    direction = direction / np.linalg.norm(direction)
    start = object_from_world @ np.append(view.eye.position, 1)
    with np.errstate(divide="ignore"):
        faces = np.array([0 - start[:3], np.array(volume.size) - 1 - start[:3]]) / (
            object_from_world[:3, :3] @ direction
        )
    near, far = faces.min(0).max(), faces.max(0).min()
    distance, step = np.linspace(near, far, count, endpoint=False, retstep=True)
    world = view.eye.position + (distance + step / 2)[:, None] * direction
    p = world @ object_from_world[:3, :3].T + object_from_world[:3, 3]
    cell = np.clip(p.astype(int), 0, np.array(volume.size) - 2)
    fraction = p - cell
    value = 0.0
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, fraction, 1 - fraction), axis=1)
        x, y, z = (cell + corner).T
        value = value + weight * volume.data[z, y, x]
    depth = transfer.extinction(value) * step
    before = np.exp(-(np.cumsum(depth) - depth))
    alpha = -np.expm1(-depth)
    rgb = ((before * alpha)[:, None] * transfer.colour(value)).sum(0)
    return np.append(rgb, -np.expm1(-depth.sum()))


@pytest.mark.parametrize(("transfer", "bound"), [(STEPS, MIDPOINT_STEPS), (KINKS, MIDPOINT_KINKS)])
@pytest.mark.parametrize("eye", ["front", "corner"])
def test_numpy_twin(transfer, bound, eye):
    volume = noise()
    view = view_of(volume, eye)
    image = reference.render(volume, transfer, view, tolerance=1e-9)
    for row, column in [(9, 12), (5, 9), (11, 15), (8, 14)]:
        twin = midpoint_pixel(volume, transfer, view, row, column, 400_000)
        assert twin[3] > 0.05
        assert largest(image[row, column] - twin) < bound


# --- regions -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("eye", ["front", "corner", "inside"])
@pytest.mark.parametrize("pose", POSES)
def test_crop_and_clip_of_a_slab(pose, eye):
    slab = Slab(size=(9, 6, 12), pose=pose_of(pose))
    normal = np.array([0.5, -0.3, 0.8])
    shown = Regions((0.5, 6.25, 1, 4.5, -3, 9), [(*normal, 0.3 - normal @ slab.volume.centre), (0, 1, 0, 25)])
    view = view_of(slab.volume, eye)
    truth = slab.image(view, shown)
    assert truth[..., 3].max() > 0.05 and largest(truth - slab.image(view)) > 0.05
    assert largest(reference.render(slab.volume, slab.transfer, view, regions=shown) - truth) < ROUNDING


def test_crop_on_voxels_is_the_cropped_array():
    volume = noise()
    pose = volume.world_from_object.copy()
    pose[:3, 3] = pose[:3, :3] @ (2, 1, 3)
    part = Volume(volume.data[3:6, 1:7, 2:9], world_from_object=pose)
    view = view_of(volume, "corner")
    cropped = reference.render(volume, STEPS, view, regions=Regions((2, 8, 1, 6, 3, 5)))
    assert largest(cropped - reference.render(part, STEPS, view)) < ROUNDING


def test_clip_plane_is_in_world_units():
    volume = noise()  # spacing 1, 1.3, 0.8
    view = view_of(volume, "corner")
    clipped = reference.render(volume, STEPS, view, regions=Regions(clip=[(0, -2, 0, 2 * 1.3 * 2.5)]))
    cropped = reference.render(volume, STEPS, view, regions=Regions((0, 8, 0, 2.5, 0, 6)))
    assert largest(clipped - cropped) < ROUNDING


@pytest.mark.parametrize("transfer", [STEPS, KINKS])
def test_front_half_over_back_half_is_the_whole(transfer):
    volume, plane = noise(), np.array([0.3, 0.5, 0.7, -5.0])
    view = view_of(volume, "corner")  # on the positive side
    whole, front, back = (
        reference.render(volume, transfer, view, regions=Regions(clip=clip), tolerance=1e-9)
        for clip in ((), [plane], [-plane])
    )
    assert min(front[..., 3].max(), back[..., 3].max()) > 0.1
    assert largest(front + (1 - front[..., 3:]) * back - whole) < 4e-9  # three pictures of 1e-9


# --- relations ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [1e-3, 7.0, 1e4])
def test_scaled_world_gives_the_same_picture(k):
    volume, eye, centre = noise(), np.array([12.0, 9.0, -14.0]), np.array([4.0, 4.0, 3.0])
    scaled = Volume(volume.data, np.array(volume.spacing) * k)
    image = reference.render(volume, STEPS, View.look_at(eye, centre, (0, 1, 0), 40, SIZE))
    transfer = TransferFunction(STEPS.points, k)
    again = reference.render(scaled, transfer, View.look_at(eye * k, centre * k, (0, 1, 0), 40, SIZE))
    assert largest(image - again) < ROUNDING


def test_opacity_unit_defaults_to_the_smallest_spacing():
    volume = noise()
    view = view_of(volume)
    free = TransferFunction(STEPS.points)
    assert np.array_equal(
        reference.render(volume, free, view),
        reference.render(volume, TransferFunction(STEPS.points, min(volume.spacing)), view),
    )


@pytest.mark.parametrize("axes", [(0, 2, 1), (1, 0, 2), (2, 1, 0), (1, 2, 0), (2, 0, 1)])
def test_permuted_axes_give_the_same_picture(axes):
    volume, view = noise(), view_of(noise(), "corner")
    permuted = Volume(
        volume.data.transpose(axes),
        world_from_object=volume.world_from_object[:, [*(2 - np.array(axes)[::-1]), 3]],
    )
    same = reference.render(permuted, STEPS, view) - reference.render(volume, STEPS, view)
    assert largest(same) < ROUNDING


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_flipped_voxels_with_flipped_pose_give_the_same_picture(axis):
    volume, view = noise(), view_of(noise(), "corner")
    flip = np.eye(4)
    flip[axis, axis], flip[axis, 3] = -1, volume.size[axis] - 1
    flipped = Volume(np.flip(volume.data, 2 - axis), world_from_object=volume.world_from_object @ flip)
    same = reference.render(flipped, STEPS, view) - reference.render(volume, STEPS, view)
    assert largest(same) < ROUNDING


def test_mirrored_voxels_give_the_mirrored_picture():
    volume = noise()
    eye = volume.centre + np.array([0, 3, -20])
    view = View.look_at(eye, volume.centre, (0, 1, 0), 40, SIZE)
    mirrored = Volume(volume.data[:, :, ::-1], volume.spacing)
    image = reference.render(volume, STEPS, view)
    assert largest(image - image[:, ::-1]) > 0.1
    assert largest(reference.render(mirrored, STEPS, view)[:, ::-1] - image) < ROUNDING


def test_voxel_types_give_equal_bits():
    images = [reference.render(noise(dtype=t), STEPS, view_of(noise())) for t in ("u1", "i2", "u2", "f4")]
    assert all(np.array_equal(images[0], image) for image in images[1:])


def test_threads_give_equal_bits():
    volume = noise()
    view = view_of(volume, size=(64, 48))
    assert np.array_equal(*(reference.render(volume, STEPS, view, threads=n) for n in (1, None)))


def test_rays_along_grid_lines_are_the_limit_of_their_neighbours():
    """The eye on a voxel's axis: the middle ray runs along an edge of four cells."""
    volume = noise()
    eye, centre = np.array([4.0, 3 * 1.3, -9.0]), np.array([4.0, 3 * 1.3, 3.0])
    on = reference.render(volume, KINKS, View.look_at(eye, centre, (0, 1, 0), 30, (5, 5)))
    shift = np.array([1e-7, 2e-7, 0])
    beside = reference.render(volume, KINKS, View.look_at(eye + shift, centre + shift, (0, 1, 0), 30, (5, 5)))
    assert on[2, 2, 3] > 0.1
    assert largest(on - beside) < 1e-4  # 1e-7 away, gradients below 10 a voxel, tolerance 1e-5


def test_rays_exactly_parallel_to_the_faces_and_beside_the_box_see_nothing():
    volume = noise()
    wall = Wall((19, 0, 0), (21, 0, 0), (19, 2, 0), (1, 1))
    view = View.through_wall((20, 1, -8), wall)
    assert np.array_equal(view.directions()[0, 0], (0, 0, 8))
    assert not reference.render(volume, KINKS, view).any()


# --- values ------------------------------------------------------------------------------------------------


def test_cells_with_a_nan_corner_are_transparent():
    slab = Slab(size=(9, 6, 12), pose=pose_of("sheared"))
    data = slab.volume.data.copy()
    data[4] = np.nan  # cells 3 … 5 along z
    holed = Volume(data, world_from_object=slab.volume.world_from_object)
    view = view_of(holed, "corner")
    parts = [slab.image(view, Regions((0, 8, 0, 5, *z))) for z in ((0, 3), (5, 11))]
    clear = (1 - parts[0][..., 3]) * (1 - parts[1][..., 3])
    assert largest(reference.render(holed, slab.transfer, view)[..., 3] - (1 - clear)) < ROUNDING


def test_a_single_nan_hides_eight_cells_only():
    volume = noise(dtype=np.float32)
    data = volume.data.copy()
    data[3, 4, 4] = np.nan
    view = view_of(volume, "front")
    whole = Regions((0, 3, 0, 7, 0, 6))
    holed = Volume(data, volume.spacing)
    untouched = [reference.render(v, STEPS, view, regions=whole) for v in (volume, holed)]
    assert np.array_equal(*untouched)
    inside = Regions((3, 5, 3, 5, 2, 4))
    assert not reference.render(holed, STEPS, view, regions=inside).any()


def test_a_value_on_a_step_belongs_above_it():
    volume = Volume(np.full((3, 3, 3), 90, np.uint8))
    view = view_of(volume)
    above = TransferFunction([(0, (0, 1, 0.2), 0.02)], 1.0)
    assert largest(reference.render(volume, STEPS, view) - reference.render(volume, above, view)) < ROUNDING


def test_below_the_first_point_the_first_point_holds():
    volume = Volume(np.full((3, 3, 3), 50, np.uint8))
    step = TransferFunction([(90, (1, 0, 0), 0.2), (90, (0, 1, 0), 0.7)], 1.0)
    flat = TransferFunction([(0, (1, 0, 0), 0.2)], 1.0)
    view = view_of(volume)
    assert np.array_equal(reference.render(volume, step, view), reference.render(volume, flat, view))


def test_volumes_and_regions_without_thickness_are_empty():
    view = View.look_at((1, 1, -9), (1, 1, 1), (0, 1, 0), 40, SIZE)
    for shape in ((1, 3, 3), (3, 1, 3), (3, 3, 1), (1, 1, 1)):
        volume = Volume(np.full(shape, 200, np.uint8))
        assert not reference.render(volume, STEPS, view).any()
    volume = Volume(np.full((3, 3, 3), 120, np.uint8))
    assert reference.render(volume, STEPS, view).any()
    for crop in ((1, 1, 0, 2, 0, 2), (5, 6, 0, 2, 0, 2)):
        assert not reference.render(volume, STEPS, view, regions=Regions(crop)).any()
    away = View.look_at((1, 1, -9), (1, 1, -20), (0, 1, 0), 40, SIZE)
    assert not reference.render(volume, STEPS, away).any()


def test_a_ray_within_a_box_without_thickness_sees_nothing():
    wall = Wall((-1, 0, 0), (1, 0, 0), (-1, 2, 0), (1, 1))
    view = View.through_wall((0, 1, -8), wall)  # its only ray is x = 0
    thin = Volume(np.full((3, 3, 1), 120, np.uint8))
    thick = Volume(np.full((3, 3, 2), 120, np.uint8))
    assert not reference.render(thin, STEPS, view).any()
    assert not reference.render(thick, STEPS, view, regions=Regions((0, 0, 0, 2, 0, 2))).any()
    assert reference.render(thick, STEPS, view).any()


# --- convergence, settings and progress --------------------------------------------------------------------


@pytest.mark.parametrize("eye", ["corner", "inside"])
def test_error_stays_below_the_tolerance(eye):
    volume = noise((20, 20, 20))
    sharp = TransferFunction(
        [(v, np.random.default_rng(v).random(3), v % 3 / 2) for v in range(20, 250, 7)], 1.0
    )
    view = view_of(volume, eye, (16, 16))
    truth, report = reference.render_with_report(volume, sharp, view, tolerance=1e-11)
    assert report.unconverged == 0 and 0 < report.worst_change <= 1e-11
    for tolerance in (1e-3, 1e-5):
        image, report = reference.render_with_report(volume, sharp, view, tolerance=tolerance)
        assert report.unconverged == 0 and report.worst_change <= tolerance
        assert 0 < largest(image - truth) < tolerance


def test_pixels_that_did_not_converge_are_told(monkeypatch):
    def cast(_volume, _transfer, _look, _view, _regions, _tolerance, states, _progress):
        states[0, :2, -1] = 1e-3, 1e-6

    monkeypatch.setattr(reference, "_cast_in_bands", cast)
    volume = noise()
    with pytest.warns(RuntimeWarning, match="1 pixels"):
        reference.render(volume, STEPS, view_of(volume))


def test_progress_counts_rows():
    volume, calls = noise(), []
    view = view_of(volume, size=(2000, 9))
    reference.render(volume, STEPS, view, progress=lambda *call: calls.append(call))
    assert calls == [(4, 9, "reference"), (8, 9, "reference"), (9, 9, "reference")]


@pytest.mark.parametrize("wrong", [{"tolerance": 0}, {"tolerance": float("nan")}, {"threads": 0}])
def test_settings_out_of_range(wrong):
    volume = noise()
    with pytest.raises(SettingsError):
        reference.render(volume, STEPS, view_of(volume), **wrong)
