"""Small features seen by two eyes: blobs whose place and brightness can be measured in a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume
from .eye_paths import Array

# Gaussian profile, voxels. The eye image's pixels are at most two voxels apart where blobs are, and at most
# 2.2 behind them, where no coarser level begins yet: such a blob is aliased by exp(−2·(π·σ/2)²) = 4e-4.
SIGMA = 1.25
_REACH = 2.5 * SIGMA  # of the window in which a blob is measured
_MARGIN = 5 * SIGMA
THIN = TransferFunction([(0, (1, 1, 1), 0), (255, (1, 0.9, 0.8), 0.2)])


@dataclass(frozen=True, eq=False)
class Blobs:
    """Blobs off the lattice.

    Attributes
    ----------
    places
        (n, 3) of their centres, world, which is the volume's index space.
    """

    volume: Volume
    places: Array
    _truths: dict[View, Array] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, edge: int, count: int = 6, seed: int = 11) -> Blobs:
        """`count` blobs in edge³ voxels."""
        rng = np.random.default_rng(seed)
        places: list[Array] = []
        while len(places) < count:
            place = rng.uniform(_MARGIN, edge - 1 - _MARGIN, 3)
            if all(np.linalg.norm(place - other) > 0.35 * edge for other in places):
                places.append(place)
        z, y, x = np.indices((edge,) * 3)
        data = np.zeros((edge,) * 3)
        for place in places:
            squared = (x - place[0]) ** 2 + (y - place[1]) ** 2 + (z - place[2]) ** 2
            data += 255 * np.exp(-squared / (2 * SIGMA**2))
        return cls(Volume(data.astype(np.float32), name="blobs"), np.array(places))

    def truth(self, view: View) -> Array:
        """The converged reference's picture, cast once."""
        if view not in self._truths:
            self._truths[view] = reference.render(self.volume, THIN, view)
        return self._truths[view]

    def contrasts(self, view: View, picture: NDArray[np.floating]) -> Array:
        """(n,): how bright each blob's middle is, as a part of what it should be; NaN where not alone."""
        centres, reach, alone = self._windows(view)
        ours, truth = (
            np.array([_window(image, centre, max(reach / 3, 1.0)).sum() for centre in centres])
            for image in (picture, self.truth(view))
        )
        return np.where(alone, ours / np.maximum(truth, 1e-9), np.nan)

    def displacements(self, view: View, picture: NDArray[np.floating]) -> Array:
        """(n, 2): pixels from where each blob should be to where it is; NaN where not alone."""
        centres, reach, alone = self._windows(view)
        shift = _centroids(picture, centres, reach) - _centroids(self.truth(view), centres, reach)
        return np.where(alone[:, None], shift, np.nan)

    def _windows(self, view: View) -> tuple[Array, float, NDArray[np.bool_]]:
        """Pixel places of the centres, the radius of a blob's window, and which blobs have theirs alone."""
        across = view.wall.lower_right - view.wall.lower_left
        centres = view.project(self.places)
        aside = view.project(self.places + across / np.linalg.norm(across))
        reach = float(_REACH * np.linalg.norm(aside - centres, axis=1).max())
        gaps = np.linalg.norm(centres[:, None] - centres[None], axis=-1) + 1e9 * np.eye(len(centres))
        inside = ((centres > reach) & (centres < np.array(view.size) - reach)).all(1)
        return centres, reach, (gaps.min(1) > 3 * reach) & inside


def _window(image: NDArray[np.floating], centre: Array, reach: float) -> Array:
    height, width = image.shape[:2]
    column, row = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    return np.where((column - centre[0]) ** 2 + (row - centre[1]) ** 2 <= reach**2, image[..., 3], 0.0)


def _centroids(image: NDArray[np.floating], centres: Sequence[Array], reach: float) -> Array:
    """(n, 2) alpha-weighted (column, row); NaN where nothing shows."""
    found = []
    for centre in centres:
        weight = _window(image, centre, reach)
        row, column = np.indices(weight.shape) + 0.5
        total = weight.sum()
        found.append(
            [(column * weight).sum() / total, (row * weight).sum() / total] if total else [np.nan] * 2
        )
    return np.array(found)
