"""NRRD files (.nrrd, .nhdr), versions 1 to 5: pynrrd reads the header, `blocks` the voxels.

pynrrd's own reading of voxels lacks hex, lists of files and trailing bytes, takes gzipped data without their
checksum, and is neither memory-mapped nor interruptible, so it is not used. Nor is ITK, which leaves RAS-time
files in RAS and refuses axes without kinds; the tests hold the two against each other.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from ..errors import FileError
from .blocks import named_files, read_blocks
from .orientation import flipped, pose
from .stored import Progress, Stored, in_five_axes

_FIELDS = {
    *("dimension", "sizes", "type", "endian", "encoding", "kinds", "spacings", "space", "space directions"),
    *("space origin", "line skip", "byte skip", "data file"),
}
_FIELD_OF = {field.replace(" ", ""): field for field in _FIELDS}  # the format allows both
_PACKING = {
    **{"raw": "raw", "gz": "gzip", "gzip": "gzip", "bz2": "bzip2", "bzip2": "bzip2"},
    **{"txt": "text", "text": "text", "ascii": "text", "hex": "hex"},
}
_ANATOMICAL = {
    "left-posterior-superior": (1, 1, 1),
    "left-anterior-superior": (1, -1, 1),
    "right-anterior-superior": (-1, -1, 1),
}
_SPATIAL, _FRAMES = ("domain", "space"), ("time", "list")
_LIMIT = 1 << 20  # bytes in which the header must end


def read(path: Path, progress: Progress | None) -> Stored:
    """Voxels and pose of a NRRD file: in LPS where it names an anatomical space, else as stated."""
    header, end, names = _header(path)
    sizes = [int(n) for n in header.get("sizes", ())]
    rank = header.get("dimension")
    if rank != len(sizes) or not 1 <= rank <= 16 or min(sizes) < 1:
        stated = f"dimension {rank} and sizes {' '.join(map(str, sizes))}"
        raise FileError(f"{path}: the header states {stated}; correct these lines, or export the file again")
    dtype, packing = _type(header, path)
    files = _data_files(header, names, path)
    options = {"packing": packing, "progress": progress, **_skips(header, files, end)}
    block = read_blocks(path, files, dtype, int(np.prod(sizes, dtype=object)), **options)
    vectors = _vectors(header, path, rank)
    frames, space, components = _roles(header, path, rank, vectors)
    back = [rank - 1 - a for a in range(rank)]  # the file's fastest axis is numpy's last
    chosen = ([back[a] for a in reversed(axes)] for axes in (frames, space, components))
    data = in_five_axes(block.reshape(sizes[::-1]), *chosen)
    return Stored(data, *_pose(header, path, space, vectors))


def _header(path: Path) -> tuple[dict, int, str]:
    """Fields as pynrrd understands them, the byte after the header, and the text after it where it goes on
    with a list of files."""
    import nrrd

    with path.open("rb") as file:
        head = file.read(_LIMIT)
    if not re.match(rb"NRRD000\d\r?\n", head):
        raise FileError(f"{path}: the file does not begin like a NRRD file (NRRD000N); check what it is")
    header, at = {}, 0
    for line in head.splitlines(keepends=True):
        at += len(line)
        text = line.decode("utf-8", "replace").strip()
        if not text:
            return header, at, ""
        name, colon, value = text.partition(":")
        field = _FIELD_OF.get(name.strip().lower().replace(" ", ""))
        if text[0] == "#" or text.startswith("NRRD000") or (colon and field is None) or value[:1] == "=":
            continue
        value = re.sub(r"\s+(?=[^()]*\))", "", value)  # pynrrd wants vectors without spaces
        try:  # line by line, for pynrrd does not say which one it cannot read
            with np.errstate(invalid="ignore"):
                header |= nrrd.read_header(["NRRD0005", f"{field}:{value}" if colon else text])
        except (nrrd.NRRDError, ValueError, IndexError, OverflowError):
            raise FileError(
                f"{path}: the header has the line {text[:60]!r}, which cannot be read; correct or remove it"
            ) from None
        if header.get("data file", "").upper().startswith("LIST"):
            return header, at, head[at:].decode("utf-8", "replace")
    if "data file" not in header:
        raise FileError(
            f"{path}: truncated: the header has no end (an empty line); copy or export the file again"
        )
    return header, at, ""


def _type(header: dict, path: Path) -> tuple[np.dtype, str]:
    """Type of the voxels, and how they are packed."""
    import nrrd

    name, encoding, order = (header.get(f, "").lower() for f in ("type", "encoding", "endian"))
    one = {
        "type": name,
        "endian": order or "little",
        "encoding": "raw",
        "dimension": 1,
        "sizes": np.ones(1, int),
    }
    try:
        dtype = nrrd.read_data(one, io.BytesIO(bytes(8))).dtype
    except (nrrd.NRRDError, KeyError, ValueError):
        dtype = np.dtype(np.void)
    if dtype.kind not in "iuf" or encoding not in _PACKING:
        what = f"type: {name} {order}" if dtype.kind not in "iuf" else f"encoding: {encoding}"
        raise FileError(f"{path}: {what} is not supported; write a number type with raw or gzip encoding")
    packing = _PACKING[encoding]
    return dtype.newbyteorder("=") if packing == "text" else dtype, packing


def _data_files(header: dict, names: str, path: Path) -> list[Path]:
    name = header.get("data file")
    files = [path] if name is None else named_files(path, name, names)
    if not files:
        raise FileError(f"{path}: data file: {name} names no file; write the name of the data file")
    return files


def _skips(header: dict, files: list[Path], end: int) -> dict:
    """Where the voxels begin in the data files."""
    offset = 0 if "data file" in header else end
    lines, skip = header.get("line skip", 0), header.get("byte skip", 0)
    if lines > 0 and files[0].is_file():
        with files[0].open("rb") as file:
            file.seek(offset)
            offset += sum(len(file.readline()) for _ in range(lines))
    return {"offset": -1} if skip == -1 else {"offset": offset, "skip": max(skip, 0)}


def _vectors(header: dict, path: Path, rank: int) -> list[np.ndarray | None] | None:
    """`space directions`: a vector for every axis, None for those that are not in space."""
    rows = header.get("space directions")
    if rows is None:
        return None
    if len(rows) != rank:
        raise FileError(f"{path}: space directions: {len(rows)} vectors for {rank} axes; correct that line")
    return [None if row is None or np.isnan(row).all() else row for row in rows]  # pynrrd has two settings


def _roles(header: dict, path: Path, rank: int, vectors) -> tuple[list[int], list[int], list[int]]:
    """Axes (fastest 0) that are frames, space and components."""
    kinds = [kind.lower() for kind in header.get("kinds", ())]
    kinds = kinds if len(kinds) == rank else ["???"] * rank
    frames, space, components = [], [], []
    for axis, kind in enumerate(kinds):
        vector = vectors[axis] if vectors else None
        in_time = vector is not None and len(vector) == 4 and not vector[:3].any()
        nowhere = vectors is not None and vector is None
        if kind in _FRAMES or in_time:
            frames.append(axis)
        elif kind in _SPATIAL or (kind in ("???", "none") and not nowhere):
            (space if len(space) < 3 else frames).append(axis)
        elif kind in ("???", "none"):  # no kind and no direction: parts of a voxel come first, frames last
            (components if axis == 0 else frames).append(axis)
        else:
            components.append(axis)
    if len(space) < 2:
        raise FileError(f"{path}: the file has {len(space)} spatial axes of {rank}; a volume needs three")
    return frames, space, components


def _pose(header: dict, path: Path, space: list[int], vectors):
    if vectors is None:
        spacings = header.get("spacings", np.ones(header["dimension"]))
        if len(spacings) != header["dimension"]:
            given = " ".join(f"{s:g}" for s in spacings)
            raise FileError(f"{path}: spacings: {given} is not one number per axis; correct that line")
        spacing = (*spacings[space].tolist(), 1.0)[:3]
        return pose(np.eye(3), spacing=spacing), spacing, False
    axes = np.eye(3)
    for i, axis in enumerate(space):
        if vectors[axis] is not None:
            axes[i] = (*vectors[axis], 0.0, 0.0, 0.0)[:3]
    origin = (*header.get("space origin", ()), 0.0, 0.0, 0.0)[:3]
    signs, anatomical = _signs(header.get("space", ""))
    with np.errstate(invalid="ignore"):
        spacing = tuple(np.linalg.norm(axes, axis=1).tolist())
    return flipped(pose(axes, origin), signs), spacing, anatomical


def _signs(space: str) -> tuple[tuple[int, int, int], bool]:
    """Signs of a named space's axes in the world, and whether that is a patient's LPS."""
    name = space.lower().removesuffix("-time")
    for long, signs in _ANATOMICAL.items():
        short = "".join(word[0] for word in long.split("-"))
        if name in (long, short, short + "t"):
            return signs, True
    if name == "3d-left-handed":  # ours is right-handed: without this, left and right would change places
        return (1, 1, -1), False
    return (1, 1, 1), False
