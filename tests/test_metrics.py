"""Figures of merit on pictures whose figures one can work out by hand."""

import numpy as np
import pytest
from tolerances import METRIC

from persp_sw.errors import PerspSWError
from persp_sw.measure import metrics


def pair(seed=1, shape=(19, 23, 4)):
    rng = np.random.default_rng(seed)
    truth = rng.random(shape)
    return np.clip(truth + rng.normal(0, 0.1, shape), 0, 1), truth


def test_constant_offset():
    truth = np.full((16, 16, 4), 0.5)
    report = metrics.compare(truth - 0.1, truth)
    assert abs(report["psnr"] - 20) < METRIC and abs(report["psnr_covered"] - 20) < METRIC
    assert abs(report["mean_signed_error"] + 0.1) < METRIC
    for key in ("rms_error", "max_error", "p99_error"):
        assert abs(report[key] - 0.1) < METRIC


def test_equal_pictures():
    image, _ = pair()
    report = metrics.compare(image, image.copy())
    assert report["psnr"] == report["psnr_covered"] == float("inf")
    assert abs(report["ssim"] - 1) < METRIC
    assert report["mean_signed_error"] == report["rms_error"] == report["max_error"] == 0


def test_one_wrong_value_among_many():
    truth = np.zeros((20, 20, 4))
    image = truth.copy()
    image[3, 4, 2] = 0.8
    report = metrics.compare(image, truth)
    assert abs(report["psnr"] - 10 * np.log10(1600 / 0.64)) < METRIC
    assert report["max_error"] == 0.8 and report["p99_error"] == 0
    assert abs(report["rms_error"] - 0.02) < METRIC and abs(report["mean_signed_error"] - 0.0005) < METRIC


def test_covered_pixels_are_those_with_alpha_in_either():
    truth, image = np.zeros((2, 2, 4)), np.zeros((2, 2, 4))
    truth[0, 0] = 0.5  # missed by the image
    image[0, 1] = 0.25  # not in the truth
    assert abs(metrics.psnr_covered(image, truth) + 10 * np.log10((0.25 + 0.0625) / 2)) < METRIC
    assert abs(metrics.psnr(image, truth) + 10 * np.log10((0.25 + 0.0625) / 4)) < METRIC
    assert metrics.psnr_covered(np.zeros((2, 2, 4)), np.zeros((2, 2, 4))) == float("inf")


def test_percentile_of_a_ladder():
    image = np.arange(101 * 4).reshape(101, 1, 4) / 403
    assert abs(metrics.percentile_error(image, 0 * image, 50) - 0.5) < METRIC
    assert abs(metrics.percentile_error(image, 0 * image) - 0.99) < METRIC


def test_ssim_of_constant_pictures_is_its_luminance_term():
    a, b = np.full((12, 15, 4), 0.3), np.full((12, 15, 4), 0.7)
    assert abs(metrics.ssim(a, b) - (2 * 0.21 + 1e-4) / (0.09 + 0.49 + 1e-4)) < METRIC


def test_ssim_against_the_definition_window_by_window():
    image, truth = pair()
    offsets = np.arange(11) - 5
    window = np.exp(-(offsets[:, None] ** 2 + offsets**2) / (2 * 1.5**2))
    window /= window.sum()
    found = []
    for c in range(3):
        for row in range(19 - 10):
            for column in range(23 - 10):
                a = image[row : row + 11, column : column + 11, c]
                b = truth[row : row + 11, column : column + 11, c]
                mean_a, mean_b = (window * a).sum(), (window * b).sum()
                variances = (window * (a - mean_a) ** 2).sum() + (window * (b - mean_b) ** 2).sum()
                covariance = (window * (a - mean_a) * (b - mean_b)).sum()
                found.append(
                    (2 * mean_a * mean_b + 1e-4)
                    * (2 * covariance + 9e-4)
                    / ((mean_a**2 + mean_b**2 + 1e-4) * (variances + 9e-4))
                )
    assert abs(metrics.ssim(image, truth) - np.mean(found)) < METRIC


def test_ssim_ignores_alpha():
    image, truth = pair()
    other = image.copy()
    other[..., 3] = 0
    assert metrics.ssim(image, truth) == metrics.ssim(other, truth)


def test_float32_pictures_are_summed_in_float64():
    image, truth = (picture.astype(np.float32) for picture in pair())
    wide = metrics.compare(image.astype(np.float64), truth.astype(np.float64))
    assert metrics.compare(image, truth) == wide


@pytest.mark.parametrize("shape", [(16, 17, 4), (16, 16, 3), (16, 16)])
def test_unlike_pictures_are_refused(shape):
    with pytest.raises(PerspSWError, match="alike"):
        metrics.psnr(np.zeros(shape), np.zeros((16, 16, 4) if shape[-1] != 3 else shape))


def test_ssim_of_a_picture_smaller_than_its_window_is_refused():
    with pytest.raises(PerspSWError, match="11"):
        metrics.ssim(np.zeros((10, 30, 4)), np.zeros((10, 30, 4)))
