"""Presets: the right one is guessed, and none is ever invalid."""

from __future__ import annotations

import numpy as np
import pytest
from data_folder import volume_path
from samples import ball

import persp_sw as psw
from persp_sw.errors import TransferFunctionError
from persp_sw.optics import presets
from persp_sw.optics.histogram import Histogram


def noisy(rng, background: float, sigma: float, count: int = 40) -> np.ndarray:
    return rng.normal(background, sigma, (count, count, count))


def in_the_middle(data: np.ndarray, part: float) -> tuple[slice, ...]:
    edge = int(len(data) * (1 - part) / 2)
    return (slice(edge, len(data) - edge),) * 3


def hounsfield(rng, bone: bool) -> np.ndarray:
    data = noisy(rng, -1000, 15)
    data[in_the_middle(data, 0.8)] = rng.normal(40, 30, data[in_the_middle(data, 0.8)].shape)
    if bone:
        data[in_the_middle(data, 0.3)] = 900
    return data.astype(np.int16)


def two_materials(rng) -> np.ndarray:
    data = np.clip(noisy(rng, 5, 5), 0, 255)
    data[in_the_middle(data, 0.7)] = rng.normal(120, 4, data[in_the_middle(data, 0.7)].shape)
    data[in_the_middle(data, 0.3)] = rng.normal(220, 4, data[in_the_middle(data, 0.3)].shape)
    return np.clip(data, 0, 255).astype(np.uint8)


def broad_hump(rng) -> np.ndarray:
    data = np.clip(noisy(rng, 0, 2), 0, 255)
    data[in_the_middle(data, 0.8)] = rng.normal(110, 35, data[in_the_middle(data, 0.8)].shape)
    return np.clip(data, 0, 255).astype(np.uint8)


def fluorescence(rng) -> np.ndarray:
    signal = 30_000 * rng.random((40, 40, 40)) ** 8
    return np.clip(noisy(rng, 5000, 400) + signal, 0, 65535).astype(np.uint16)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda rng: hounsfield(rng, True), "ct_bone"),
        (lambda rng: hounsfield(rng, False), "ct_soft"),
        (two_materials, "layers"),
        (broad_hump, "mri"),
        (fluorescence, "microscopy"),
        (lambda rng: np.expm1(ball(48, np.float32, 6.0)), "simulation"),
    ],
)
def test_the_kind_of_data_is_recognised(rng, make, name):
    preset = presets.choose(psw.Volume(make(rng)))
    assert preset.name == name
    assert preset.why


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("engine.nrrd", "layers"),
        ("bonsai.nrrd", "layers"),
        ("tooth.nrrd", "layers"),
        ("brainsmall_volpack.nrrd", "mri"),
        ("colin27_ch2.nrrd", "mri"),
        ("mni152_nilearn.nrrd", "mri"),
        ("stent.nrrd", "ct_bone"),
        ("nuclei_confocal.nrrd", "microscopy"),
        ("hydrogen.nrrd", "simulation"),
        ("heptane.nrrd", "simulation"),
        ("ironprot.nrrd", "simulation"),
        ("neghip.nrrd", "simulation"),
    ],
)
def test_real_data_get_the_preset_they_were_looked_at_with(file, name):
    assert presets.choose(psw.load(volume_path(file))).name == name


AWKWARD = {
    "constant": np.full((4, 4, 4), 7, np.uint8),
    "all zero": np.zeros((4, 4, 4), np.float32),
    "constant negative": np.full((4, 4, 4), -1e6, np.float32),
    "two values": np.arange(64).reshape(4, 4, 4) // 32,
    "tiny": np.linspace(0, 1e-30, 64, dtype=np.float32).reshape(4, 4, 4),
    "huge": np.linspace(-3e38, 3e38, 64, dtype=np.float32).reshape(4, 4, 4),
    "one voxel": np.ones((1, 1, 1), np.uint8),
    "mostly NaN": np.where(np.arange(64).reshape(4, 4, 4) == 5, np.float32(3), np.float32(np.nan)),
    "one outlier": np.where(np.arange(4096).reshape(16, 16, 16) == 5, 60000, 1).astype(np.uint16),
    "thin": np.arange(200, dtype=np.uint8).reshape(1, 1, 200),
}


@pytest.mark.parametrize("what", AWKWARD)
def test_any_volume_gets_every_preset(what):
    volume = psw.Volume(AWKWARD[what])
    for name in presets.NAMES:
        transfer = presets.make(name, volume).transfer
        assert (np.diff(transfer.values) > 0).all()  # no step: pictures stay smooth
        assert transfer.opacity_unit is None
        assert transfer.opacities[0] == 0
    presets.choose(volume)


def test_a_constant_volume_is_seen():
    volume = psw.Volume(np.full((4, 4, 4), 7, np.uint8))
    assert presets.choose(volume).transfer.opacity(7.0) > 0


@pytest.mark.parametrize("name", presets.NAMES)
def test_background_is_transparent_and_something_is_not(rng, name):
    volume = psw.Volume(two_materials(rng))
    transfer = presets.make(name, volume).transfer
    assert transfer.opacity(5.0) == 0
    assert transfer.opacity(220.0) > 0


def test_finer_voxels_of_the_same_thing_look_alike():
    coarse, fine = (psw.Volume(ball(count), (60 / count,) * 3) for count in (30, 60))
    depths = []
    for volume in (coarse, fine):
        transfer = presets.make("fog", volume).transfer.with_unit(min(volume.spacing))
        depths.append(transfer.extinction(100.0) * max(volume.extent))
    # The landmarks are quantiles of the voxels, which differ a little.
    assert depths[0] == pytest.approx(depths[1], rel=0.15)


def test_values_may_be_shifted_and_scaled():
    """A preset follows the values: an affine map of them maps the control points."""
    data = ball(32, np.float32)
    plain, mapped = (presets.make("simulation", psw.Volume(d)).transfer for d in (data, 3 * data - 50))
    np.testing.assert_allclose(mapped.values, 3 * plain.values - 50, atol=1e-3)
    np.testing.assert_allclose(mapped.opacities, plain.opacities)


def test_the_threshold_lies_between_air_and_material(rng):
    histogram = Histogram.of(psw.Volume(two_materials(rng)))
    assert 20 < histogram.threshold < 115
    assert 115 < histogram.main < 125
    assert 130 < histogram.split < 210


def test_an_unknown_name():
    with pytest.raises(TransferFunctionError, match="choose one of ct_bone"):
        presets.make("bones", psw.Volume(ball()))


def test_all_are_described():
    assert all(len(presets.describe(name)) > 10 for name in presets.NAMES)


def test_colours_are_linear():
    ((value, colour, opacity),) = presets.srgb_points([(3.0, "ff8000", 0.5)])
    assert (value, opacity) == (3.0, 0.5)
    # sRGB 128 / 255 is 0.2159 of the light (IEC 61966-2-1).
    np.testing.assert_allclose(colour, (1, 0.21586, 0), atol=1e-5)


@pytest.mark.parametrize("size", [1e-40, 1.0, 1e38])
def test_values_that_swing_about_their_most_frequent_one_show(size):
    z, y, x = np.indices((24, 24, 24)) / 23
    waves = (np.sin(9 * x + 4 * y) + np.sin(8 * y - 5 * z + 1) + np.sin(7 * z + 6 * x * y + 2)) / 3
    volume = psw.Volume((waves * size).astype(np.float32))
    assert Histogram.of(volume).threshold < 0.8 * volume.value_range[1]
    view = psw.View.look_at((40, 30, 60), volume.centre, (0, 1, 0), 40, (32, 32))
    assert psw.Renderer(volume).render(view)[..., 3].max() > 0.2
