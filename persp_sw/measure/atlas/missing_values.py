"""Voxels without a value: how they are counted, and how much shows beside them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from .face_views import JudgedFace, judged_faces

# Plain samples on slices beside a voxel without a value stand for half an interval of a cell that has it for
# a corner, on either side of it.
BESIDE_A_GAP = 1.0


def with_gaps(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """A cube of voxels with a ball without values at its front, and lone voxels elsewhere: NaN, ∞ and −∞."""
    n, values = len(values), values.astype(np.float32)
    z, y, x = np.indices(values.shape) / (n - 1.0) - 0.5
    values[(x - 0.1) ** 2 + (y - 0.1) ** 2 + (z - 0.4) ** 2 < 0.25**2] = np.nan
    lone = np.random.default_rng(9).random(values.shape) < 10 / n**3
    values[lone] = np.inf
    values[np.roll(lone, 3, 2)] = -np.inf
    return values


def miscounted(values: NDArray[np.float32]) -> int:
    """How far the number of voxels without a value that a volume tells is from the number put in."""
    return abs(Volume(values).nonfinite - int(np.count_nonzero(~np.isfinite(values))))


def shown_in_gaps(
    samples_per_interval: int | None = None,
    judged: Callable[[Renderer, View], list[JudgedFace]] = judged_faces,
) -> float:
    """Most of a ray, in voxels, that shows although it is in a cell with a corner without a value."""
    data = np.full((9, 9, 9), 1, np.float32)
    data[4, 4, 4] = np.nan
    volume = Volume(data)
    transfer = TransferFunction([(1, (1, 1, 1), 0.1)], 1.0)
    renderer = Renderer(
        volume, transfer, Settings(residual=0, samples_per_interval=samples_per_interval, quality=4)
    )
    view = View.look_at((4.2, 4.3, -300), (4.2, 4.3, 4), (0, 1, 0), 1.5, (32, 32))
    faces = judged(renderer, view)
    with np.errstate(divide="ignore"):
        more = [np.log1p(-face.truth[..., 3]) - np.log1p(-face.ours[..., 3]) for face in faces]
    return float(np.max(more)) / float(transfer.extinction(1.0))
