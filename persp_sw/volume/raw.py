"""Headerless voxels: raw files whose shape the caller states, and numpy's .npy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

from ..errors import FileError
from .blocks import read_block
from .orientation import pose
from .stored import Stored, in_five_axes


def read(
    path: Path, shape: Sequence[int] | None, dtype: DTypeLike | None, byte_order: str, header_bytes: int
) -> Stored:
    """Voxels of a raw file, x fastest, at world = index.

    Parameters
    ----------
    shape
        Number of voxels along x, y and z.
    dtype
        Type of a voxel, such as "uint8" or "float32"; one that names a byte order keeps it.
    byte_order
        "little" or "big".
    header_bytes
        Bytes before the first voxel.
    """
    if shape is None or dtype is None:
        missing = [f"{n}=" for n, v in (("shape", shape), ("dtype", dtype)) if v is None]
        raise FileError(
            f"{path}: a raw file does not say what it holds and {' and '.join(missing)} is not given; state "
            'shape=(x, y, z) and dtype="uint8" (or "int16", "uint16", "float32", ...)'
        )
    sizes, kind = _shape(shape, path), _dtype(dtype, byte_order, path)
    if isinstance(header_bytes, bool) or not isinstance(header_bytes, int | np.integer) or header_bytes < 0:
        raise FileError(f"{path}: header_bytes must be a whole number of at least 0; given {header_bytes!r}")
    size, count = path.stat().st_size, int(np.prod(sizes, dtype=object))
    wanted = count * kind.itemsize + int(header_bytes)
    if size != wanted:
        by = "×".join(map(str, sizes))
        after = f" after {header_bytes} header bytes" if header_bytes else ""
        raise FileError(
            f"{path}: the file has {size} bytes, {by} voxels of {kind.name}{after} need {wanted}; "
            "correct shape=, dtype= or header_bytes="
        )
    block = read_block(path, kind, count, offset=int(header_bytes))
    return Stored(in_five_axes(block.reshape(sizes[::-1]), [], [0, 1, 2], []), np.eye(4))


def read_npy(path: Path) -> Stored:
    """Voxels of a .npy file, [z, y, x] in either memory order, at world = index."""
    try:
        data = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, MemoryError):
        raise
    except Exception as error:  # numpy runs a parser on the header, which fails in many ways
        if "Object arrays" in str(error) or "Python objects" in str(error):
            raise FileError(f"{path}: the array holds Python objects; save an array of numbers") from None
        raise FileError(f"{path}: the file is not a .npy array or it is truncated; save it again") from None
    if data.ndim != 3 or data.dtype.kind not in "buif":
        raise FileError(
            f"{path}: shape {data.shape} and type {data.dtype}; save three axes [z, y, x] of real numbers"
        )
    return Stored(in_five_axes(data, [], [0, 1, 2], []), pose(np.eye(3)))


def _shape(shape: Sequence[int], path: Path) -> list[int]:
    try:
        sizes = [int(n) for n in shape]
        whole = sizes == [float(n) for n in shape]
    except (TypeError, ValueError):
        whole, sizes = False, []
    if not whole or len(sizes) != 3 or min(sizes) < 1:
        raise FileError(f"{path}: shape must be three whole numbers (x, y, z) of at least 1; given {shape!r}")
    return sizes


def _dtype(dtype, byte_order: str, path: Path) -> np.dtype:
    try:
        kind = np.dtype(dtype)
    except (TypeError, ValueError):
        kind = np.dtype(object)
    if kind.kind not in "buif":
        raise FileError(
            f'{path}: dtype {dtype!r} is no real number; give "uint8", "int16", "uint16" or "float32"'
        )
    if byte_order not in ("little", "big"):
        raise FileError(f'{path}: byte_order must be "little" or "big"; given {byte_order!r}')
    if kind.byteorder == "=":
        kind = kind.newbyteorder("<" if byte_order == "little" else ">")
    return kind
