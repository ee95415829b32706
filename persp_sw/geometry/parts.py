"""Regions as convex parts, front to back.

A ray meets a convex part in one interval, so a part is composited by its range alone, and parts one after the
other are exact if none lies behind one that comes later. A tree of cuts gives both: each cut divides what is
shown by a plane, and the side with the eye comes first (Fuchs, Kedem, Naylor, *On visible surface generation
by a priori tree structures*, 1980). Crop planes and slabs shown outside cut; clip planes and slabs shown
inside only bound the parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import product
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..volume.grid import Volume
from .regions import Regions, box_rows

Array = NDArray[np.float64]

# Voxels. A point so near a plane lies on it; a part thinner than this is none. Coordinates are below 1e4.
_ON_PLANE = 1e-9


@dataclass(frozen=True, eq=False)
class Part:
    """A convex part of what is shown, object space.

    Attributes
    ----------
    low, high
        Corners of its bounding box, to rounding.
    half_spaces
        (n, 4) rows: in the part where a·p + a_0 ≥ 0 for all.
    """

    low: Array
    high: Array
    half_spaces: Array


@dataclass(frozen=True, eq=False)
class _Fork:
    """What lies on the side where plane · (p, 1) > 0, and the rest."""

    plane: Array
    positive: _Tree
    negative: _Tree


_Tree: TypeAlias = "Part | _Fork | None"


class _Cells(NamedTuple):
    """A box of the crop's cells: the first along each axis, and one beyond the last."""

    first: tuple[int, ...]
    end: tuple[int, ...]


class _Cut(NamedTuple):
    """Cells cut at one border of an axis."""

    axis: int
    border: int
    below: _Plan
    above: _Plan


_Plan: TypeAlias = "_Cells | _Cut | None"


def shown_parts(regions: Regions, volume: Volume, eye: Array) -> list[Part]:
    """What `regions` show of a volume as disjoint convex parts: none hides one that comes before it.

    Parameters
    ----------
    eye
        (4,), object space, homogeneous: (x, y, z, 1), or (x, y, z, 0) with the direction towards an eye at
        infinity. Anywhere, in a part too.

    Returns
    -------
    Parts with a volume; empty where nothing is shown. Two parts that touch have the numbers of their border
    in common, and a ray in the border itself is in one of them only.

    Cost: the tree of the regions last used is kept; with it, microseconds.
    """
    key = tuple(volume.world_from_object.ravel().tolist())
    return list(_front_to_back(_tree(regions, volume.size, key), np.asarray(eye, np.float64)))


def _front_to_back(tree: _Tree, eye: Array) -> Iterator[Part]:
    if isinstance(tree, Part):
        yield tree
    elif tree is not None:
        side = tree.plane @ eye
        yield from _front_to_back(tree.positive if side >= 0 else tree.negative, eye)
        behind = tree.negative if side >= 0 else tree.positive
        if side != 0:
            yield from _front_to_back(behind, eye)
        else:
            yield from (_opened(part, eye) for part in _front_to_back(behind, eye))


def _opened(part: Part, eye: Array) -> Part:
    """The part without the sides in whose plane the eye is: rays there are the touching part's."""
    rows = part.half_spaces.copy()
    edge_on = rows @ eye == 0
    rows[edge_on, 3] = np.nextafter(rows[edge_on, 3], -np.inf)
    return Part(part.low, part.high, rows)


@lru_cache(maxsize=16)
def _tree(regions: Regions, size: tuple[int, int, int], pose: tuple[float, ...]) -> _Tree:
    grid = _Grid(size, np.array(pose).reshape(4, 4))
    bounds = regions.planes(grid)
    outside = [(row, half) for row, half, show in regions.slabs(grid) if show == "outside" and half > 0]
    borders, shown = regions.cells(grid)

    def grown(plan: _Plan) -> _Tree:
        if plan is None:
            return None
        if isinstance(plan, _Cut):
            plane = np.append(np.eye(3)[plan.axis], -borders[plan.axis][plan.border])
            return _fork(plane, grown(plan.above), grown(plan.below))
        solid = _Solid.box(*(np.array([b[n] for b, n in zip(borders, end, strict=True)]) for end in plan))
        for row in bounds:
            solid = solid and solid.cut(row)
        return _without_slabs(solid, outside)

    return grown(_fewest_boxes(shown.tobytes(), shown.shape))


@dataclass(frozen=True)
class _Grid:
    """What `Regions` ask of a volume."""

    size: tuple[int, int, int]
    world_from_object: Array


def _fork(plane: Array, positive: _Tree, negative: _Tree) -> _Tree:
    return _Fork(plane, positive, negative) if positive and negative else positive or negative


def _without_slabs(solid: _Solid | None, slabs: list[tuple[Array, float]]) -> _Tree:
    """A convex solid less the slabs |a·p + a_0| < half."""
    if solid is None:
        return None
    if not slabs:
        low, high = solid.vertices.min(0), solid.vertices.max(0)
        return Part(low, high, solid.half_spaces)
    (row, half), rest = slabs[0], slabs[1:]
    before, behind = (solid.cut(side - (0, 0, 0, half)) for side in (row, -row))
    return _fork(row, _without_slabs(before, rest), _without_slabs(behind, rest))


@dataclass(frozen=True, eq=False)
class _Solid:
    """A convex polyhedron; `on` [vertex, half-space]: the vertex lies in the half-space's plane."""

    half_spaces: Array
    vertices: Array
    on: NDArray[np.bool_]

    @classmethod
    def box(cls, low: Array, high: Array) -> _Solid:
        upper = np.array(list(product((False, True), repeat=3)))
        return cls(box_rows(low, high), np.where(upper, high, low), np.hstack([~upper, upper]))

    def cut(self, row: Array) -> _Solid | None:
        """The part with a·p + a_0 ≥ 0; None where it has no volume.

        A new vertex lies between a kept and a lost one that have two planes in common (the double description
        method, Motzkin et al. 1953).
        """
        distance = (self.vertices @ row[:3] + row[3]) / np.linalg.norm(row[:3])
        if distance.max() <= _ON_PLANE:
            return None
        if distance.min() >= 0:
            return self
        lost = distance < -_ON_PLANE
        inside = distance > _ON_PLANE
        a, b = np.nonzero(self.on[inside].astype(int) @ self.on[lost].T.astype(int) >= 2)
        a, b = np.flatnonzero(inside)[a], np.flatnonzero(lost)[b]
        share = (distance[a] / (distance[a] - distance[b]))[:, None]
        ends = self.vertices[a], self.vertices[b]
        # Clipped, for one unit in the last place beyond the volume would be a voxel beyond it.
        new = np.clip(ends[0] + share * (ends[1] - ends[0]), np.minimum(*ends), np.maximum(*ends))
        on_new = np.column_stack([self.on[a] & self.on[b], np.ones(len(a), bool)])
        on_kept = np.column_stack([self.on, np.abs(distance) <= _ON_PLANE])[~lost]
        return _Solid(
            np.vstack([self.half_spaces, row]),
            np.concatenate([self.vertices[~lost], new]),
            np.concatenate([on_kept, on_new]),
        )


@lru_cache(maxsize=64)
def _fewest_boxes(cells: bytes, shape: tuple[int, int, int]) -> _Plan:
    """The cuts that leave the fewest boxes of shown cells; at most 3 × 3 × 3 cells, so all are tried."""
    shown = np.frombuffer(cells, bool).reshape(shape)

    @cache
    def best(low: tuple[int, ...], high: tuple[int, ...]) -> tuple[int, _Plan]:
        block = shown[tuple(map(slice, low, high))]
        if not block.any():
            return 0, None
        if block.all():
            return 1, _Cells(low, high)
        found = []
        for axis in range(3):
            for at in range(low[axis] + 1, high[axis]):
                below, below_plan = best(low, (*high[:axis], at, *high[axis + 1 :]))
                above, above_plan = best((*low[:axis], at, *low[axis + 1 :]), high)
                found.append((below + above, _Cut(axis, at, below_plan, above_plan)))
        return min(found, key=lambda one: one[0])

    return best((0, 0, 0), shape)[1]
