"""Numbers from the bytes of a file: packed or not, in one file or several, never fewer than promised."""

from __future__ import annotations

import bz2
import gzip
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Voxels
from ..errors import FileError
from .stored import Progress

_CHUNK = 1 << 22
_MOST_PACKED = {"gzip": 1100, "zlib": 1100, "bzip2": 50_000_000}  # largest ratio the formats can reach


def plain_or_gzip(path: Path) -> str:
    """The packing of a file, by its first two bytes."""
    with path.open("rb") as file:
        return "gzip" if file.read(2) == b"\x1f\x8b" else "raw"


def read_head(path: Path, count: int) -> bytes:
    """The first `count` bytes at most, unpacked where the file is gzipped."""
    if plain_or_gzip(path) == "raw":
        with path.open("rb") as file:
            return file.read(count)
    try:
        with gzip.open(path) as file:
            return file.read(count)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise FileError(f"{path}: the compressed data are damaged or cut off; {_AGAIN}") from None


def read_block(
    path: Path,
    dtype: np.dtype,
    count: int,
    *,
    offset: int = 0,
    skip: int = 0,
    packing: str = "raw",
    progress: Progress | None = None,
) -> Voxels:
    """`count` numbers of a file as a one-dimensional array; memory-mapped where nothing is packed.

    Parameters
    ----------
    offset
        Bytes of the file before the block; -1: the block is the end of the file.
    skip
        Bytes to drop after unpacking.
    packing
        raw, gzip, zlib, bzip2, text (numbers with white space between) or hex.

    Raises
    ------
    FileError
        The file has fewer numbers than `count`.
    """
    dtype = np.dtype(dtype)
    size, wanted = path.stat().st_size, count * dtype.itemsize
    if packing == "raw":
        start = size - wanted if offset == -1 else offset + skip
        if start < 0 or size < start + wanted:
            raise _short(path, size - max(start, 0), wanted)
        return np.memmap(path, dtype, "r", start, (count,)) if count else np.empty(0, dtype)
    if packing in ("text", "hex"):
        return _read_text(path, dtype, count, max(offset, 0), packing)
    if skip + wanted > size * _MOST_PACKED[packing]:
        raise FileError(
            f"{path}: {size} bytes cannot hold the {skip + wanted} that the header promises; {_AGAIN}"
        )
    out = np.empty(skip + wanted, np.uint8)
    with path.open("rb") as file:
        file.seek(max(offset, 0))
        try:
            done = _unpack_into(out, file, packing, progress)
        except (EOFError, zlib.error, gzip.BadGzipFile, OSError, ValueError) as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise
            raise FileError(f"{path}: the compressed data are damaged or cut off; {_AGAIN}") from None
    if done < out.size:
        raise _short(path, done - skip, wanted)
    return out[skip:].view(dtype)


def read_blocks(header: Path, paths: Sequence[Path], dtype: np.dtype, count: int, **options: Any) -> Voxels:
    """`count` numbers spread evenly over one or more files that `header` names."""
    missing = next((path for path in paths if not path.is_file()), None)
    if missing is not None:
        raise FileError(f"{header}: its data file {missing} is missing; put it beside the header")
    if len(paths) == 1:
        return read_block(paths[0], dtype, count, **options)
    if count % len(paths):
        raise FileError(
            f"{header}: {count} voxels do not divide evenly over {len(paths)} files; list them all"
        )
    return np.concatenate([read_block(path, dtype, count // len(paths), **options) for path in paths])


def named_files(header: Path, name: str, listed: str) -> list[Path]:
    """The data files that a header names as NRRD and MetaImage do; empty where it names none.

    Parameters
    ----------
    name
        A name, or LIST, or a printf-like pattern with its first and last number and step: `s%03d.raw 1 9 1`.
    listed
        For LIST: the lines after it, one name each.
    """
    words = name.split()
    if words and words[0].upper() == "LIST":
        return [header.parent / line.strip() for line in listed.splitlines() if line.strip()]
    if "%" not in name or len(words) < 3:
        return [header.parent / name] if name else []
    try:
        start, stop, step = (*(int(word) for word in words[1:4]), 1)[:3]
        if step == 0 or abs((stop - start) // step) > 100_000:
            return []
        return [header.parent / (words[0] % i) for i in range(start, stop + (1 if step > 0 else -1), step)]
    except (ValueError, TypeError):
        return []


_AGAIN = "copy or export the file again"


def _short(path: Path, held: int, wanted: int) -> FileError:
    return FileError(
        f"{path}: truncated: {wanted} bytes of voxels promised, {max(held, 0)} in the file; {_AGAIN}"
    )


def _unpack_into(out: np.ndarray, file, packing: str, progress: Progress | None) -> int:
    if packing == "zlib":
        stream = _Inflated(file)
    else:
        stream = gzip.GzipFile(fileobj=file) if packing == "gzip" else bz2.BZ2File(file)
    done, view = 0, memoryview(out)
    while done < out.size:
        chunk = stream.read(min(_CHUNK, out.size - done))
        if not chunk:
            return done
        view[done : done + len(chunk)] = chunk
        done += len(chunk)
        if progress:
            progress(done, out.size, "unpacking")
    try:
        while stream.read(_CHUNK):  # to the end of the stream, where its checksum is
            pass
    except gzip.BadGzipFile as error:
        if "CRC" in str(error):
            raise
    return done


class _Inflated:
    """A zlib stream with a read method."""

    def __init__(self, file):
        self._file, self._zlib = file, zlib.decompressobj(47)  # 47: zlib or gzip, MetaImage has both

    def read(self, size: int) -> bytes:
        while not self._zlib.eof:
            packed = self._zlib.unconsumed_tail or self._file.read(_CHUNK)
            data = self._zlib.decompress(packed, size)
            if data:
                return data
            if not packed:
                raise EOFError
        return b""


def _read_text(path: Path, dtype: np.dtype, count: int, offset: int, packing: str) -> Voxels:
    with path.open("rb") as file:
        file.seek(offset)
        text = file.read()
    try:
        if packing == "hex":
            data = np.frombuffer(bytes.fromhex(text.decode("ascii")), dtype)
        else:
            data = np.array(text.replace(b",", b" ").split(None, count)[:count], dtype)
    except (ValueError, OverflowError):
        raise FileError(
            f"{path}: the voxels are not {packing} numbers as the header says; {_AGAIN}"
        ) from None
    if data.size < count:
        raise _short(path, data.nbytes, count * dtype.itemsize)
    return data[:count]
