"""What the atlas allows noise in far slices follows from the weights of voxels and levels alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from persp_sw.geometry.detail_zones import BEGIN, END, detail_zones
from persp_sw.measure.atlas import far_slices

SLICES, PIXELS, RAYS = 64, 40, 4  # of the full case: far slices, pixels and rays a pixel along an axis
STEP = (0.2, 0.03)  # voxels that the eye goes from frame to frame
VOXELS = np.arange(-16, 17)
PLACES = (np.arange(256) + 0.5) / 32 - 4  # evenly over what repeats with the voxels of level 3

Array = NDArray[np.float64]
Weights = Callable[[Array], Array]  # (n, voxels): of the voxels along one axis, at n places


def level(number: int) -> Weights:
    """Linear interpolation of a level, each of whose voxels has 1/4, 1/2, 1/4 of the finer level's."""
    places, spread = VOXELS, np.eye(len(VOXELS))
    for fine in range(number):
        kept = [n for n in range(1, len(places) - 1) if places[n] % 2 ** (fine + 1) == 0]
        spread = np.array([(spread[n - 1] + 2 * spread[n] + spread[n + 1]) / 4 for n in kept])
        places = places[kept]
    return lambda x: np.maximum(1 - np.abs(x[:, None] - places) / 2**number, 0) @ spread


def mean_of_rays(apart: float) -> Weights:
    """Of a pixel so many voxels wide."""
    rays = ((np.arange(RAYS) + 0.5) / RAYS - 0.5) * apart
    return lambda x: np.mean([level(0)(x + ray) for ray in rays], axis=0)


def change(parts: list[tuple[float, Weights]]) -> float:
    """Mean square change of one slice's noise, of variance 1, by a step of the eye: of a sum of filters.

    The correlation of two filters is, in the plane of the slice, the product of those along its axes.
    """
    at = [[weights(PLACES + step) for step in (0.0, *STEP)] for _, weights in parts]
    total = 0.0
    for (share, _), one in zip(parts, at, strict=True):
        for (other_share, _), other in zip(parts, at, strict=True):
            still, *moved = ((one[0] * weights).sum(1).mean() for weights in other)
            total += 2 * share * other_share * (still**2 - np.prod(moved))
    return total


def seen_slices() -> tuple[float, Array]:
    """What pixels are apart at distance 1, and the far slices' distances, the nearest first; voxels."""
    volume = far_slices.noise(SLICES)
    (view,) = far_slices.path(volume, 1, PIXELS)
    return 2 * np.tan(np.radians(far_slices._FOV_DEG / 2)) / PIXELS, view.eye.position[2] - np.arange(SLICES)[
        ::-1
    ]


@pytest.fixture(scope="module")
def slices() -> tuple[Array, Array]:
    """Changes of each far slice, the nearest first: as composited, and of the mean of the rays."""
    pitch, distances = seen_slices()
    zones = list(detail_zones(pitch, 0.0, distances[-1], 4))
    composited = []
    for distance in distances:
        zone = next(zone for zone in zones if zone.near <= distance < zone.far)
        coarse = zone.share[0] + zone.share[1] * distance
        parts = [(1 - coarse, level(zone.fine)), (coarse, level(zone.fine + 1))]
        composited.append(change([part for part in parts if part[0] > 0]))
    means = [change([(1.0, mean_of_rays(pitch * distance))]) for distance in distances]
    return np.array(composited), np.array(means)


def test_where_levels_take_over_is_as_it_is_told():
    assert pytest.approx((2.4, 3.4), abs=0.04) == (BEGIN, END)
    pitch, distances = seen_slices()
    nearest, farthest = pitch * distances[[0, -1]]
    assert (nearest, farthest) == pytest.approx((2.8, 5.2), abs=0.05)
    assert (nearest - BEGIN) / (END - BEGIN) == pytest.approx(0.39, abs=0.005)


def test_the_bound_for_noise_is_what_is_expected_and_a_third_more(slices: tuple[Array, Array]):
    composited, means = slices
    opacity = 0.05 / 2  # of the haze, at the mean of noise
    let_through = (1 - opacity) ** (np.arange(SLICES) + 0.5)
    assert composited.sum() / means.sum() == pytest.approx(2.1, abs=0.05)
    seen = let_through**2
    expected = (seen * composited).sum() / (seen * means).sum()
    assert expected == pytest.approx(3.0, abs=0.05)
    assert pytest.approx(4 / 3 * expected, rel=0.01) == far_slices.NOISE


def test_the_nearest_slices_keep_the_most_of_the_finer_noise(slices: tuple[Array, Array]):
    kept = slices[0] / change([(1.0, level(0))])
    assert kept[0] == kept.max() == pytest.approx(0.41, abs=0.005)
    assert kept[0] < far_slices.LESS
