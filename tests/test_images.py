"""Pictures on disk: encoding, error maps, and refusals before the work."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from persp_sw import images
from persp_sw.errors import FileError, MissingPackageError, ViewError


def picture(rng, height: int = 5, width: int = 7) -> np.ndarray:
    """Random premultiplied RGBA."""
    alpha = rng.random((height, width, 1), np.float32)
    return np.concatenate([rng.random((height, width, 3), np.float32) * alpha, alpha], -1)


@pytest.mark.parametrize(
    ("linear", "code"),
    # IEC 61966-2-1; 188 is the known code of half the light. What lies outside is clipped.
    [(0.0, 0), (0.5, 188), (1.0, 255), (0.2158605, 128), (0.001, 3), (-1.0, 0), (2.0, 255)],
)
def test_srgb_codes(linear, code):
    assert round(255 * float(images.srgb(linear))) == code


def test_a_png_is_over_the_background_and_upright(tmp_path: Path):
    image = np.zeros((2, 3, 4), np.float32)
    image[0, 0] = (0.5, 0, 0, 0.5)  # half covered with red, above left
    path = images.write(tmp_path / "a.png", image, (0, 0, 1))
    with Image.open(path) as written:
        assert (written.mode, written.size) == ("RGB", (3, 2))
        assert written.getpixel((0, 0)) == (188, 0, 188)
        assert written.getpixel((2, 1)) == (0, 0, 255)


def test_npy_keeps_every_bit(tmp_path: Path, rng):
    image = picture(rng)
    written = np.load(images.write(tmp_path / "a.npy", image, (1, 1, 1)))
    assert written.dtype == np.float32
    assert np.array_equal(written, image)


def test_exr_keeps_every_bit_or_says_what_is_missing(tmp_path: Path, rng):
    image = picture(rng)
    if importlib.util.find_spec("OpenEXR") is None:
        with pytest.raises(MissingPackageError, match=r"persp-sw\[exr\]"):
            images.write(tmp_path / "a.exr", image)
        assert not list(tmp_path.iterdir())
        return
    import OpenEXR

    images.write(tmp_path / "a.exr", image)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert np.array_equal(file.channels()["RGBA"].pixels, image)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("a.jpg", "end its name in .png, .npy or .exr"),
        ("a", "end its name in"),
        ("none/a.png", "there is no folder"),
        ("folder", "it is a folder"),
        ("folder.png", "it is a folder"),
        ("file.npy/a.png", "there is no folder"),
    ],
)
def test_refused_before_the_work(tmp_path: Path, name, words):
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file.npy").touch()
    with pytest.raises(FileError, match=words):
        images.check_output(tmp_path / name)


def test_without_the_right_to_write(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(images.os, "access", lambda path, mode: False)  # root may write anywhere
    with pytest.raises(FileError, match="permission denied"):
        images.check_output(tmp_path / "a.png")


def test_checking_makes_no_file(tmp_path: Path):
    assert images.check_output(str(tmp_path / "A.PNG")) == tmp_path / "A.PNG"
    assert not list(tmp_path.iterdir())


def test_a_disk_that_fails_is_one_clear_error():
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    with pytest.raises(FileError, match="cannot write the picture /dev/full"):
        images.write_rgb("/dev/full", np.zeros((64, 64, 3), np.uint8))


@pytest.mark.parametrize("shape", [(4, 4), (4, 4, 3), (4, 4, 4, 4)])
def test_not_a_picture(tmp_path: Path, shape):
    with pytest.raises(ViewError, match="height, width, 4"):
        images.write(tmp_path / "a.png", np.zeros(shape))


@pytest.mark.parametrize(
    ("error", "scale"), [(0.0, 1e-6), (0.9, 1.0), (0.3, 0.5), (0.2, 0.2), (0.011, 0.02), (3e-4, 5e-4)]
)
def test_the_scale_is_a_round_number_above_the_error(error, scale):
    assert images.error_scale(np.full((9, 9), -error)) == pytest.approx(scale)


def test_an_error_map_shows_the_largest_channel():
    image = np.zeros((30, 200, 4), np.float32)
    image[3, 4] = (0, -0.05, 0.02, 0)
    image[3, 5] = (0, 0, 0, 0.1)
    image[3, 6] = (7, 0, 0, 0)
    rgb, scale = images.error_map(image, np.zeros_like(image), 0.1)
    assert (rgb.shape, rgb.dtype, scale) == ((54, 200, 3), np.uint8, 0.1)
    assert rgb[0, 0].tolist() == [0, 0, 4]
    assert rgb[3, 4].tolist() == [165, 44, 96]  # the middle of the colours
    assert rgb[3, 5].tolist() == rgb[3, 6].tolist() == [252, 255, 164]
    bar = rgb[30:].astype(int).sum(-1)
    assert bar[12, 20] < bar[12, 60] < bar[12, 130]  # from dark to bright
    assert (bar[:, 150:] > 500).any()  # and a number beside it


def test_brightness_of_the_colours_grows_evenly():
    """Perceptual: lightness (CIE L*) rises monotonically, in steps that differ less than threefold."""
    codes = images._coloured(np.linspace(0, 1, 33)) / 255
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    luminance = linear @ (0.2126, 0.7152, 0.0722)
    lightness = np.where(luminance > 0.008856, 116 * np.cbrt(luminance) - 16, 903.3 * luminance)
    steps = np.diff(lightness)
    assert steps.min() > 0
    assert steps.max() < 3 * np.median(steps)


def test_narrow_maps_have_a_bar_too():
    rgb, _ = images.error_map(np.ones((8, 8, 4)), np.zeros((8, 8, 4)))
    assert rgb.shape == (32, 8, 3)


def test_pictures_of_two_sizes():
    with pytest.raises(ViewError, match="one size"):
        images.error_map(np.zeros((4, 4, 4)), np.zeros((4, 5, 4)))
