"""How far a picture is from the truth.

Pictures are (height, width, 4), linear, premultiplied RGBA with peak 1; all sums are in float64.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ..errors import PerspSWError

Picture = NDArray[np.floating]

_RADIUS, _SIGMA = 5, 1.5  # the 11 × 11 Gaussian window of Wang et al.
_C1, _C2 = 0.01**2, 0.03**2


def psnr(image: Picture, truth: Picture) -> float:
    """Peak signal-to-noise ratio in dB over the whole picture and its four channels; inf when equal."""
    return _decibels(_difference(image, truth))


def psnr_covered(image: Picture, truth: Picture) -> float:
    """`psnr` over the pixels with alpha > 0 in either picture; inf when equal or when there are none."""
    difference = _difference(image, truth)
    return _decibels(difference[(image[..., 3] > 0) | (truth[..., 3] > 0)])


def mean_signed_error(image: Picture, truth: Picture) -> float:
    """Mean of image − truth over all pixels and channels: positive where the image is too bright or dense."""
    return float(_difference(image, truth).mean())


def rms_error(image: Picture, truth: Picture) -> float:
    """Root mean square of image − truth over all pixels and channels."""
    return float(np.sqrt((_difference(image, truth) ** 2).mean()))


def max_error(image: Picture, truth: Picture) -> float:
    """Largest |image − truth|."""
    return float(np.abs(_difference(image, truth)).max())


def percentile_error(image: Picture, truth: Picture, percent: float = 99.0) -> float:
    """The |image − truth| that `percent` of all values do not exceed."""
    return float(np.percentile(np.abs(_difference(image, truth)), percent))


def ssim(image: Picture, truth: Picture) -> float:
    """Structural similarity of RGB over black: 1 for equal pictures, the mean over three channels.

    Parameters
    ----------
    image, truth
        At least 11 × 11 pixels.

    Raises
    ------
    PerspSWError
        Pictures of different or too small a size.

    Linear light over black, not what a screen shows: so it is as free of background and display as PSNR.

    Source: Wang, Bovik, Sheikh, Simoncelli, *Image quality assessment: from error visibility to structural
    similarity*, 2004, with their 11 × 11 Gaussian of deviation 1.5, K1 = 0.01, K2 = 0.03 and peak 1. Windows
    that leave the picture do not count; weighted variances are not corrected for bias, as there.
    """
    _difference(image, truth)
    if min(truth.shape[:2]) < 2 * _RADIUS + 1:
        raise PerspSWError(f"ssim needs pictures of at least 11 × 11 pixels; given {truth.shape[:2]}")
    a, b = (np.asarray(picture[..., :3], np.float64) for picture in (image, truth))
    mean_a, mean_b = _blurred(a), _blurred(b)
    variance_a, variance_b = _blurred(a * a) - mean_a**2, _blurred(b * b) - mean_b**2
    covariance = _blurred(a * b) - mean_a * mean_b
    similarity = (2 * mean_a * mean_b + _C1) * (2 * covariance + _C2)
    similarity /= (mean_a**2 + mean_b**2 + _C1) * (variance_a + variance_b + _C2)
    return float(similarity.mean())


def compare(image: Picture, truth: Picture) -> dict[str, float]:
    """All of the above by name; `p99_error` is the 99th percentile of the absolute error."""
    return {
        "psnr": psnr(image, truth),
        "psnr_covered": psnr_covered(image, truth),
        "mean_signed_error": mean_signed_error(image, truth),
        "rms_error": rms_error(image, truth),
        "p99_error": percentile_error(image, truth, 99),
        "max_error": max_error(image, truth),
        "ssim": ssim(image, truth),
    }


def _difference(image: Picture, truth: Picture) -> NDArray[np.float64]:
    if image.shape != truth.shape or image.ndim != 3 or image.shape[2] != 4:
        raise PerspSWError(
            f"pictures to compare are (height, width, 4), both alike; given {image.shape} and {truth.shape}"
        )
    return np.asarray(image, np.float64) - np.asarray(truth, np.float64)


def _decibels(difference: NDArray[np.float64]) -> float:
    square = float((difference**2).mean()) if difference.size else 0.0
    return float("inf") if square == 0 else -10 * float(np.log10(square))


def _blurred(channels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gaussian-weighted means of all windows that lie wholly in the picture: rows, then columns."""
    offsets = np.arange(-_RADIUS, _RADIUS + 1)
    weights = np.exp(-0.5 * (offsets / _SIGMA) ** 2)
    weights /= weights.sum()
    rows = sliding_window_view(channels, len(weights), axis=0) @ weights
    return sliding_window_view(rows, len(weights), axis=1) @ weights
