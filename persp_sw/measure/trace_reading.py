"""Reads what `TraceWriter` wrote, also where the session that wrote it ended in the middle of a line."""

from __future__ import annotations

import json
import logging
import math
import zlib
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np

from ..errors import TraceError
from .trace import FORMAT, POSE_NUMBERS, VERSION, FrameRecord

_KINDS = {field.name: str(field.type).partition(" ")[0] for field in fields(FrameRecord)}
_DEFAULTS = {field.name: field.default for field in fields(FrameRecord)}
_WHAT = {"int": "a whole number", "float": "a number", "bool": "true or false", "str": "text"}
_GZIP_MAGIC = b"\x1f\x8b"
_CHUNK_BYTES = 1 << 20
_EXACT_BELOW = 2**53  # whole numbers that a float64 holds

_log = logging.getLogger("persp_sw")


@dataclass(frozen=True, eq=False)
class Trace:
    """A session: what it was, and a column for each field of its frames.

    Attributes
    ----------
    name
        The file's name.
    header
        The first line, as it is.
    columns
        By the field's name, n frames long: int64 for `frame` and `missed`, bool, texts (object), (n, 7)
        float64 for poses, float64 for all else, NaN where a frame does not have it.
    cut
        Whether the file ends before the session did.
    """

    name: str
    header: dict[str, Any]
    columns: dict[str, np.ndarray]
    cut: bool = False

    def __len__(self) -> int:
        return len(self.columns["frame"])

    def __getitem__(self, field: str) -> np.ndarray:
        return self.columns[field]

    def records(self) -> Iterator[FrameRecord]:
        """The frames, one by one, as they were written."""
        names = [field.name for field in fields(FrameRecord)]
        whole = {name for name, kind in _KINDS.items() if kind == "int"}
        for values in zip(*(self.columns[name].tolist() for name in names), strict=True):
            known = {name: value for name, value in zip(names, values, strict=True) if not _unknown(value)}
            yield FrameRecord(**{name: int(v) if name in whole else v for name, v in known.items()})


def read_trace(path: str | Path) -> Trace:
    """Read a trace, compressed or not.

    A last line that is cut off (the session crashed, the disk was full) is left out with a warning. Fields of
    frames that this version does not know are left out.

    Raises
    ------
    TraceError
        A file that cannot be read or is no trace, with the line's number.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            return _read(path, _Lines(path, file))
    except OSError as error:
        raise TraceError(f"cannot read the trace {path}: {error.strerror or error}") from None


class _Lines:
    """A file's lines, numbered from 1; `unended`: the last has no end; `cut`: a compressed file has none."""

    def __init__(self, path: Path, file: BinaryIO):
        self._path, self._file = path, file
        self.number, self.unended, self.cut = 0, False, False

    def __iter__(self) -> Iterator[bytes]:
        rest = b""
        for piece in self._pieces():
            *lines, rest = (rest + piece).split(b"\n")
            for line in lines:
                self.number += 1
                yield line
        if rest:
            self.number += 1
            self.unended = True
            yield rest

    def _pieces(self) -> Iterator[bytes]:
        first = self._file.read(_CHUNK_BYTES)
        unpack = zlib.decompressobj(wbits=31) if first.startswith(_GZIP_MAGIC) else None
        chunk = first
        while chunk:
            try:
                yield unpack.decompress(chunk) if unpack else chunk
            except zlib.error:
                raise TraceError(f"{self._path}: its compressed data are damaged") from None
            chunk = self._file.read(_CHUNK_BYTES)
        if unpack is not None and not unpack.eof:
            self.cut = True
            yield unpack.flush()


def _read(path: Path, lines: _Lines) -> Trace:
    every = iter(lines)
    header = _header(path, next(every, b""))
    columns: dict[str, list[Any]] = {name: [] for name in _KINDS}
    dropped = False
    for line in every:
        values = _object(line)
        if values is not None:
            for name, column in columns.items():
                column.append(_value(path, lines.number, name, values))
        elif lines.unended:
            dropped = True
        elif line.strip():
            _refuse(path, lines.number, "is no JSON object")
    cut = dropped or lines.cut
    if cut:
        _log.warning("%s is cut off; the %d frames before that are used", path, len(columns["frame"]))
    return Trace(path.name, header, {name: _array(name, column) for name, column in columns.items()}, cut)


def _header(path: Path, line: bytes) -> dict[str, Any]:
    values = _object(line) if line.startswith(b"{") else None
    if values is None or values.get("format") != FORMAT:
        raise TraceError(
            f"{path} is no trace, line 1: not the header of one; traces are written by `--trace FILE`"
        )
    version = values.get("version")
    if not isinstance(version, int) or version > VERSION:
        raise TraceError(
            f"{path}, line 1: a trace of version {version!r}, of which this program knows up to {VERSION}; "
            "read it with the program that wrote it"
        )
    return values


def _object(line: bytes) -> dict[str, Any] | None:
    """A line's JSON object; None where it is none."""
    try:
        values = json.loads(line.decode())
    except (ValueError, RecursionError):
        return None
    return values if isinstance(values, dict) else None


def _value(path: Path, number: int, name: str, values: dict[str, Any]) -> Any:
    """A frame's value of one field, checked."""
    value = values.get(name)
    if value is None:
        if _DEFAULTS[name] is MISSING:
            _refuse(path, number, f"has no {name}")
        return _DEFAULTS[name]
    kind = _KINDS[name]
    if kind == "int":
        good = _is_whole(value)
    elif kind == "float":
        good = _is_number(value)
    elif kind in ("bool", "str"):
        good = type(value).__name__ == kind
    else:
        good = isinstance(value, list) and len(value) == POSE_NUMBERS and all(map(_is_number, value))
    if not good:
        _refuse(path, number, f"{name} is not {_WHAT.get(kind, 'a pose of 7 numbers')}; given {value!r:.60}")
    return value


def _is_number(value: Any) -> bool:
    return _is_whole(value) or (type(value) is float and math.isfinite(value))


def _is_whole(value: Any) -> bool:
    return type(value) is int and abs(value) < _EXACT_BELOW  # True is not 1


def _refuse(path: Path, number: int, what: str) -> NoReturn:
    raise TraceError(f"{path}, line {number}: {what}; the file was changed or damaged")


def _array(name: str, column: list[Any]) -> np.ndarray:
    kind = _KINDS[name]
    if kind == "str":
        return np.array(column, object)
    if kind == "bool" or (kind == "int" and _DEFAULTS[name] is not None):
        return np.array(column, bool if kind == "bool" else np.int64)
    if kind in ("int", "float"):
        return np.array([math.nan if value is None else value for value in column], np.float64)
    unknown = [math.nan] * POSE_NUMBERS
    return np.array([value or unknown for value in column], np.float64).reshape(-1, POSE_NUMBERS)


def _unknown(value: Any) -> bool:
    first = value[0] if isinstance(value, list) else value
    return isinstance(first, float) and math.isnan(first)
