"""Small volume files written byte by byte, so that the tests know their contents without any library,
and checks of what comes of them."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest

from persp_sw.errors import FileError
from persp_sw.volume.files import load

SIZE = (7, 6, 5)  # x, y, z
MARK = (5, 1, 3)  # voxel of the marker, off every centre
MARKED = 900


def marked(dtype="<i2", shape=SIZE[::-1]) -> np.ndarray:
    """[z, y, x] 1, 2, 3, … with one voxel of 900."""
    data = np.arange(1, np.prod(shape) + 1).reshape(shape).astype(dtype)
    x, y, z = MARK
    data[z, y, x] = MARKED
    return data


def where_marked(volume) -> np.ndarray:
    """World position of the marker: where the data say it is, through the pose."""
    z, y, x = np.argwhere(volume.data == MARKED)[0]
    return (volume.world_from_object @ (x, y, z, 1))[:3]


def refused(path, *words: str, error=FileError, **options) -> str:
    """The message with which `load` refuses; it names the path and gives advice after a semicolon."""
    with pytest.raises(error) as caught:
        load(path, **options)
    message = str(caught.value)
    assert caught.value.__suppress_context__ or caught.value.__context__ is None  # no traceback of a library
    for word in (*words, os.path.basename(str(path))):
        assert word in message, f"{word!r} is not in {message!r}"
    assert error is not FileError or ";" in message
    return message


def itk(path):
    """Array and (4, 4) pose as ITK reads the file."""
    import SimpleITK as sitk

    image = sitk.ReadImage(str(path))
    n = image.GetDimension()
    matrix = np.eye(4)
    matrix[:3, :3] = (np.reshape(image.GetDirection(), (n, n)) * image.GetSpacing())[:3, :3]
    matrix[:3, 3] = image.GetOrigin()[:3]
    return sitk.GetArrayFromImage(image), matrix


def nrrd(
    path: Path, data: np.ndarray, *fields: str, sizes=None, end=b"", kind="int16", encoding="raw"
) -> Path:
    sizes = sizes or data.shape[::-1]
    lines = ["NRRD0005", f"type: {kind}", f"dimension: {len(sizes)}", f"sizes: {' '.join(map(str, sizes))}"]
    lines += ["endian: little", f"encoding: {encoding}", *fields]
    path.write_bytes("\n".join([*lines, "", ""]).encode() + (end or data.tobytes()))
    return path


def metaimage(path: Path, data: np.ndarray, *fields: str, sizes=None, name="LOCAL", kind="MET_SHORT") -> Path:
    sizes = sizes or data.shape[::-1]
    lines = ["ObjectType = Image", f"NDims = {len(sizes)}", *fields, f"DimSize = {' '.join(map(str, sizes))}"]
    lines += [f"ElementType = {kind}", f"ElementDataFile = {name}", ""]
    path.write_bytes("\n".join(lines).encode() + (data.tobytes() if name == "LOCAL" else b""))
    return path


def nifti_header(
    sizes=SIZE,
    *,
    datatype=4,
    pixdim=(1, 2, 3, 4),
    units=2,
    sform=None,
    quatern=None,
    offset=(0, 0, 0),
    scale=(0, 0),
    magic=b"n+1\0",
    order="<",
    voxels=352,
) -> bytearray:
    """NIfTI-1 header of 352 bytes; `sform` is (3, 4) in RAS, `quatern` b, c, d."""
    head = bytearray(352)

    def put(at: int, code: str, *values) -> None:
        struct.pack_into(order + code, head, at, *values)

    put(0, "i", 348)
    put(40, "8h", len(sizes), *sizes, *[1] * (7 - len(sizes)))
    put(70, "2h", datatype, {2: 8, 4: 16, 8: 32, 16: 32, 64: 64, 128: 24, 512: 16}.get(datatype, 0))
    put(76, f"{len(pixdim)}f", *pixdim)
    put(108, "3f", voxels, *scale)
    put(123, "B", units)
    if quatern is not None:
        put(252, "h", 1)
        put(256, "6f", *quatern, *offset)
    if sform is not None:
        put(254, "h", 1)
        put(280, "12f", *np.ravel(sform))
    head[344:348] = magic
    return head


def nifti2_header(sizes=SIZE, *, datatype=4, sform=None, order="<") -> bytearray:
    head = bytearray(544)
    struct.pack_into(order + "i8s2h", head, 0, 540, b"n+2\0\r\n\x1a\n", datatype, 16)
    struct.pack_into(order + "8q", head, 16, len(sizes), *sizes, *[1] * (7 - len(sizes)))
    struct.pack_into(order + "8d", head, 104, 1, 2, 3, 4, 0, 0, 0, 0)
    struct.pack_into(order + "q2d", head, 168, 544, 0, 0)
    struct.pack_into(order + "2i", head, 344, 0, int(sform is not None))
    if sform is not None:
        struct.pack_into(order + "12d", head, 400, *np.ravel(sform))
    struct.pack_into(order + "i", head, 500, 2)
    return head
