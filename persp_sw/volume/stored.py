"""What a reader found in a file, and the picking of one frame and one component from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays import Matrix, Voxels
from ..errors import FileError

Progress = Callable[[int, int, str], None]  # (done, total, what)

_SHORTS = (np.dtype(np.uint8), np.dtype(np.int16), np.dtype(np.uint16))


@dataclass
class Stored:
    """The contents of one file as its reader understood them, before anything is converted.

    Parameters
    ----------
    data
        [frame, z, y, x, component] real numbers of any type and byte order; may be memory-mapped.
    world_from_object
        (4, 4) pose, not yet checked.
    spacing
        Spacing along x, y, z as the file states it, not yet checked; None where the pose says it all.
    anatomical
        Whether the world is a patient's (LPS), so that orientation letters mean something.
    slope, intercept
        Value = stored · slope + intercept.
    """

    data: Voxels
    world_from_object: Matrix
    spacing: tuple[float, ...] | None = None
    anatomical: bool = False
    slope: float = 1.0
    intercept: float = 0.0


def in_five_axes(data: Voxels, frames: list[int], space: list[int], components: list[int]) -> Voxels:
    """`data` as [frame, z, y, x, component]; the lists name its axes, slowest first.

    At most three spatial axes; missing ones become slices, rows or columns of one. A view where each list
    of frames and components has at most one axis.
    """
    shape = data.shape
    grid = [1] * (3 - len(space)) + [shape[a] for a in space]
    count = [int(np.prod([shape[a] for a in axes], dtype=np.int64)) for axes in (frames, components)]
    return data.transpose([*frames, *space, *components]).reshape([count[0], *grid, count[1]])


def pick(
    stored: Stored,
    path: Path,
    frame: int | None,
    component: int | str | None,
    progress: Progress | None,
) -> Voxels:
    """One frame and one component (or the length of all of them) as [z, y, x], rescaled, native bytes.

    Raises
    ------
    FileError
        More than one to choose from and none chosen, or a choice that is not there.
    """
    frames, components = stored.data.shape[0], stored.data.shape[4]
    missing = []
    if frame is None and frames > 1:
        missing.append((f"{frames} frames", f"frame=N (--frame N), N from 0 to {frames - 1}"))
    if component is None and components > 1:
        choice = f'component=N (--component N), N from 0 to {components - 1}, or component="magnitude"'
        missing.append((f"{components} components per voxel", choice))
    if missing:
        held, advice = (" and ".join(words) for words in zip(*missing, strict=True))
        raise FileError(f"{path}: the file holds {held}, a volume is one of them; choose with {advice}")
    data = stored.data[_number(frame, frames, "frame", path)]
    if component == "magnitude":
        return _magnitude(data, stored, progress)
    data = data[..., _number(component, components, "component", path)]
    return _rescaled(data, stored, progress)


def narrowed(data: Voxels, *, floats: bool = False) -> Voxels:
    """`data` as int16 or uint16 where that is exact and it is another, wider integer; else unchanged.

    With `floats`, floating point data of whole numbers are narrowed as well: what a reader made by rescaling.
    """
    kind = data.dtype.kind
    if data.size == 0 or kind not in "iuf" or (kind == "f" and not floats) or data.dtype in _SHORTS:
        return data
    low, high = data.min(), data.max()
    target = _short_type(low, high)
    if target is None or not all(_is_whole(plane) for plane in data):
        return data
    return data.astype(target)


def _number(chosen: int | str | None, count: int, word: str, path: Path) -> int:
    if chosen is None:
        return 0
    if isinstance(chosen, str) and chosen.strip().isdecimal():
        chosen = int(chosen)
    if isinstance(chosen, int | np.integer) and not isinstance(chosen, bool) and 0 <= chosen < count:
        return int(chosen)
    choice = f"0 to {count - 1}" if count > 1 else "0, or leave it out"
    choice += ' or "magnitude"' if word == "component" and count > 1 else ""
    raise FileError(
        f"{path}: no {word} {chosen!r}; the file has {count} {word}{'s' * (count > 1)}; give {choice}"
    )


def _rescaled(data: Voxels, stored: Stored, progress: Progress | None) -> Voxels:
    slope, intercept = stored.slope, stored.intercept
    native = data.dtype.newbyteorder("=")
    if (slope, intercept) == (1.0, 0.0):
        alone = stored.data.size == data.size and not isinstance(data, np.memmap)
        if alone and data.flags.carray and data.dtype.isnative:
            return narrowed(data)
        return narrowed(_planewise(data, native, lambda plane: plane, progress))
    whole = native.kind in "iub" and float(slope).is_integer() and float(intercept).is_integer()
    if whole and max(abs(slope), abs(intercept)) < 2**30 and native.itemsize <= 4:
        ends = [int(v) * int(slope) + int(intercept) for v in (data.min(), data.max())]
        target = _short_type(min(ends), max(ends)) or np.float32
        by = (np.int64(slope), np.int64(intercept))
        return _planewise(data, target, lambda plane: plane.astype(np.int64) * by[0] + by[1], progress)
    return _planewise(data, np.float32, lambda plane: plane.astype(np.float64) * slope + intercept, progress)


def _magnitude(data: Voxels, stored: Stored, progress: Progress | None) -> Voxels:
    def length(plane: Voxels) -> Voxels:
        values = plane.astype(np.float64) * stored.slope + stored.intercept
        return np.sqrt(np.einsum("...c,...c->...", values, values))

    return _planewise(data, np.float32, length, progress)


def _planewise(data, dtype, function, progress: Progress | None) -> Voxels:
    """`function` of every slice, so that no second copy of a large volume is ever needed."""
    out = np.empty(data.shape[:3], dtype)
    with np.errstate(over="ignore", invalid="ignore"):  # infinite and NaN are counted by Volume
        for z in range(data.shape[0]):
            out[z] = function(data[z])
            if progress:
                progress(z + 1, data.shape[0], "reading")
    return out


def _short_type(low, high) -> np.dtype | None:
    if not (np.isfinite(low) and np.isfinite(high)):
        return None
    for dtype in (np.int16, np.uint16):  # one rule for all: 8 bits are not a rescaled file's precision
        info = np.iinfo(dtype)
        if info.min <= low and high <= info.max:
            return np.dtype(dtype)
    return None


def _is_whole(plane: Voxels) -> bool:
    return plane.dtype.kind != "f" or bool((plane == np.rint(plane)).all())
