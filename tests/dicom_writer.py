"""Tiny DICOM files for tests: explicit little-endian data sets of any elements, well-formed or not."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

CT, ENHANCED_CT, ULTRASOUND = (f"1.2.840.10008.5.1.4.1.1.{tail}" for tail in ("2", "2.1", "3.1"))
EXPLICIT, IMPLICIT = "1.2.840.10008.1.2.1", "1.2.840.10008.1.2"
PIXELS = "7fe0|0010"


def element(tag: str, vr: str, value, implicit: bool = False) -> bytes:
    group, number = (int(word, 16) for word in tag.split("|"))
    if vr == "SQ":
        items = [b"".join(element(t, *v, implicit) for t, v in sorted(item.items())) for item in value]
        body = b"".join(struct.pack("<HHI", 0xFFFE, 0xE000, len(item)) + item for item in items)
    elif vr in ("US", "UL"):
        body = struct.pack("<H" if vr == "US" else "<I", value)
    elif vr in ("OW", "OB"):
        body = bytes(value)
    else:
        body = str(value).encode()
        body += (b"\0" if vr == "UI" else b" ") * (len(body) % 2)
    if implicit:
        return struct.pack("<HHI", group, number, len(body)) + body
    if vr in ("OW", "OB", "SQ"):
        return struct.pack("<HH2sHI", group, number, vr.encode(), 0, len(body)) + body
    return struct.pack("<HH2sH", group, number, vr.encode(), len(body)) + body


def fragments(stream: bytes) -> bytes:
    """Encapsulated pixel data of one fragment."""
    items = (b"", stream)
    body = b"".join(struct.pack("<HHI", 0xFFFE, 0xE000, len(item)) + item for item in items)
    end = struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
    return struct.pack("<HH2sHI", 0x7FE0, 0x0010, b"OB", 0, 0xFFFFFFFF) + body + end


def dicom(
    path: Path, pixels, tags: dict, *, syntax=EXPLICIT, sop=CT, marked=True, stream: bytes = b""
) -> Path:
    """One file; `pixels` [row, column] or [frame, row, column]; a tag with the value None is left out."""
    pixels = np.asarray(pixels)
    bits = 8 * pixels.dtype.itemsize
    found = {
        "0008|0016": ("UI", sop),
        "0008|0018": ("UI", "1.2.3.9"),
        "0028|0002": ("US", 1),
        "0028|0004": ("CS", "MONOCHROME2"),
        "0028|0010": ("US", pixels.shape[-2]),
        "0028|0011": ("US", pixels.shape[-1]),
        "0028|0100": ("US", bits),
        "0028|0101": ("US", bits),
        "0028|0102": ("US", bits - 1),
        "0028|0103": ("US", int(pixels.dtype.kind == "i")),
        PIXELS: ("OW", pixels.astype(pixels.dtype.newbyteorder("<")).tobytes()),
    }
    if pixels.ndim == 3:
        found["0028|0008"] = ("IS", len(pixels))
    found |= tags
    implicit = syntax == IMPLICIT
    body = b"".join(
        fragments(stream) if stream and tag == PIXELS else element(tag, *value, implicit)
        for tag, value in sorted(found.items())
        if value is not None
    )
    meta = [("0002|0001", "OB", b"\0\1"), ("0002|0002", "UI", sop), ("0002|0003", "UI", "1.2.3.9")]
    meta = b"".join(element(*x) for x in [*meta, ("0002|0010", "UI", syntax), ("0002|0012", "UI", "1.2.3")])
    head = b"\0" * 128 + b"DICM" + element("0002|0000", "UL", len(meta)) + meta
    path.write_bytes((head if marked else b"") + body)
    return path


def slice_tags(
    instance: int,
    position,
    *,
    orientation=(1, 0, 0, 0, 1, 0),
    uid="1.2.3.4",
    slope="1",
    intercept="-1024",
    pixel=(0.75, 0.5),
    description="head",
    number=1,
) -> dict:
    """Elements of one CT slice; `pixel` is row spacing (y), column spacing (x)."""

    def decimal(values) -> str:
        return "\\".join(f"{v:.10g}" for v in values)

    return {
        "0008|0018": ("UI", f"{uid}.{instance}"),
        "0008|0060": ("CS", "CT"),
        "0008|103e": ("LO", description),
        "0018|0050": ("DS", "2"),
        "0020|000d": ("UI", "1.2.3"),
        "0020|000e": ("UI", uid),
        "0020|0011": ("IS", number),
        "0020|0013": ("IS", instance),
        "0020|0032": ("DS", decimal(position)),
        "0020|0037": ("DS", decimal(orientation)),
        "0028|0030": ("DS", decimal(pixel)),
        "0028|1052": ("DS", intercept),
        "0028|1053": ("DS", slope),
    }


def enhanced_tags(positions, *, orientation=(1, 0, 0, 0, 1, 0), slopes=None) -> dict:
    """Elements of an enhanced multi-frame CT with functional groups."""

    def group(tag: str, **tags) -> dict:
        return {tag: ("SQ", [tags])}

    def decimal(values) -> str:
        return "\\".join(f"{v:.10g}" for v in values)

    def transformation(slope: str) -> dict:
        return group("0028|9145", **{"0028|1052": ("DS", "-1024"), "0028|1053": ("DS", slope)})

    shared = group("0028|9110", **{"0028|0030": ("DS", "0.75\\0.5"), "0018|0050": ("DS", "2")})
    shared |= group("0020|9116", **{"0020|0037": ("DS", decimal(orientation))})
    frames = [group("0020|9113", **{"0020|0032": ("DS", decimal(p))}) for p in positions]
    if slopes is None:
        shared |= transformation("1")
    else:
        frames = [frame | transformation(slope) for frame, slope in zip(frames, slopes, strict=True)]
    series = {"0020|000d": ("UI", "1.2.3"), "0020|000e": ("UI", "1.2.3.4"), "0008|0060": ("CS", "CT")}
    return {**series, "5200|9229": ("SQ", [shared]), "5200|9230": ("SQ", frames)}
