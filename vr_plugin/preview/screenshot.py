"""Pictures of a preview at any size: rendered for it, not taken from the window."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw
from persp_sw.errors import ViewError

from .pictures import PreviewPictures
from .wanted import Wanted

LARGEST = 16384  # pixels along an edge, samples counted
_LARGE = 3 * 4096**2  # bytes of pixels, from which on the smallest file takes too long to find
_ROWS = 256  # encoded at a time: eight bytes a channel in between


def screenshot(
    pictures: PreviewPictures,
    wanted: Wanted,
    path: str | Path,
    size: tuple[int, int] | None = None,
    samples: int = 1,
) -> Path:
    """Render what is wanted at any size, without texts, and write it.

    The camera's height of view stays, its width follows the size. It is drawn by the software warp, which has
    no limit of a graphics card's; a picture of 8192 × 8192 pixels takes 1.3 GB while it is made, in stereo
    some 8 GB, for two eyes are combined in float64.

    Parameters
    ----------
    path
        .png (over the background, sRGB), .npy or .exr (as `persp_sw.images.write` has them; in mono without
        background).
    size
        Width and height, pixels. None: the window's.
    samples
        Along each edge of a pixel, which is their mean: 2 renders four pixels for each.

    Raises
    ------
    FileError, MissingPackageError
        As `persp_sw.images.check_output`.
    ViewError
        A size that is none, or larger than `LARGEST`.
    """
    path = psw.images.check_output(path)
    image = rendered(pictures, wanted, size, samples)
    if path.suffix.lower() != ".png":
        return psw.images.write(path, image)
    rgb = np.empty((*image.shape[:2], 3), np.uint8)
    for row in range(0, len(image), _ROWS):
        rgb[row : row + _ROWS] = psw.images.presented(image[row : row + _ROWS], pictures.background)
    return psw.images.write_rgb(path, rgb, optimize=rgb.size < _LARGE)


def rendered(
    pictures: PreviewPictures, wanted: Wanted, size: tuple[int, int] | None = None, samples: int = 1
) -> NDArray[np.float32]:
    """The picture: (height, width, 4) float32, linear, premultiplied; in stereo and from outside opaque.

    In mono it is what `Renderer.render` gives of the camera's view, bit by bit. Quality is the one that is
    held, or that of the settings at first, whatever the frame rate has made of it.
    """
    width, height = size or wanted.size
    if not all(isinstance(n, int) and n >= 1 for n in (width, height, samples)):
        raise ViewError(f"a picture has a size and samples of 1 and more; given {size} and {samples}")
    if max(width, height) * samples > LARGEST:
        raise ViewError(
            f"a picture has up to {LARGEST} pixels along an edge, samples counted; given {width} × {height} "
            f"with {samples} samples along an edge of each"
        )
    pictures = pictures.for_stills()
    unhurried = replace(wanted.edits, target_hz=None)
    large = replace(wanted, size=(width * samples, height * samples), edits=unhurried)
    done = pictures.composite(large)
    drawn, _ = pictures.draw(large, done)
    if not wanted.outside and wanted.stereo.shown_mode in ("mono", "left", "right"):
        image = drawn[wanted.stereo.channels[0]]
    else:
        image = pictures.window(large, drawn)
    if samples == 1:
        return image
    return image.reshape(height, samples, width, samples, 4).mean((1, 3), dtype=np.float64).astype(np.float32)
