"""Pictures on disk: checked before the work that makes them, encoded only here."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import FileError, MissingPackageError, ViewError

SUFFIXES = (".png", ".npy", ".exr")

# Perceptually even from black to pale yellow (matplotlib's inferno, every eighth), sRGB.
_INFERNO = np.array(
    [
        (0, 0, 4),
        (27, 12, 65),
        (74, 12, 107),
        (120, 28, 109),
        (165, 44, 96),
        (207, 68, 70),
        (237, 105, 37),
        (251, 155, 6),
        (252, 255, 164),
    ],
    np.float64,
)


def check_output(path: str | Path) -> Path:
    """`path`, if a picture can be written there: call it before the work whose result goes there.

    Raises
    ------
    FileError
        A suffix other than .png, .npy and .exr, a missing folder, a folder in the way, or no right to write.
    MissingPackageError
        .exr without the OpenEXR package.
    """
    path = Path(path)
    if path.is_dir():
        raise FileError(f"cannot write the picture {path}: it is a folder; give a file in it")
    if path.suffix.lower() not in SUFFIXES:
        raise FileError(
            f"cannot tell the format of the picture {str(path)!r}: end its name in "
            f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        )
    if not path.parent.is_dir():
        raise FileError(f"cannot write the picture {path}: there is no folder {path.parent}; make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise FileError(f"cannot write the picture {path}: permission denied; choose another place")
    if path.suffix.lower() == ".exr" and importlib.util.find_spec("OpenEXR") is None:
        raise MissingPackageError(
            f"writing {path.name} needs the package OpenEXR: pip install 'persp-sw[exr]', or write .npy"
        )
    return path


def output_folder(path: str | Path) -> Path:
    """The folder that pictures go to, made if it is not there; FileError where it cannot be written to."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(
            f"cannot make the folder {folder}: {error.strerror}; choose another with -o"
        ) from None
    if not os.access(folder, os.W_OK):
        raise FileError(f"cannot write to the folder {folder}: permission denied; choose another with -o")
    return folder


def srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """Linear light 0 … 1 encoded for screens by the sRGB curve, 0 … 1; what lies outside is clipped."""
    linear = np.clip(np.asarray(linear, np.float64), 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def presented(image: ArrayLike, background: ArrayLike = (0, 0, 0)) -> NDArray[np.uint8]:
    """A picture for people: over a background, sRGB-encoded.

    Parameters
    ----------
    image
        (h, w, 4) linear, premultiplied.
    background
        (3,) linear.

    Returns
    -------
    (h, w, 3) uint8.
    """
    image = _checked(image)
    over = image[..., :3] + (1 - image[..., 3:]) * np.asarray(background, np.float64)
    return np.rint(255 * srgb(over)).astype(np.uint8)


def write(path: str | Path, image: ArrayLike, background: ArrayLike = (0, 0, 0)) -> Path:
    """Write a picture in the format that its suffix names.

    Parameters
    ----------
    path
        .png: over the background, sRGB, 8 bits. .npy: float32 (h, w, 4) as it is. .exr: the same channels as
        32-bit floats, R, G, B, A, linear and premultiplied, which is what OpenEXR means by RGBA.
    image
        (h, w, 4) linear, premultiplied, row 0 on top.
    background
        (3,) linear colour; for .png only.

    Raises
    ------
    FileError, MissingPackageError
        As `check_output`, or the disk refused.
    """
    path = check_output(path)
    image = _checked(image)
    try:
        if path.suffix.lower() == ".png":
            write_rgb(path, presented(image, background))
        elif path.suffix.lower() == ".npy":
            np.save(path, image.astype(np.float32, copy=False))
        else:
            _write_exr(path, image.astype(np.float32, copy=False))
    except OSError as error:
        raise FileError(f"cannot write the picture {path}: {error.strerror or error}") from None
    return path


def write_rgb(path: str | Path, rgb: NDArray[np.uint8], *, optimize: bool = True) -> Path:
    """Write (h, w, 3) uint8 sRGB as it is, as PNG. FileError where the disk refuses.

    optimize: the smallest file, which takes some ten times as long; for single pictures.
    """
    from PIL import Image

    try:
        Image.fromarray(np.ascontiguousarray(rgb)).save(path, "PNG", optimize=optimize)
    except OSError as error:
        raise FileError(f"cannot write the picture {path}: {error.strerror or error}") from None
    return Path(path)


def error_scale(error: ArrayLike) -> float:
    """The 1, 2 or 5 times a power of ten that 99.9 % of the errors do not exceed; never under 1e-6."""
    high = max(float(np.quantile(np.abs(error), 0.999)), 1e-6)
    power = 10.0 ** np.floor(np.log10(high))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= high * (1 - 1e-9)))


def error_map(
    image: ArrayLike, truth: ArrayLike, scale: float | None = None
) -> tuple[NDArray[np.uint8], float]:
    """How far a picture is from the truth, pixel by pixel, as a picture with its scale below it.

    Parameters
    ----------
    image, truth
        (h, w, 4) linear, premultiplied.
    scale
        The error shown brightest. None: `error_scale` of this pair.

    Returns
    -------
    rgb
        (h + 24, w, 3) uint8: the largest absolute difference of the four channels, black (0) to pale yellow
        (`scale` and above), and a bar with its numbers.
    scale
        As used.
    """
    image, truth = _checked(image), _checked(truth)
    if image.shape != truth.shape:
        raise ViewError(f"pictures to compare have one size; given {image.shape} and {truth.shape}")
    error = np.abs(image - truth).max(-1)
    scale = error_scale(error) if scale is None else float(scale)
    return np.concatenate([_coloured(error / scale), _bar(error.shape[1], scale)]), scale


def _checked(image: ArrayLike) -> NDArray[np.float64]:
    image = np.asarray(image, np.float64)
    if image.ndim != 3 or image.shape[2] != 4:
        raise ViewError(f"a picture is (height, width, 4); given an array of shape {image.shape}")
    return image


def _coloured(fraction: NDArray[np.float64]) -> NDArray[np.uint8]:
    position = np.clip(np.nan_to_num(fraction, nan=1.0), 0, 1) * (len(_INFERNO) - 1)
    channels = [np.interp(position, np.arange(len(_INFERNO)), _INFERNO[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, -1)).astype(np.uint8)


def _bar(width: int, scale: float, height: int = 24) -> NDArray[np.uint8]:
    """A strip: 0, the colours, the scale; only the colours where there is no room for the numbers."""
    from PIL import Image, ImageDraw

    left, right = (18, 62) if width >= 160 else (0, 0)
    strip = np.full((height, width, 3), 24, np.uint8)
    colours = _coloured(np.linspace(0, 1, width - left - right)[None].repeat(height - 12, 0))
    strip[6:-6, left : width - right] = colours
    if not left:
        return strip
    picture = Image.fromarray(strip)
    draw = ImageDraw.Draw(picture)
    draw.text((left - 6, height // 2), "0", fill=(220, 220, 220), anchor="rm")
    draw.text((width - right + 6, height // 2), f"{scale:g}", fill=(220, 220, 220), anchor="lm")
    return np.asarray(picture)


def _write_exr(path: Path, image: NDArray[np.float32]) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGBA": np.ascontiguousarray(image)}) as file:
        file.write(str(path))
