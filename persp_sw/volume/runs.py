"""The run-length store: for each principal axis the voxels that a transfer function can see."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from .. import _jit
from ..arrays import Voxels
from ..kernels import encode
from ..kernels.encode import PADDING
from .grid import Volume
from .levels import BlockBounds, standard_rows
from .visibility import Visibility, visible_intervals

_PACK = {0: encode.pack_along_y, 1: encode.pack_along_z, 2: encode.pack_along_x}


@dataclass(frozen=True, eq=False)
class AxisRuns:
    """Runs of one principal axis in standard space, scanlines along i; see `kernels/encode.py`.

    Attributes
    ----------
    visible
        uint64 [n_j − 1, n_k, words]: visible blocks of single slices.
    pairs
        uint64 [n_j − 1, n_k − 1, words]: visible blocks of slice pairs, for samples between slices; empty
        where only samples on slices were asked for.
    needed
        uint64 [n_j, n_k, words]: blocks whose voxels are stored.
    offsets
        int64 [n_j, n_k, words]: where each word's voxels start.
    voxels
        `PADDING` zeros, the stored voxels, scanline by scanline, and `PADDING` zeros.
    """

    size: tuple[int, int, int]  # n_i, n_j, n_k
    visible: NDArray[np.uint64]
    pairs: NDArray[np.uint64]
    needed: NDArray[np.uint64]
    offsets: NDArray[np.int64]
    voxels: NDArray[np.generic]
    run_count: int
    reach: int = 0  # voxels stored beyond what is visible, along each axis

    @property
    def has_pairs(self) -> bool:
        """Whether samples between slices may be taken."""
        return self.pairs.size > 0

    @property
    def voxel_count(self) -> int:
        """Number of stored voxels."""
        return self.voxels.size - 2 * PADDING

    @property
    def index_bytes(self) -> int:
        """Memory of masks and offsets."""
        return self.visible.nbytes + self.pairs.nbytes + self.needed.nbytes + self.offsets.nbytes

    def decode(self) -> tuple[Voxels, NDArray[np.bool_]]:
        """Dense [j, k, i] voxels (0 where nothing is stored) and where something is stored."""
        n_i, n_j, n_k = self.size
        rows = np.zeros((n_j, n_k, n_i), self.voxels.dtype)
        stored = np.zeros(rows.shape, np.bool_)
        encode.unpack(self.needed, self.offsets, self.voxels, rows)
        encode.unpack(self.needed, self.offsets, np.ones(self.voxels.shape, np.bool_), stored)
        return rows, stored


@dataclass(frozen=True)
class RunReport:
    """What one axis of the store holds; lengths in voxels, memory in bytes."""

    axis: str
    runs: int
    mean_length: float
    voxels: int
    voxels_bytes: int
    index_bytes: int
    bounds_bytes: int
    dense_bytes: int

    @property
    def bytes(self) -> int:
        """Stored voxels and their index, without the blocks' bounds."""
        return self.voxels_bytes + self.index_bytes


class RunStore:
    """Three run-length encoded copies of a volume, one per principal axis, each made when first needed.

    Parameters
    ----------
    volume
        At least two voxels along every axis.
    visibility
        What can be seen; `classify` changes it, and axes are encoded anew when next needed, if other voxels
        can be seen. The blocks' bounds do not depend on it and are kept.
    progress
        Called as progress(steps done, steps, "encoding x") while an axis is encoded.
    stored
        Whose voxels are kept; None: of what can be seen. It must include that.
    """

    def __init__(
        self,
        volume: Volume,
        visibility: Visibility,
        progress: Callable[[int, int, str], None] | None = None,
        stored: Visibility | None = None,
    ):
        self.volume = volume
        self.progress = progress
        self.bounds = BlockBounds(volume)
        self._axes: dict[int, AxisRuns] = {}
        self._box: tuple[NDArray, NDArray] | None = None
        self._visibility, self._stored = visibility, stored or visibility
        self.encode_seconds = 0.0  # spent so far, compilation not counted

    def classify(self, visibility: Visibility, stored: Visibility | None = None) -> None:
        """Change what can be seen; everything encoded so far is dropped, but where the same voxels can be.

        Other colours, and opacities of values that were visible before, need no encoding.
        """
        before = self._visibility, self._stored
        self._visibility, self._stored = after = visibility, stored or visibility
        if not all(self._see_the_same(a, b) for a, b in zip(before, after, strict=True)):
            self._axes.clear()
            self._box = None

    def _see_the_same(self, one: Visibility, other: Visibility) -> bool:
        ends = zip(visible_intervals(one, self.volume), visible_intervals(other, self.volume), strict=True)
        return all(np.array_equal(a, b) for a, b in ends)

    @property
    def visibility(self) -> Visibility:
        """What can be seen; another object after each `classify`."""
        return self._visibility

    def axis(self, axis: int, *, pairs: bool = False, reach: int = 0) -> AxisRuns:
        """Runs of principal axis 0 (x), 1 (y) or 2 (z), encoded now if need be.

        `pairs`: also for samples between slices, which see a few blocks more. `reach`: with so many voxels
        around, 0 … 4, for gradients.
        """
        runs = self._axes.get(axis)
        if runs is None or (pairs and not runs.has_pairs) or reach > runs.reach:
            with self._timed():
                runs = self._axes[axis] = self._encode(axis, pairs, reach)
        return runs

    def visible_box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Lowest and highest corner, object space, of all that can be seen; None if nothing can.

        From bricks of 4³ cells, so up to three cells wide of the mark, and no axis need be encoded for it.
        """
        if self._box is None:
            box = np.empty(6, np.int64)
            with self._timed():
                encode.bounding_box(self._mark(self._visibility, *self.bounds.bricks()), box)
            z0, z1, y0, y1, x0, x1 = box.tolist()
            low, high = np.full(3, np.inf), np.full(3, -np.inf)
            if z0 <= z1:
                low = encode.BLOCK * np.array([x0, y0, z0], np.float64)
                high = encode.BLOCK * np.array([x1 + 1, y1 + 1, z1 + 1], np.float64)
                high = np.minimum(high, np.array(self.volume.size) - 1)
            self._box = low, high
        return self._box if (self._box[0] <= self._box[1]).all() else None

    def report(self, axis: int) -> RunReport:
        """Runs, their mean length and bytes of one axis, encoded now if need be."""
        runs = self.axis(axis)
        itemsize = runs.voxels.itemsize
        return RunReport(
            axis="xyz"[axis],
            runs=runs.run_count,
            mean_length=runs.voxel_count / max(runs.run_count, 1),
            voxels=runs.voxel_count,
            voxels_bytes=runs.voxel_count * itemsize,
            index_bytes=runs.index_bytes,
            bounds_bytes=sum(bound.nbytes for bound in self.bounds.of(axis)),
            dense_bytes=self.volume.data.nbytes,
        )

    @property
    def bytes(self) -> int:
        """Memory of the axes encoded so far: voxels and index, without the blocks' bounds."""
        return sum(runs.voxel_count * runs.voxels.itemsize + runs.index_bytes for runs in self._axes.values())

    @property
    def bounds_bytes(self) -> int:
        """Memory of the bounds computed so far, of blocks and bricks; they outlive the transfer function."""
        return self.bounds.bytes

    def _report(self, step: int, axis: int) -> None:
        if self.progress:
            self.progress(step, 3, f"encoding {'xyz'[axis]}")

    @contextmanager
    def _timed(self) -> Iterator[None]:
        """Add the time spent in the block, less compilation, to `encode_seconds`."""
        start = perf_counter() - _jit.compile_seconds()
        yield
        self.encode_seconds += max(perf_counter() - _jit.compile_seconds() - start, 0.0)

    def _mark(
        self, visibility: Visibility, low: NDArray, high: NDArray, *, pairs: bool = False
    ) -> NDArray[np.uint64]:
        n_j, n_k, n_m = low.shape
        visible = np.empty((n_j, n_k - 1 if pairs else n_k, -(-n_m // encode.WORD)), np.uint64)
        encode.mark_visible(low, high, *visible_intervals(visibility, self.volume), visible)
        return visible

    def _encode(self, axis: int, pairs: bool, reach: int) -> AxisRuns:
        n_j, n_k, n_i = standard_rows(self.volume, axis).shape
        self._report(0, axis)
        bounds = self.bounds.of(axis)
        visible = self._mark(self._visibility, *bounds)
        between = np.empty((0, 0, visible.shape[2]), np.uint64)
        if pairs:
            between = self._mark(self._visibility, *bounds, pairs=True)
        stored = between if pairs else visible
        if self._stored is not self._visibility:
            stored = self._mark(self._stored, *bounds, pairs=pairs)
        self._report(1, axis)
        needed = np.empty((n_j, n_k, visible.shape[2]), np.uint64)
        counts = np.empty(needed.shape, np.int64)
        runs = np.empty(n_j, np.int64)
        encode.mark_needed(stored, pairs, reach, n_i, needed, counts, runs)
        ends = PADDING + np.cumsum(counts.reshape(-1))
        offsets = (ends - counts.reshape(-1)).reshape(counts.shape)
        self._report(2, axis)
        voxels = np.empty(int(counts.sum()) + 2 * PADDING, self.volume.data.dtype)
        voxels[:PADDING] = voxels[-PADDING:] = 0
        if needed.size:
            _PACK[axis](self.volume.data, needed, offsets, voxels)
        self._report(3, axis)
        size = n_i, n_j, n_k
        return AxisRuns(size, visible, between, needed, offsets, voxels, int(runs.sum()), reach)
