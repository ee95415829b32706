"""TIFF stacks: one file of many pages, or a folder of pages in natural order."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ..arrays import Voxels
from ..errors import FileError
from .orientation import pose
from .stored import Progress, Stored, in_five_axes

_ROLES = {"X": "space", "Y": "space", "Z": "space", "Q": "space", "I": "space", "T": "frame"}
_MM = {2: 25.4, 3: 10.0}  # millimetres of a resolution unit: inch, centimetre
_METRES = {"nm": 1e-9, "µm": 1e-6, "μm": 1e-6, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "Å": 1e-10}
_CUT_OFF = re.compile(r"invalid page offset|corrupted|raised TiffFileError|suspicious")
_AGAIN = "copy or export the file again"

_log = logging.getLogger(__name__)


def read(path: Path, progress: Progress | None) -> Stored:
    """Voxels and spacing of a multi-page file.

    The spacing is that of the OME-XML or ImageJ metadata, in their unit; else the resolution tags, in mm, for
    x and y, and z like x. Axes T are frames, C and S (colours) components; T without Z is taken for slices.
    """
    with _opened(path) as (file, tifffile):
        series = file.series[0]
        axes, shape = series.axes, series.shape
        data = _pages(path, file, series, tifffile, progress)
        spacing = _spacing(file)
    if "T" in axes and not set(axes) & set("ZQI"):
        axes = axes.replace("T", "Z")
    roles = [_ROLES.get(axis, "component") for axis in axes]
    space = [i for i, role in enumerate(roles) if role == "space"]
    if len(space) > 3 or len(file.series) > 1:
        what = f"{len(file.series)} images of their own" if len(space) <= 3 else f"axes {axes} of {shape}"
        raise FileError(
            f"{path}: the file holds {what}; a volume is one stack of equal pages, export it as one"
        )
    named = {"Q": 2, "I": 2, "Z": 2, "Y": 1, "X": 0}
    space.sort(key=lambda i: -named[axes[i]])
    frames, components = ([i for i, r in enumerate(roles) if r == word] for word in ("frame", "component"))
    return Stored(in_five_axes(data, frames, space, components), pose(np.eye(3), spacing=spacing), spacing)


def read_folder(folder: Path, files: list[Path], progress: Progress | None) -> Stored:
    """Single-page files as slices, in natural order of their names (2 before 10)."""
    files = sorted(
        files, key=lambda f: [int(w) if w.isdecimal() else w for w in re.split(r"(\d+)", f.name.lower())]
    )
    out, spacing = None, (1.0, 1.0, 1.0)
    for z, path in enumerate(files):
        with _opened(path) as (file, tifffile):
            if len(file.pages) != 1:
                raise FileError(
                    f"{path}: {len(file.pages)} pages in one of {len(files)} TIFF files; "
                    "give one file, or a folder of single pages"
                )
            page = _page(path, file.pages[0], 0, tifffile)
            if out is None:
                out, spacing = np.empty((len(files), *page.shape), page.dtype), _spacing(file)
        if page.shape != out.shape[1:] or page.dtype != out.dtype:
            raise FileError(
                f"{path}: a page of shape {page.shape} and type {page.dtype}, unlike {files[0].name} with "
                f"{out.shape[1:]} and {out.dtype}; take it out of the folder"
            )
        out[z] = page
        if progress:
            progress(z + 1, len(files), "reading TIFF")
    axes = [3] if out.ndim == 4 else []
    return Stored(in_five_axes(out, [], [0, 1, 2], axes), pose(np.eye(3), spacing=spacing), spacing)


@contextmanager
def _opened(path: Path) -> Iterator:
    """The open file; tifffile's complaints become one FileError and stay off the terminal."""
    import tifffile

    logger, complaints = logging.getLogger("tifffile"), _Complaints()
    logger.addHandler(complaints)  # with a handler, logging does not print on its own
    try:
        with tifffile.TiffFile(path) as file:
            if not file.series:
                raise FileError(f"{path}: the file has no pages; {_AGAIN}")
            yield file, tifffile
    except (FileError, OSError, MemoryError):
        raise
    except Exception as error:  # tifffile meets damaged files with errors of any type
        if "not a TIFF" in str(error):
            raise FileError(f"{path}: the file is not a TIFF file; check what it is") from None
        raise FileError(f"{path}: truncated or damaged: {_brief(error)}; {_AGAIN}") from None
    finally:
        logger.removeHandler(complaints)
    if complaints.cut_off:
        raise FileError(f"{path}: truncated or damaged: {complaints.cut_off}; {_AGAIN}")


class _Complaints(logging.Handler):
    cut_off = ""

    def emit(self, record: logging.LogRecord) -> None:
        message = record.getMessage()
        if not self.cut_off and _CUT_OFF.search(message):
            self.cut_off = _brief(re.sub(r"<tifffile[^>]*>|<TiffTag[^>]*>", "", message).strip())


def _brief(error) -> str:
    return str(error).splitlines()[0][:120] if str(error) else type(error).__name__


def _pages(path: Path, file, series, tifffile, progress: Progress | None) -> Voxels:
    pages = series.levels[0].pages
    count = int(np.prod(series.shape[: len(series.shape) - len(pages[0].shape)], dtype=np.int64))
    if count != len(pages) or any(page is None for page in pages):
        return series.asarray()  # one block, or pages that are not written: tifffile knows
    data = np.empty((count, *pages[0].shape), series.dtype)
    for i, page in enumerate(pages):
        data[i] = _page(path, page.aspage() if hasattr(page, "aspage") else page, page.index, tifffile)
        if progress:
            progress(i + 1, count, "reading TIFF")
    return data.reshape(series.shape)


def _page(path: Path, page, index: int, tifffile) -> Voxels:
    """One page; compressions that tifffile leaves to an optional package are read with Pillow."""
    try:
        return page.asarray()
    except (ValueError, ImportError) as error:
        if "imagecodecs" not in str(error):
            raise
    from PIL import Image

    advice = "pip install imagecodecs, or export the stack without compression"
    try:
        with Image.open(path) as image:
            image.seek(index)
            data = np.asarray(image)
    except (OSError, EOFError, ValueError, SyntaxError):
        name = getattr(page.compression, "name", page.compression)
        raise FileError(f"{path}: page {index} with {name} compression cannot be read; {advice}") from None
    if data.shape != page.shape:
        raise FileError(f"{path}: page {index} with {page.compression} compression cannot be read; {advice}")
    return data.astype(page.dtype)


def _spacing(file) -> tuple[float, float, float]:
    found = _ome_spacing(file.ome_metadata) if file.is_ome and file.ome_metadata else None
    if found is not None:
        return found
    page = file.pages[0]
    x, y, unit = (
        page.tags[n].value if n in page.tags else None
        for n in ("XResolution", "YResolution", "ResolutionUnit")
    )
    x, y = (v[1] / v[0] if isinstance(v, tuple) and v[0] > 0 and v[1] > 0 else None for v in (x, y))
    x, y = x or y or 1.0, y or x or 1.0
    imagej = file.imagej_metadata
    if imagej:
        z = imagej.get("spacing")
        _log.info(
            "spacing of %s in %s", file.filename, imagej.get("unit") or "units that ImageJ does not state"
        )
        return x, y, x if z is None else abs(float(z))  # ImageJ writes -1 steps for stacks from below
    scale = _MM.get(int(unit or 1))
    if scale is None:  # without a unit the two numbers are a ratio
        return 1.0, y / x, 1.0
    return x * scale, y * scale, x * scale


def _ome_spacing(text: str) -> tuple[float, float, float] | None:
    """Physical sizes of OME-XML in the unit of x."""
    try:
        pixels = next((e for e in ElementTree.fromstring(text).iter() if e.tag.endswith("}Pixels")), None)
    except ElementTree.ParseError:
        return None
    if pixels is None or "PhysicalSizeX" not in pixels.attrib:
        return None
    units = [_METRES.get(pixels.get(f"PhysicalSize{axis}Unit", "µm")) for axis in "XYZ"]
    sizes = [pixels.get(f"PhysicalSize{axis}") for axis in "XYZ"]
    sizes = [float(size if size is not None else sizes[0]) for size in sizes]
    units = [unit if size is not None else units[0] for unit, size in zip(units, sizes, strict=True)]
    if None in units:
        return tuple(sizes)
    return tuple(size * (unit / units[0]) for size, unit in zip(sizes, units, strict=True))
