"""MetaImage files (.mha, .mhd).

Read here and not through SimpleITK, the only kept library for them. Its MetaIO (measured with 2.5.7) reads
cut-off compressed voxels as other values without an error, refuses a spacing of 0 or NaN although the caller
states another, does not read voxels as text in a file of their own, prints to the terminal, and turns
KeyboardInterrupt from a callback into RuntimeError. Checks before it would have to find the data files, sizes
and packing, which is all there is to the format; the tests hold the two readers against each other.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import FileError
from .blocks import named_files, read_blocks
from .orientation import pose
from .stored import Progress, Stored, in_five_axes

_TYPES = {
    **{"CHAR": "i1", "UCHAR": "u1", "SHORT": "i2", "USHORT": "u2", "INT": "i4", "UINT": "u4", "LONG": "i4"},
    **{"ULONG": "u4", "LONG_LONG": "i8", "ULONG_LONG": "u8", "FLOAT": "f4", "DOUBLE": "f8"},
}
_LIMIT = 1 << 16  # bytes in which the header must end


def read(path: Path, progress: Progress | None) -> Stored:
    """Voxels and LPS pose of a MetaImage; orientation letters only where AnatomicalOrientation is stated."""
    header, end = _header(path)
    rank = _numbers(header, path, "NDims", count=1)[0]
    sizes = [int(n) for n in _numbers(header, path, "DimSize", count=int(rank))]
    if not 2 <= len(sizes) <= 5 or min(sizes) < 1:
        raise FileError(f"{path}: the header states DimSize = {sizes}; a volume has 3 sizes of at least 1")
    channels = int(_numbers(header, path, "ElementNumberOfChannels", count=1, default=[1])[0])
    kind = header.get("elementtype", "").removeprefix("MET_").removesuffix("_ARRAY")
    if kind not in _TYPES or channels < 1:
        raise FileError(
            f"{path}: ElementType = {header.get('elementtype')} with {channels} channels is not supported; "
            f"write one of MET_{', MET_'.join(_TYPES)}"
        )
    big = _flag(header, "binarydatabyteordermsb") or _flag(header, "elementbyteordermsb")
    dtype = np.dtype((">" if big else "<") + _TYPES[kind])
    packing = "zlib" if _flag(header, "compresseddata") else "raw"
    if not _flag(header, "binarydata", True):
        packing, dtype = "text", dtype.newbyteorder("=")
    files = _data_files(header, path)
    skip = int(_numbers(header, path, "HeaderSize", count=1, default=[0])[0])
    offset = end if files == [path] else max(skip, -1)
    if skip == -1 and packing == "raw":
        offset = -1
    count = int(np.prod(sizes, dtype=object)) * channels
    block = read_blocks(path, files, dtype, count, offset=offset, packing=packing, progress=progress)
    axes = list(range(len(sizes)))
    data = in_five_axes(block.reshape([*sizes[::-1], channels]), axes[:-3], axes[-3:], [len(sizes)])
    matrix, spacing = _pose(header, path, len(sizes))
    return Stored(data, matrix, spacing, anatomical=_is_anatomical(header.get("anatomicalorientation", "")))


def _header(path: Path) -> tuple[dict[str, str], int]:
    """Keys (small letters) and values, and the byte after the header."""
    with path.open("rb") as file:
        head = file.read(_LIMIT)
    header, at = {}, 0
    for line in head.splitlines(keepends=True):
        at += len(line)
        key, equals, value = line.decode("latin-1").partition("=")
        if line.strip() and not equals:
            break
        header[key.strip().lower()] = value.strip()
        if key.strip().lower() == "elementdatafile":
            header["lines after"] = head[at:].decode("latin-1") if value.strip().startswith("LIST") else ""
            return header, at
    raise FileError(
        f"{path}: no MetaImage header (it has no ElementDataFile); check what it is, or export it again"
    )


def _numbers(header: dict, path: Path, *names: str, count: int, default: list | None = None) -> list[float]:
    """The first of some keys that is there; NaN for words that are not numbers."""
    text = next((header[name.lower()] for name in names if name.lower() in header), None)
    if text is None and default is not None:
        return default
    try:
        values = [float(word) for word in (text or "").split()]
    except ValueError:
        values = []
    if len(values) < count or count < 1 or (names[0] == "NDims" and values[0] not in (2, 3, 4, 5)):
        raise FileError(
            f"{path}: the header states {names[0]} = {text}; correct that line, or export it again"
        )
    if names[0] not in ("ElementSpacing", "Offset", "TransformMatrix") and not np.isfinite(values).all():
        raise FileError(
            f"{path}: the header states {names[0]} = {text}; correct that line, or export it again"
        )
    return values[:count]


def _flag(header: dict, name: str, default: bool = False) -> bool:
    return header[name][:1].upper() in ("T", "1", "Y") if header.get(name) else default


def _data_files(header: dict, path: Path) -> list[Path]:
    name = header["elementdatafile"]
    files = [path] if name.upper() == "LOCAL" else named_files(path, name, header["lines after"])
    if not files:
        raise FileError(
            f"{path}: ElementDataFile = {name} names no file; write LOCAL or the name of the data file"
        )
    return files


def _pose(header: dict, path: Path, rank: int):
    spacing = _numbers(header, path, "ElementSpacing", "ElementSize", count=rank, default=[1.0] * rank)
    origin = _numbers(header, path, "Offset", "Position", "Origin", count=rank, default=[0.0] * rank)
    turn = _numbers(
        header,
        path,
        "TransformMatrix",
        "Rotation",
        "Orientation",
        count=rank * rank,
        default=np.eye(rank).ravel().tolist(),
    )
    axes = np.eye(3)
    n = min(rank, 3)
    axes[:n, :n] = np.reshape(turn, (rank, rank))[:n, :n]  # row i is the direction of axis i
    stated = (*spacing[:n], 1.0)[:3]
    return pose(axes, (*origin[:n], 0.0)[:3], stated), stated


def _is_anatomical(words: str) -> bool:
    return len(words) >= 3 and set(words.upper()) <= set("LRAPSI")
