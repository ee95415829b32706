"""Made-up volumes, and the closed forms of their pictures against other closed forms and plain sums."""

import numpy as np
import pytest
from tolerances import ROUNDING

from persp_sw.errors import VolumeError
from persp_sw.geometry.regions import Regions
from persp_sw.geometry.view import View
from persp_sw.measure.exact import Ball, Markers, Ramp, Slab, shown_part
from persp_sw.volume import phantoms


def straight(eye_z, size=(3, 3), near=0.0):
    """A view along +z whose middle pixel's ray is x = y = 4."""
    return View.look_at((4, 4, eye_z), (4, 4, eye_z + 10), (0, 1, 0), 20, size, near)


# --- voxels -------------------------------------------------------------------------------------------------


def test_linear_is_exact_in_float32_on_powers_of_two():
    volume = phantoms.linear((5, 9, 17), 0.5, (0.25, 0.125, 1 / 16))
    z, y, x = np.indices((17, 9, 5))
    assert np.array_equal(volume.data, 0.5 + x / 4 + y / 8 + z / 16)


def test_paraboloid_knows_world_distances():
    pose = np.array([[0.5, 0.2, 0, 1], [0, -1, 0.3, 2], [0, 0, 2, 3], [0, 0, 0, 1.0]])
    volume = phantoms.paraboloid((4, 6, 5), 3.0, pose)
    for x, y, z in [(0, 0, 0), (3, 5, 4), (1, 2, 2)]:
        offset = pose[:3, :3] @ (x, y, z) + pose[:3, 3] - volume.centre
        assert abs(volume.data[z, y, x] - (9 - offset @ offset)) < 1e-5  # float32 below 64


def test_points_are_at_xyz():
    data = phantoms.points((4, 5, 6), np.array([[3, 4, 5], [1, 0, 2]]), 200).data
    assert data[5, 4, 3] == data[2, 0, 1] == 200 and data.astype(int).sum() == 400


def test_synthetic_ct_is_deterministic_and_depends_on_its_seed():
    one = phantoms.synthetic_ct(32)
    assert np.array_equal(one.data, phantoms.synthetic_ct(32).data)
    assert not np.array_equal(one.data, phantoms.synthetic_ct(32, seed=1).data)


@pytest.mark.parametrize(
    ("dtype", "zero", "one"), [("uint8", 0, 255), ("uint16", 0, 4095), ("int16", -1024, 3071)]
)
def test_synthetic_ct_is_the_same_body_in_every_type(dtype, zero, one):
    body = phantoms.synthetic_ct(24, dtype=np.float32).data
    volume = phantoms.synthetic_ct(24, dtype=dtype)
    assert volume.data.dtype == dtype
    assert np.abs(volume.data - (zero + (one - zero) * body.astype(float))).max() <= 0.501


def test_synthetic_ct_has_air_flesh_bone_and_tubes():
    data = phantoms.synthetic_ct(64).data
    share = [
        np.mean((data >= low) & (data <= high)) for low, high in ((0, 0), (55, 75), (170, 185), (225, 232))
    ]
    assert 0.5 < share[0] < 0.85
    assert min(share[1:]) > 0.002
    assert data[0].max() == data[:, 0].max() == data[:, :, -1].max() == 0  # air all around


def test_synthetic_ct_is_the_same_body_at_every_size():
    coarse = phantoms.synthetic_ct(24, dtype=np.float32).data
    fine = phantoms.synthetic_ct(72, dtype=np.float32).data
    assert np.abs(coarse - fine[1::3, 1::3, 1::3]).max() < 1e-5  # float32 coordinates


@pytest.mark.parametrize("wrong", [{"dtype": np.float64}, {"n": 1}])
def test_synthetic_ct_refuses(wrong):
    with pytest.raises(VolumeError):
        phantoms.synthetic_ct(**{"n": 8, **wrong})


# --- exact pictures -----------------------------------------------------------------------------------------


def test_shown_part_straight_on():
    volume = phantoms.constant((9, 9, 5), 1.0)
    cases = [
        (straight(-10), None, (10, 14)),
        (straight(-10, near=11.5), None, (11.5, 14)),
        (straight(1), None, (0, 3)),
        (straight(-10), Regions((0, 8, 0, 8, 0.5, 3)), (10.5, 13)),
        (straight(-10), Regions(clip=[(0, 0, -3, 6)]), (10, 12)),
    ]
    for view, regions, expected in cases:
        entry, leave = shown_part(volume, view, regions)
        assert abs(entry[1, 1] - expected[0]) < ROUNDING and abs(leave[1, 1] - expected[1]) < ROUNDING
    entry, leave = shown_part(volume, straight(5))
    assert np.array_equal(entry, leave)


def test_slab_straight_on():
    slab = Slab((9, 9, 5), opacity=0.1, colour=(1.0, 0.5, 0.25))
    alpha = 1 - 0.9**4  # four units of 0.1
    assert np.allclose(slab.image(straight(-10))[1, 1], alpha * np.array([1, 0.5, 0.25, 1]), atol=ROUNDING)


def test_slab_alpha_grows_with_the_slant():
    slab = Slab((9, 9, 5))
    direction = straight(-10, (9, 9)).directions()[4, 6]
    slant = np.linalg.norm(direction) / direction[2]
    assert abs(slab.image(straight(-10, (9, 9)))[4, 6, 3] - (1 - 0.9 ** (4 * slant))) < ROUNDING


def plain_sum(scene, entry, leave, count=200_000):
    """The middle ray of a ramp along z by a midpoint sum."""
    s = (np.arange(count) + 0.5) / count
    value = (entry + (leave - entry) * s) / (scene.size[2] - 1)
    depth = scene.transfer.extinction(value) * (leave - entry) / count
    weight = np.exp(-(np.cumsum(depth) - depth)) * -np.expm1(-depth)
    return np.append(weight @ scene.transfer.colour(value), weight.sum())


@pytest.mark.parametrize(
    "ramp",
    [
        Ramp((9, 9, 17)),
        Ramp((9, 9, 17), opacities=(1e-5, 1e-5)),
        Ramp((9, 9, 17), opacities=(0.9, 0.9)),
        Ramp((9, 9, 17), opacities=(0.02, 0.9), colours=((1, 0.5, 0.2),) * 2),
        Ramp((9, 9, 17), opacities=(0.1, 0.101), colours=((1, 0.5, 0.2),) * 2),
    ],
)
def test_ramp_against_a_plain_sum(ramp):
    for crop in ((0, 8, 0, 8, 0, 16), (0, 8, 0, 8, 3.5, 4.0)):
        exact = ramp.image(straight(-10), Regions(crop))[1, 1]
        assert np.abs(exact - plain_sum(ramp, *crop[4:])).max() < 1e-8  # (τ·16 / 2e5)² at τ = 2.3


def test_ramp_with_two_opacities_and_two_colours_is_refused():
    with pytest.raises(ValueError, match="closed form"):
        Ramp(opacities=(0.1, 0.2))


def test_ball_straight_through_the_middle():
    ball = Ball(17, radius=0.75, opacity=0.4)
    for eye, chord in (((0, 0, -5), 1.5), ((0, 0, 0.25), 0.5), ((0, 0, 3), 0.0)):
        view = View.look_at(eye, (0, 0, eye[2] + 1), (0, 1, 0), 20, (3, 3))
        low, high = ball.bounds(view)
        assert abs(ball.image(view)[1, 1, 3] - (1 - 0.6**chord)) < ROUNDING
        assert low[1, 1, 3] <= ball.image(view)[1, 1, 3] <= high[1, 1, 3]


def test_marker_centroids_find_painted_spots():
    markers = Markers()
    view = View.look_at((16, 16, -60), (16, 16, 16), (0, 1, 0), 30, (200, 160))
    image = np.zeros((160, 200, 4))
    centres = markers.centres(view)
    for x, y in np.floor(centres).astype(int):
        image[y - 1 : y + 2, x - 1 : x + 2, 3] = 0.5
    assert np.abs(markers.centroids(image, view, 6) - (np.floor(centres) + 0.5)).max() < 1e-9
    assert np.isnan(markers.centroids(0 * image, view, 6)).all()
