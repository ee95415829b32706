"""Arrays in the text form of SSDF files (Simple Structured Data Format, by A. Klein), as visvis ships them.

A line is `name = value`; an array is `array 256x128x128 uint8` and then base64 of zlib blocks, each ended by
a semicolon, or, for few elements, the numbers themselves with commas between. Structures nested in others are
indented and left out.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from math import prod
from pathlib import Path

import numpy as np

from ..errors import FileError


def read_ssdf(path: str | Path) -> dict[str, np.ndarray | float | str]:
    """The top level of an SSDF text file: arrays in their stated shape (C order), numbers, and other texts.

    Raises
    ------
    FileError
        The file is missing, is no text, or holds an array that does not fit its stated shape.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror}; check the path") from None
    except UnicodeDecodeError:
        raise FileError(f"{path} is not an SSDF text file; binary SSDF (.bsdf) is not supported") from None
    values: dict[str, np.ndarray | float | str] = {}
    for line in lines:
        name, equals, text = line.partition("=")
        if equals and not line.startswith((" ", "\t", "#")):
            values[name.strip()] = _value(text.strip(), name.strip(), path)
    if not values:
        raise FileError(f"{path} is not an SSDF text file: it has no line `name = value`")
    return values


def _value(text: str, name: str, path: str | Path) -> np.ndarray | float | str:
    if text.startswith("array "):
        return _array(text, name, path)
    try:
        return float(text)
    except ValueError:
        return text


def _array(text: str, name: str, path: str | Path) -> np.ndarray:
    try:
        _, shape_text, type_text, content = text.split(" ", 3)
        shape = [int(count) for count in shape_text.split("x")]
        dtype = np.dtype(type_text).newbyteorder("<")
        if ";" in content:
            blocks = [block for block in content.split(";") if block.strip()]
            raw = b"".join(zlib.decompress(base64.b64decode(block)) for block in blocks)
            array = np.frombuffer(raw, dtype)
        else:
            array = np.array([number for number in content.split(",") if number.strip()], np.float64)
            array = array.astype(dtype)
    except (ValueError, TypeError, zlib.error, binascii.Error) as error:
        raise FileError(f"{path}: the array {name} is damaged ({error}); get the file again") from None
    if array.size != prod(shape):
        raise FileError(
            f"{path}: the array {name} should be {shape_text} = {prod(shape)} numbers, it has {array.size}; "
            "get the file again"
        )
    return array.reshape(shape)
