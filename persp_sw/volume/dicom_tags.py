"""The few elements of a DICOM file that say where its slices lie, read with pydicom without the pixels.

GDCM, which decodes the pixels, fills truncated ones with rubbish and gives multi-frame files with a gap
or with several phases a made-up spacing, both without a word; so the geometry is read here. pydicom stops at
the end of a truncated file without a word, too, so it reads through a file that does not (`_Whole`).
"""

from __future__ import annotations

import io
import os
import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path

WANTED = {
    **{"sop_class": 0x00080016, "modality": 0x00080060, "description": 0x0008103E},
    **{"thickness": 0x00180050, "gap_spacing": 0x00180088, "series_uid": 0x0020000E, "number": 0x00200011},
    **{"instance": 0x00200013, "position": 0x00200032, "orientation": 0x00200037, "samples": 0x00280002},
    "photometric": 0x00280004,
    **{"frames": 0x00280008, "rows": 0x00280010, "columns": 0x00280011, "pixel_spacing": 0x00280030},
    **{"bits": 0x00280100, "intercept": 0x00281052, "slope": 0x00281053, "grid_offsets": 0x3004000C},
    **{"measures": 0x00289110, "frame_position": 0x00209113, "frame_orientation": 0x00209116},
    **{"transformation": 0x00289145, "shared": 0x52009229, "per_frame": 0x52009230},
}
_NAMES = {tag: name for name, tag in WANTED.items()}
_SHORTS = ("samples", "rows", "columns", "bits")
_SEQUENCES = ("measures", "frame_position", "frame_orientation", "transformation", "shared", "per_frame")
_PIXELS = {0x7FE00010, 0x7FE00008, 0x7FE00009}  # integer, float and double pixel data
_UNDEFINED = 0xFFFFFFFF
_IMPLICIT, _DEFLATED = "1.2.840.10008.1.2", "1.2.840.10008.1.2.1.99"
BIG_ENDIAN = "1.2.840.10008.1.2.2"


class DamagedError(Exception):
    """The file begins like DICOM but ends early or cannot be followed."""


@dataclass
class Tags:
    """Elements of one file by the names of `WANTED`: texts, whole numbers, or lists of items."""

    syntax: str = _IMPLICIT
    values: dict = field(default_factory=dict)
    has_pixels: bool = False
    pixel_bytes: int | None = None  # None where they are encapsulated (compressed)

    @property
    def encapsulated(self) -> bool:
        """Whether the pixels are stored compressed."""
        return self.has_pixels and self.pixel_bytes is None


def read_tags(path: Path) -> Tags | None:
    """The elements of a DICOM file; None where it is something else.

    Raises
    ------
    DamagedError
    """
    with _Whole(path.open("rb", buffering=0)) as file:
        head = file.peek(132)[:132]
        marked = head[128:] == b"DICM"
        if len(head) < 132 or not (marked or re.match(rb"[\x02\x08]\0..", head, re.DOTALL)):
            return None
        try:
            return _read(file)
        except Exception as error:  # pydicom meets damaged files with errors of any type
            if isinstance(error, MemoryError) or getattr(error, "errno", None) is not None:
                raise
            if not marked:
                return None
            raise DamagedError(str(error)) from None


def numbers(text: object) -> list[float]:
    """The numbers of a decimal string such as `1\\0\\0`; empty where there are none."""
    try:
        return [float(word) for word in text.split("\\")] if isinstance(text, str) and text else []
    except ValueError:
        return []


class _Whole(io.BufferedReader):
    """A file that raises DamagedError where a read comes up short, or begins behind its end."""

    _ended = False  # the first read of nothing finds the end, one more wants a value that is not there

    def read(self, count: int = -1, /) -> bytes:
        data = super().read(count)
        short = 0 < len(data) < count or (not data and self._ended)
        self._ended = not data
        if short or self.tell() > os.fstat(self.fileno()).st_size:
            raise DamagedError("the file ends inside an element")
        return data


def _read(file: _Whole) -> Tags:
    from pydicom.filereader import read_partial

    tags, start = Tags(), 0

    def at_pixels(tag: int, _, length: int) -> bool:
        nonlocal start
        if tag not in _PIXELS:
            return False
        start, tags.has_pixels = file.tell(), True
        tags.pixel_bytes = None if length == _UNDEFINED else length
        return length != _UNDEFINED  # else pydicom follows the fragments to their end

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.filterwarnings("error", ".*End of file")  # compressed pixels without an end
        found = read_partial(file, at_pixels, force=True, specific_tags=list(_NAMES))
        tags.values = _values(found)
    tags.syntax = found.file_meta.get("TransferSyntaxUID", _IMPLICIT)
    if tags.syntax != _DEFLATED and start + (tags.pixel_bytes or 0) > os.fstat(file.fileno()).st_size:
        raise DamagedError("the file ends inside its pixels")
    return tags


def _values(dataset) -> dict:
    values: dict = {}
    for tag in dataset.keys() & _NAMES.keys():
        name, raw = _NAMES[tag], dataset.get_item(tag)
        if name in _SEQUENCES:
            values[name] = [_values(item) for item in dataset[tag].value or []]
        elif name in _SHORTS:
            values[name] = int.from_bytes(raw.value[:2], "little" if raw.is_little_endian else "big")
        else:
            values[name] = (raw.value or b"").decode("latin-1").strip(" \0")
    return values
