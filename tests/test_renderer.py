"""The whole way: volume to picture against the float64 reference, and how a Renderer behaves."""

import logging

import numpy as np
import pytest
from tolerances import CLOSED_FORM, FLOAT32_IMAGE, PICTURE_SMOOTH_DB, PICTURE_SURFACE_DB
from views import DIRECTIONS, random_pose, view_of

from persp_sw import Eye, Regions, Renderer, Settings, TransferFunction, View, Volume, Wall, reference
from persp_sw.errors import SettingsError
from persp_sw.measure.atlas.compositing import faces_of
from persp_sw.measure.metrics import compare, psnr
from persp_sw.volume.phantoms import synthetic_ct

SMOOTH = [(0, (0.2, 0.4, 0.9), 0), (90, (0.9, 0.6, 0.3), 0.05), (255, (1, 1, 1), 0.3)]
SURFACE = [(0, (0, 0, 0), 0), (100, (0.9, 0.7, 0.5), 0), (130, (0.9, 0.7, 0.5), 0.9), (255, (1, 1, 1), 0.95)]


def transfer_for(volume, points):
    """The 8-bit control points stretched to the volume's range."""
    low, high = volume.value_range
    return TransferFunction([(low + v / 255 * (high - low), c, a) for v, c, a in points])


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.uint16, np.float32])
def test_every_voxel_type_meets_the_reference(dtype):
    volume = synthetic_ct(64, dtype=dtype)
    renderer = Renderer(volume, transfer_for(volume, SMOOTH))
    for towards in DIRECTIONS[:2]:
        view = view_of(volume, towards, size=(96, 96))
        result = compare(renderer.render(view), reference.render(volume, renderer.transfer, view))
        assert result["psnr"] > PICTURE_SMOOTH_DB
        assert abs(result["mean_signed_error"]) < 1e-3


@pytest.mark.parametrize("points, floor", [(SMOOTH, PICTURE_SMOOTH_DB), (SURFACE, PICTURE_SURFACE_DB)])
@pytest.mark.parametrize("kind", ["plain", "oblique", "mirrored", "sheared", "flat"])
def test_every_side_and_pose_meets_the_reference(points, floor, kind, rng):
    pose = {
        "plain": np.eye(4),
        "oblique": random_pose(rng, spacing=(1, 0.8, 1.3)),
        "mirrored": random_pose(rng, mirrored=True),
        "sheared": random_pose(rng, shear=0.3),
        "flat": np.diag([1, 1, 4.0, 1]),
    }[kind]
    volume = Volume(synthetic_ct(64).data, world_from_object=pose)
    renderer = Renderer(volume, TransferFunction(points))
    for towards in DIRECTIONS:
        view = view_of(volume, towards, size=(96, 96))
        truth = reference.render(volume, renderer.transfer, view)
        assert psnr(renderer.render(view), truth) > floor, towards


def test_near_views_need_several_faces_and_meet_the_reference():
    volume = synthetic_ct(64)
    renderer = Renderer(volume, TransferFunction(SMOOTH))
    view = view_of(volume, DIRECTIONS[1], 0.9, fovy=100, size=(120, 120))
    picture = renderer.render(view)
    assert renderer.last["faces"] == 3
    assert psnr(picture, reference.render(volume, renderer.transfer, view)) > PICTURE_SMOOTH_DB


def test_crop_and_clip_meet_the_reference():
    volume = synthetic_ct(64)
    regions = Regions(crop=(5, 58.5, 2.25, 59, 12, 63), clip=[(0.5, -0.3, 0.8, -15)])
    renderer = Renderer(volume, TransferFunction(SMOOTH), Settings(residual=0), regions)
    view = view_of(volume, DIRECTIONS[0], size=(96, 96))
    truth = reference.render(volume, renderer.transfer, view, regions=regions)
    assert psnr(renderer.render(view), truth) > PICTURE_SMOOTH_DB
    whole = Renderer(volume, renderer.transfer, renderer.settings)
    whole.render(view)
    assert renderer.last["samples"] < whole.last["samples"]


def test_error_falls_with_quality_and_samples():
    volume = synthetic_ct(32)
    view = view_of(volume, DIRECTIONS[0], size=(96, 96))
    renderer = Renderer(volume, TransferFunction(SMOOTH))
    truth = reference.render(volume, renderer.transfer, view)
    errors = []
    for quality, samples in ((0.5, 1), (1, 1), (2, 2), (4, 4)):
        renderer.settings = Settings(quality=quality, samples_per_interval=samples, residual=0)
        errors.append(psnr(renderer.render(view), truth))
    assert errors == sorted(errors)
    assert errors[-1] > 53  # rms 2e-3


def test_functions_that_hide_more_than_half_are_preintegrated_of_their_own_accord():
    volume = synthetic_ct(48)
    view = view_of(volume, DIRECTIONS[0], size=(64, 64))
    bounds = [([*SURFACE[:2], (130, (0.9, 0.7, 0.5), most)], most > 0.5) for most in (0.5, 0.51, 1.0)]
    for points, opaque in (
        (SMOOTH, False),
        *bounds,
    ):  # a sample is as long as the unit
        renderer = Renderer(volume, TransferFunction(points))
        picture = renderer.render(view)
        assert renderer.last["samples_per_interval"] == 1
        assert renderer.last["preintegrated"] is opaque
        for settings, same in (
            (Settings(samples_per_interval=1, preintegrated=opaque), True),
            (Settings(samples_per_interval=1, preintegrated=not opaque), False),
            (Settings(samples_per_interval=1), not opaque),  # who asks for samples gets samples
        ):
            renderer.settings = settings
            assert np.array_equal(renderer.render(view), picture) == same


def test_without_packing_all_is_stored_and_no_pixel_changes():
    volume = synthetic_ct(40)
    view = view_of(volume, DIRECTIONS[0], size=(64, 64))
    renderer = Renderer(volume, TransferFunction(SURFACE))
    picture, packed = renderer.render(view), renderer.last["runs_bytes"]
    renderer.settings = Settings(pack_runs=False)
    np.testing.assert_array_equal(renderer.render(view), picture)
    dense = renderer.last["runs_bytes"]
    assert renderer.runs.axis(2).voxel_count == volume.data.size
    assert dense > packed


@pytest.mark.parametrize("quality", [0.3, 1.0, 3.0])
def test_quality_does_not_change_the_look(quality):
    volume = synthetic_ct(64)
    view = view_of(volume, DIRECTIONS[0], size=(96, 96))
    settings = Settings(quality=quality, samples_per_interval=2, level_of_detail=False)
    renderer = Renderer(volume, TransferFunction(SMOOTH), settings)
    picture, truth = renderer.render(view), reference.render(volume, renderer.transfer, view)
    np.testing.assert_allclose(picture.mean((0, 1)), truth.mean((0, 1)), rtol=0.02)


def test_parts_and_changes_give_the_same_picture_as_a_new_renderer():
    volume = synthetic_ct(32)
    view = view_of(volume, DIRECTIONS[0])
    renderer = Renderer(volume, TransferFunction(SMOOTH))
    renderer.render(view)
    renderer.transfer = TransferFunction(SURFACE)
    renderer.settings = Settings(quality=2)
    renderer.regions = Regions(crop=(4, 30, 4, 30, 4, 30))
    fresh = Renderer(volume, TransferFunction(SURFACE), Settings(quality=2), renderer.regions)
    np.testing.assert_array_equal(renderer.render(view), fresh.render(view))
    renderer.settings = Settings(quality=2, skip_empty=False)
    assert psnr(renderer.render(view), fresh.render(view)) > PICTURE_SURFACE_DB  # another rectangle


def test_one_compositing_serves_several_walls_and_none_costs_nothing():
    volume = synthetic_ct(32)
    renderer = Renderer(volume, TransferFunction(SMOOTH))
    eye = volume.centre + np.array([0, 0, 60.0])
    front = View.look_at(eye, volume.centre, (0, 1, 0), 40, (64, 64))
    away = View.look_at(eye, eye + np.array([0, 0, 9.0]), (0, 1, 0), 40, (64, 64))
    image = renderer.composite(front.eye, [front.wall, away.wall])
    np.testing.assert_array_equal(renderer.warp(image, front), renderer.render(front))
    assert not renderer.warp(image, away).any()
    assert renderer.composite(away.eye, [away.wall]).samples == 0
    assert renderer.last["faces"] == 0 and renderer.last["intermediate_size"] == [0, 0]


@pytest.mark.parametrize("size", [(1, 1, 1), (1, 8, 8), (8, 1, 8), (8, 8, 1)])
def test_a_volume_one_voxel_thick_is_an_empty_picture_and_one_warning(size, caplog):
    volume = Volume(np.full(size[::-1], 200, np.uint8))
    with caplog.at_level(logging.WARNING, "persp_sw"):
        renderer = Renderer(volume, TransferFunction(SMOOTH))
        view = View.look_at((20, 18, 15), (0, 0, 0), (0, 1, 0), 45, (16, 16))
        for _ in range(2):
            assert not renderer.render(view).any()
    assert len(caplog.records) == 1 and "one voxel thick" in caplog.text


def test_invisible_volumes_and_empty_crops_cost_nothing():
    volume = synthetic_ct(24)
    view = view_of(volume, DIRECTIONS[0])
    for renderer in (
        Renderer(volume, TransferFunction([(0, (1, 1, 1), 0)])),
        Renderer(volume, TransferFunction(SMOOTH), regions=Regions(crop=(100, 120, 0, 5, 0, 5))),
    ):
        assert not renderer.render(view).any()
        assert renderer.last["samples"] == 0


def test_voxels_that_are_nan_are_transparent_in_picture_and_reference():
    data = synthetic_ct(40, dtype=np.float32).data.copy()
    data[12:20, 15:22, 10:18] = np.nan
    volume = Volume(data)
    assert volume.nonfinite == 8 * 7 * 8
    renderer = Renderer(volume, transfer_for(volume, SMOOTH))
    view = view_of(volume, DIRECTIONS[0], size=(64, 64))
    picture = renderer.render(view)
    assert np.isfinite(picture).all()
    assert psnr(picture, reference.render(volume, renderer.transfer, view)) > PICTURE_SURFACE_DB


def test_cells_with_a_voxel_that_is_nan_are_left_out_wholly(rng):
    """As the closed form of what is left; samples on slices would take half of such a cell as whole."""
    data = np.full((9, 9, 9), 100, np.float32)
    data[tuple(rng.integers(0, 9, (3, 12)))] = np.nan
    renderer = Renderer(Volume(data), TransferFunction([(100, (1, 1, 1), 0.3)], 1.0), Settings(residual=0))
    view = View.look_at((4.2, 4.3, -3000), (4.2, 4.3, 4), (0, 1, 0), 0.2, (32, 32))
    ((face, rays),) = faces_of(renderer.composite(view.eye, [view.wall]))
    truth = reference.render(renderer.volume, renderer.transfer, rays)
    directions = rays.directions()
    across = (view.eye.position + 3004 / directions[..., 2:] * directions)[..., :2]
    within = (np.abs(across - np.rint(across)) > 0.02).all(-1)  # rays that stay in their column of cells
    assert within.sum() > 100 and np.unique(truth[within, 3].round(6)).size > 4
    assert np.abs(face - truth)[within].max() < CLOSED_FORM
    assert renderer.last["preintegrated"]


@pytest.mark.parametrize("preintegrated", [False, True])
@pytest.mark.parametrize("exponent", [-149, -143, -129, -106, -50, 60, 90, 125])  # 1e-44 … 3e38
def test_values_of_any_size_are_told_apart(exponent, preintegrated, rng):
    """Values times a power of two, and the function's, too: not a bit changes, denormal numbers neither."""
    steps = rng.integers(-7, 8, (7, 8, 9)).astype(np.float32)
    points = [(-3, (0, 0, 1), 0.0), (1, (0, 1, 0), 0.4), (4, (1, 0, 0), 0.1), (7, (1, 1, 1), 0.4)]
    pictures = []
    for size in (0, exponent):
        volume = Volume(np.ldexp(steps, size))
        transfer = TransferFunction([(float(np.ldexp(v, size)), c, a) for v, c, a in points], 1.0)
        renderer = Renderer(volume, transfer, Settings(preintegrated=preintegrated))
        pictures.append(renderer.render(view_of(volume, DIRECTIONS[0], size=(32, 32))))
    assert pictures[0].max() > 0.5
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("width", [1e-30, 1e-36, 1e-40, 1e-44, 1e-310])
def test_a_rise_too_narrow_for_float32_is_a_step(width, rng):
    """What lies more than 1e-38 below or above it is as where it is wider."""
    volume = Volume(rng.integers(-2, 3, (7, 8, 9)).astype(np.float32))
    pictures = []
    for rise in (1e-20, width):
        points = [(0, (0, 0, 1), 0.0), (rise, (0, 1, 0), 0.4)]
        renderer = Renderer(volume, TransferFunction(points, 1.0), Settings(preintegrated=False))
        pictures.append(renderer.render(view_of(volume, DIRECTIONS[0], size=(32, 32))))
    assert pictures[0].max() > 0.5
    assert np.abs(pictures[0] - pictures[1]).max() < FLOAT32_IMAGE


def test_a_marker_lands_where_it_is_projected(rng):
    """A bright voxel's centroid, through any pose, is where the projection matrix says."""
    data = np.zeros((21, 23, 25), np.uint8)
    voxel = np.array([17, 6, 13])  # x, y, z
    data[tuple(voxel[::-1])] = 255
    for mirrored in (False, True):
        volume = Volume(data, world_from_object=random_pose(rng, mirrored=mirrored))
        view = view_of(volume, DIRECTIONS[0], 2.5, fovy=28, size=(200, 160))
        picture = Renderer(volume, TransferFunction(SMOOTH), Settings(quality=4)).render(view)
        alpha = picture[..., 3].astype(float)
        row, column = np.indices(alpha.shape) + 0.5
        centroid = np.array([(column * alpha).sum(), (row * alpha).sum()]) / alpha.sum()
        world = volume.world_from_object[:3, :3] @ voxel + volume.world_from_object[:3, 3]
        assert np.abs(centroid - view.project(world)).max() < 0.25


@pytest.mark.parametrize(
    "wrong",
    [{"quality": 0}, {"quality": np.nan}, {"threads": 1.5}, {"samples_per_interval": True},
     {"samples_per_interval": "2"}, {"residual": -1}, {"samples_per_interval": 3}, {"threads": 0},
     {"single_face_tangent": 0.5}, {"max_intermediate": 5}, {"quality": "high"}],
)  # fmt: skip
def test_settings_out_of_range_are_refused(wrong):
    with pytest.raises(SettingsError, match=next(iter(wrong))):
        Settings(**wrong)


def test_picture_and_wall_orientation():
    """Row 0 is on top and column 0 on the left: bright voxels at +x and +y, camera on +z, y up."""
    data = np.zeros((9, 9, 9), np.uint8)
    data[4, 7, 7] = 255  # z, y, x
    volume = Volume(data)
    picture = Renderer(volume, TransferFunction(SMOOTH)).render(
        view_of(volume, (0, 0, 1), 2.5, size=(64, 64))
    )
    row, column = np.unravel_index(picture[..., 3].argmax(), (64, 64))
    assert row < 32 < column
    wall = Wall((-10, -10, 0), (10, -10, 0), (-10, 10, 0), (64, 64))
    assert np.abs(picture[:32, 32:].sum() - picture.sum()) < FLOAT32_IMAGE
    assert View.through_wall((0, 0, 30), wall).project([10, 10, 0]).tolist() == [64, 0]


def test_an_eye_a_rounding_behind_a_slice_plane_reads_nothing_outside():
    """float32 may put the last pixel's position below the packet's first voxel, where nothing may be read."""
    s = 0.1
    volume = Volume(np.full((64, 3, 3), 100, np.uint8), (s, s, s))
    eye = np.array([1, 2.1, 3]) * s
    view = View.look_at(eye, eye + (-0.3, -0.2, 1), (0, 1, 0), 120, (17, 9))
    assert Renderer(volume, TransferFunction([(100, (1, 1, 1), 0.3)], s)).render(view).max() > 0


@pytest.mark.parametrize("x", [31.3, 31.5, 31.7, 40])
def test_a_wall_that_shows_nothing_of_the_volume_costs_nothing(x):
    """Nor does it warn where its plane is parallel to the ray to the volume's middle, as in every CAVE."""
    volume = Volume(np.full((64, 64, 64), 200, np.uint8))
    eye, r = np.array([x, 31.5, 260.0]), 300.0
    front = View.look_at(eye, (31.5, 31.5, 0), (0, 1, 0), 60, (64, 64)).wall
    left = Wall(eye + (-r, -r, r), eye + (-r, -r, -r), eye + (-r, r, r), (64, 64))
    renderer = Renderer(volume, TransferFunction(SMOOTH))
    assert renderer.composite(Eye(eye), [front, left]).faces == renderer.composite(Eye(eye), [front]).faces


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_the_smallest_pictures_are_right(size):
    """A face is never so small that it is made of its margins: 16 pixels across a box of one pixel."""
    volume = Volume(np.full((32, 32, 32), 200, np.uint8))
    renderer = Renderer(volume, TransferFunction([(0, (1, 1, 1), 0.05)], 1.0), Settings(residual=0))
    view = View.look_at(volume.centre + (20, 30, 90), volume.centre, (0, 1, 0), 45, (size, size))
    error = renderer.render(view) - reference.render(volume, renderer.transfer, view)
    # A bilinear 16² image of a box whose edges fall by 0.8 over few of its pixels.
    assert np.sqrt(np.mean(error**2)) < 0.08


def test_the_picture_does_not_depend_on_what_was_encoded_before():
    volume = synthetic_ct(40)
    view = view_of(volume, DIRECTIONS[0])
    one, other = Renderer(volume, TransferFunction(SMOOTH)), Renderer(volume, TransferFunction(SMOOTH))
    other.runs.report(0)
    np.testing.assert_array_equal(one.render(view), other.render(view))


def test_no_transfer_function_is_a_chosen_one_also_later():
    renderer = Renderer(synthetic_ct(24), TransferFunction(SMOOTH))
    renderer.transfer = None
    assert renderer.transfer.points == Renderer(renderer.volume).transfer.points
