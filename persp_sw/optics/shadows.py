"""The shadows that a volume casts on itself, for each light that asks for them."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..geometry.parts import shown_parts
from ..geometry.regions import Regions, box_rows
from ..kernels import attenuate
from ..kernels.encode import PADDING
from ..kernels.phong import NUMBERS
from ..volume.grid import Volume
from ..volume.lift import lifted
from .classification import Classification
from .look import Look
from .shading import shade_of

# Voxels along the longest axis beyond which shadows are coarser than the data; see `docs/look.md`.
FINEST = 160
_FULL = 65535
# Voxels a slice. Less is a light along an axis, as a turned pose rounds it: voxels on a side of the volume
# would be lit through that side.
_STRAIGHT = 1e-9


class Shadows:
    """How much of each shadow-casting light reaches every place of a volume.

    Parameters
    ----------
    volume, classification, look, regions
        What is shown, and what hides nothing because it is cut away. Shadows hold for these alone.

    Attributes
    ----------
    factor
        Voxels of the volume that one of the shadows' is, along each axis.
    left
        uint16 [light, z, y, x], 65535 for all of the light; voxel (x, y, z) lies at the volume's (x, y, z) ·
        factor. Lights in the order of `look.lighting.lights` without those that cast none.

    Accuracy: of a homogeneous medium exact to 1e-5 where no way of the light, at a slope of one voxel a slice
    at most, began in a side; elsewhere never too dark, and too bright where sides are as near as edges of
    shadows are soft: by about half the square root of the slices that the light has passed. What is dense has
    some of the light of clearer voxels next to it, so that surfaces show no steps. Where `factor` does not
    divide the voxels' number less one, the volume ends up to `factor` − 1 voxels late for light.
    Cost: a classification of all voxels, and for each light a pass over the coarse ones.
    """

    def __init__(
        self,
        volume: Volume,
        classification: Classification,
        look: Look,
        regions: Regions,
        factor: int | None = None,
    ):
        self.factor = factor or max(1, 2 ** int(np.ceil(np.log2(max(volume.size) / FINEST))))
        self._cells = -(-(np.array(volume.size) - 1) // self.factor)  # x, y, z
        extinction = self._extinction(volume, classification, look)
        if regions != Regions():
            extinction *= self._shown(volume, regions)
        lights = [light for light in look.lighting.lights if light.shadows]
        self.left = np.empty((len(lights), *extinction.shape), np.uint16)
        towards = np.linalg.inv(volume.world_from_object[:3, :3])
        for light, left in zip(lights, self.left, strict=True):
            left[:] = _swept(extinction, towards @ light.direction, self._pose(volume))
        self.standard = cache(self._standard)

    def _pose(self, volume: Volume) -> NDArray[np.float64]:
        return self.factor * volume.world_from_object[:3, :3]

    def _extinction(self, volume: Volume, classification: Classification, look: Look) -> NDArray[np.float32]:
        shade = shade_of(look, volume, [0, 1, 2], classification)
        out = np.empty((self._cells + 1)[::-1], np.float32)
        attenuate.coarse_extinction(
            lifted(volume).data,
            classification.rows,
            classification.origin,
            classification.scale,
            len(classification.table) - 1,
            shade.numbers[:NUMBERS].astype(np.float64),
            self.factor,
            float(abs(np.linalg.det(self._pose(volume))) ** (1 / 3)),
            out,
        )
        return out

    def _shown(self, volume: Volume, regions: Regions) -> NDArray[np.float32]:
        """How much of each voxel's surroundings is shown: borders fade over a voxel, but no sides."""
        z, y, x = (np.arange(n + 1.0) * self.factor for n in self._cells[::-1])
        shown = np.zeros((len(z), len(y), len(x)), np.float32)
        sides = box_rows(np.zeros(3), np.array(volume.size) - 1.0)
        for part in shown_parts(regions, volume, np.append(np.array(volume.size) / 2, 1)):
            inside = np.ones_like(shown)
            for a, b, c, d in part.half_spaces:
                if ([a, b, c, d] == sides).all(1).any():
                    continue
                size = np.linalg.norm([a, b, c]) * self.factor
                depth = (a * x + (b * y[:, None] + (c * z[:, None, None] + d))) / size
                inside = np.minimum(inside, np.clip(depth + 0.5, 0, 1), dtype=np.float32)
            shown += inside
        return np.minimum(shown, 1)

    def _standard(self, axes: tuple[int, int, int]) -> NDArray[np.uint16]:
        """`left` as [light, j, k, i], one-dimensional, with `PADDING` on both sides."""
        i, j, k = (3 - axis for axis in axes)
        return np.pad(self.left.transpose(0, j, k, i).ravel(), PADDING)

    def size(self, axes: tuple[int, int, int]) -> NDArray[np.int64]:
        """Voxels along i, j and k."""
        return (self._cells + 1)[list(axes)].astype(np.int64)


def _swept(
    extinction: NDArray[np.float32], towards: NDArray[np.float64], pose: NDArray[np.float64]
) -> NDArray[np.uint16]:
    """One light's part that is left; `towards` it in object space, `pose` of the coarse voxels."""
    axis = int(np.argmax(np.abs(towards)))
    step = towards / abs(towards[axis])
    step[np.abs(step) < _STRAIGHT] = 0
    others = [n for n in range(3) if n != axis]
    turned = [2 - axis, *(2 - n for n in others)]  # [slice, a, b] of [z, y, x]
    extinction = np.ascontiguousarray(extinction.transpose(turned))
    length = float(np.linalg.norm(pose @ step))
    swept, left = np.empty_like(extinction), np.empty_like(extinction)
    attenuate.sweep(extinction, bool(step[axis] > 0), *(float(step[n]) for n in others), length, swept)
    attenuate.light_beside(swept, np.exp(-length * extinction), left)
    return np.rint(left.transpose(np.argsort(turned)) * _FULL).astype(np.uint16)
