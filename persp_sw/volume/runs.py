"""The run-length store: for each principal axis the voxels that a transfer function can see."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _jit
from ..arrays import Voxels
from ..kernels import encode
from .grid import Volume
from .levels import STANDARD_AXES, BlockBounds, standard_rows

# Packed voxels are read in vectors that may begin before a run and end after it.
PADDING = 128


class Visibility(Protocol):
    """What the store must know of a classification; see `optics.classification.Classification`."""

    seen: NDArray[np.int64]
    origin: float
    scale: float


class EverythingVisible:
    """A `Visibility` that skips only blocks of NaN: for measuring what skipping saves."""

    seen = np.array([0, 0, 1], np.int64)
    origin = 0.0
    scale = 0.0


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
        encode.unpack(self.needed, self.offsets, self.voxels, rows, stored)
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
    dense_bytes: int

    @property
    def bytes(self) -> int:
        """Stored voxels and their index."""
        return self.voxels_bytes + self.index_bytes


class RunStore:
    """Three run-length encoded copies of a volume, one per principal axis, each made when first needed.

    Parameters
    ----------
    volume
        At least two voxels along every axis.
    visibility
        What can be seen; `classify` changes it, and axes are encoded anew when next needed. The blocks'
        bounds do not depend on it and are kept.
    progress
        Called as progress(steps done, steps, "encoding x") while an axis is encoded.
    """

    def __init__(
        self,
        volume: Volume,
        visibility: Visibility,
        progress: Callable[[int, int, str], None] | None = None,
    ):
        self.volume = volume
        self.progress = progress
        self.bounds = BlockBounds(volume)
        self._axes: dict[int, AxisRuns] = {}
        self._box: tuple[NDArray, NDArray] | None = None
        self._visibility = visibility
        self.encode_seconds = 0.0  # spent so far, compilation not counted

    def classify(self, visibility: Visibility) -> None:
        """Change what can be seen; everything encoded so far is dropped."""
        self._visibility = visibility
        self._axes.clear()
        self._box = None

    def axis(self, axis: int, *, pairs: bool = False) -> AxisRuns:
        """Runs of principal axis 0 (x), 1 (y) or 2 (z), encoded now if need be.

        `pairs`: also for samples between slices, which see a few blocks more.
        """
        runs = self._axes.get(axis)
        if runs is None or (pairs and not runs.has_pairs):
            with self._timed():
                runs = self._axes[axis] = self._encode(axis, pairs)
        return runs

    def visible_box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Lowest and highest corner, object space, of all that can be seen; None if nothing can.

        From the blocks of slice pairs, which contain those of every axis' slices; blocks make it up to three
        cells wide of the mark.
        """
        if self._box is None:
            axis = 2  # always the same, or the picture would depend on what was encoded before
            box = np.empty(6, np.int64)
            with self._timed():
                encode.bounding_box(self._mark(axis, pairs=True), box)
            j0, j1, k0, k1, m0, m1 = box.tolist()
            low, high = np.full(3, np.inf), np.full(3, -np.inf)
            if j0 <= j1:
                axes = list(STANDARD_AXES[axis])
                low[axes] = encode.BLOCK * m0, j0, k0
                high[axes] = encode.BLOCK * (m1 + 1), j1 + 1, k1 + 1
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
            dense_bytes=self.volume.data.nbytes,
        )

    @property
    def bytes(self) -> int:
        """Memory of the axes encoded so far: voxels and index, without the blocks' bounds."""
        return sum(runs.voxel_count * runs.voxels.itemsize + runs.index_bytes for runs in self._axes.values())

    def _report(self, step: int, axis: int) -> None:
        if self.progress:
            self.progress(step, 3, f"encoding {'xyz'[axis]}")

    @contextmanager
    def _timed(self) -> Iterator[None]:
        """Add the time spent in the block, less compilation, to `encode_seconds`."""
        start = perf_counter() - _jit.compile_seconds()
        yield
        self.encode_seconds += max(perf_counter() - _jit.compile_seconds() - start, 0.0)

    def _mark(self, axis: int, *, pairs: bool) -> NDArray[np.uint64]:
        low, high = self.bounds.of(axis)
        n_j, n_k, n_m = low.shape
        visible = np.empty((n_j, n_k - 1 if pairs else n_k, -(-n_m // encode.WORD)), np.uint64)
        mark = encode.mark_visible_pairs if pairs else encode.mark_visible_cells
        mark(low, high, self._visibility.seen, self._visibility.origin, self._visibility.scale, visible)
        return visible

    def _encode(self, axis: int, pairs: bool) -> AxisRuns:
        rows = standard_rows(self.volume, axis)
        n_j, n_k, n_i = rows.shape
        self._report(0, axis)
        visible = self._mark(axis, pairs=False)
        between = self._mark(axis, pairs=True) if pairs else np.empty((0, 0, visible.shape[2]), np.uint64)
        needed = np.empty((n_j, n_k, visible.shape[2]), np.uint64)
        self._report(1, axis)
        encode.mark_needed(between if pairs else visible, pairs, needed)
        counts = np.empty(needed.shape, np.int64)
        runs = np.empty(needed.shape, np.int64)
        encode.count_voxels(needed, n_i, counts, runs)
        self._report(2, axis)
        ends = np.cumsum(counts.reshape(-1))
        offsets = PADDING + (ends - counts.reshape(-1)).reshape(counts.shape)
        voxels = np.zeros(int(counts.sum()) + 2 * PADDING, rows.dtype)
        encode.pack(rows, needed, offsets, voxels)
        self._report(3, axis)
        return AxisRuns((n_i, n_j, n_k), visible, between, needed, offsets, voxels, int(runs.sum()))
