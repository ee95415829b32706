"""VTK image files, XML (.vti) and legacy (.vtk with STRUCTURED_POINTS), through the optional vtk package.

VTK fills truncated legacy files up, but says so on its output window: whatever it says there is an error.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..errors import FileError, MissingPackageError
from .orientation import pose
from .stored import Progress, Stored

_AGAIN = "copy or export the file again"


def read(path: Path, progress: Progress | None) -> Stored:
    """Voxels and pose of the active point scalars (else the first point array).

    Raises
    ------
    FileError
        No VTK image, one without values at its points, or one that VTK complains of.
    MissingPackageError
        The extra `vtk` is not installed.
    """
    legacy = path.name.lower().endswith(".vtk")
    stated = _check_legacy(path) if legacy else _stated_spacing(path)
    if progress:
        progress(0, 1, "reading VTK")
    image = _image(path, legacy)
    size = image.GetDimensions()
    arrays = image.GetPointData()
    scalars = arrays.GetScalars() or arrays.GetArray(0)
    if min(size) < 1 or scalars is None:
        raise FileError(f"{path}: truncated, or no values at its points; export it again with point data")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values = vtk_to_numpy(scalars)
    components = scalars.GetNumberOfComponents()
    if values.size != np.prod(size, dtype=np.int64) * components:
        raise FileError(f"{path}: {values.size} values for {size} points; {_AGAIN}")
    turn = image.GetDirectionMatrix()
    axes = np.array([[turn.GetElement(row, i) for row in range(3)] for i in range(3)])
    matrix = pose(axes, image.GetOrigin(), image.GetSpacing())
    matrix[:3, 3] += matrix[:3, :3] @ image.GetExtent()[::2]  # the first voxel need not have index 0
    data = np.array(values).reshape(1, *size[::-1], components)  # a copy: VTK frees its own
    if progress:
        progress(1, 1, "reading VTK")
    return Stored(data, matrix, stated or image.GetSpacing())


def _check_legacy(path: Path) -> None:
    with path.open("rb") as file:
        head = file.read(1 << 16)
    kind = re.match(rb"# vtk DataFile[^\n]*\n[^\n]*\n\s*\w+\s+DATASET\s+(\w+)", head, re.IGNORECASE)
    if kind is None:
        raise FileError(f"{path}: the file does not begin like a legacy VTK file; check what it is")
    if kind[1].upper() != b"STRUCTURED_POINTS":
        held = kind[1].decode("latin-1")
        raise FileError(
            f"{path}: the file holds {held}; only STRUCTURED_POINTS are a volume, resample it to them"
        )
    points, size = re.search(rb"\nPOINT_DATA\s+(\d{1,18})\b", head), path.stat().st_size
    if points and int(points[1]) > size:  # VTK would make room for them all first
        raise FileError(
            f"{path}: truncated: {int(points[1])} points promised, {size} bytes in the file; {_AGAIN}"
        )


def _stated_spacing(path: Path) -> tuple[float, ...] | None:
    """The spacing in the XML file's own words: VTK turns NaN into 1 without saying so."""
    with path.open("rb") as file:
        head = file.read(1 << 16).decode("latin-1")
    tag = re.search(r"<ImageData\b[^>]*>", head)
    if not re.search(r"<VTKFile\b", head) or tag is None:
        raise FileError(f"{path}: the file is no VTK image (an XML file with ImageData); check what it is")
    words = re.search(r"""\bSpacing\s*=\s*["']([^"']*)["']""", tag.group())
    if words is None:
        return None
    try:
        spacing = tuple(float(word) for word in words.group(1).split())
    except ValueError:
        spacing = ()
    return spacing if len(spacing) == 3 else (np.nan,) * 3


def _image(path: Path, legacy: bool):
    try:
        from vtkmodules.vtkIOLegacy import vtkStructuredPointsReader
        from vtkmodules.vtkIOXML import vtkXMLImageDataReader
    except ImportError:
        raise MissingPackageError(
            f'{path}: VTK files need the vtk package; pip install "persp-sw[vtk]"'
        ) from None
    reader = vtkStructuredPointsReader() if legacy else vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    with _complaints(reader) as complaints:
        reader.Update()
    if complaints or reader.GetErrorCode():
        said = (complaints or ["it does not say why"])[0].rpartition("): ")[2].partition(" for file")[0]
        said = "".join(c for c in said if c.isprintable()).rstrip("!: ")
        raise FileError(f"{path}: truncated or damaged: VTK cannot read it ({said}); {_AGAIN}")
    return reader.GetOutput()


@contextmanager
def _complaints(reader) -> Iterator[list[str]]:
    """What VTK says while it reads, by events or on its output window; kept off the terminal."""
    from vtkmodules.util.misc import calldata_type
    from vtkmodules.vtkCommonCore import VTK_STRING, vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    found: list[str] = []

    @calldata_type(VTK_STRING)
    def note(_, __, words: str) -> None:
        found.append(words)

    # The XML reader complains through two more objects, the logger on the terminal besides the window.
    parts = [getattr(reader, f"Get{name}ErrorObserver", lambda: None)() for name in ("Reader", "Parser")]
    for each in (reader, *filter(None, parts)):
        each.AddObserver("ErrorEvent", note)
        each.AddObserver("WarningEvent", note)
    shown, level = vtkOutputWindow.GetInstance(), vtkLogger.GetCurrentVerbosityCutoff()
    window = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield found
    finally:
        vtkLogger.SetStderrVerbosity(level)
        vtkOutputWindow.SetInstance(shown)
    found.extend(window.GetOutput().strip().splitlines()[-1:])
