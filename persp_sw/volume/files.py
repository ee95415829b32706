"""Volumes from files: the public door `load`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

from ..arrays import Vector
from ..errors import FileError, VolumeError
from . import dicom, metaimage, nifti, nrrd, raw, tiff, vtk_image
from .dicom_series import Series, list_series
from .examples import EXAMPLES, example_name
from .grid import Volume
from .orientation import letters
from .stored import Progress, Stored, pick

__all__ = ["Series", "list_series", "load"]

_ENDINGS = {
    "NRRD": (".nrrd", ".nhdr"),
    "NIfTI": (".nii.gz", ".nii", ".hdr", ".img", ".hdr.gz", ".img.gz"),
    "MetaImage": (".mha", ".mhd"),
    "DICOM": (".dcm", ".dicom", ".ima"),
    "TIFF": (".tif", ".tiff"),
    "numpy": (".npy",),
    "VTK": (".vti", ".vtk"),
    "raw": (".raw", ".bin"),
}
_BY_ENDING = {ending: kind for kind, endings in _ENDINGS.items() for ending in endings}


def load(
    path: str | Path,
    *,
    frame: int | None = None,
    component: int | str | None = None,
    series: int | str | None = None,
    shape: Sequence[int] | None = None,
    dtype: DTypeLike | None = None,
    spacing: Vector | None = None,
    byte_order: str = "little",
    header_bytes: int = 0,
    progress: Progress | None = None,
) -> Volume:
    """A volume from a file or folder.

    Reads NRRD (.nrrd, .nhdr), NIfTI (.nii, .nii.gz, .hdr, .img), MetaImage (.mha, .mhd), DICOM (a folder, or
    one file of a series), TIFF (a file of many pages, or a folder of single pages in natural order), .npy
    (axes z, y, x), VTK images (.vti, .vtk; with the extra `vtk`) and raw files. Values are as stored,
    after rescale slope and intercept. The pose is the file's, an anatomical one in LPS and mm; without one,
    world = index · spacing. "stent.demo", where there is no such file, is the scan of `persp-sw demo`.

    Parameters
    ----------
    frame
        Which frame of a series in time, from 0.
    component
        Which component of vectors or colours, from 0, or "magnitude" for their length.
    series
        Which series of a DICOM folder: its number in `list_series`, from 1, or its UID.
    shape, dtype
        For raw files: voxels along x, y, z and their type; x is fastest.
    spacing
        Along x, y and z in world units. Replaces what the file states, and its pose.
    byte_order, header_bytes
        For raw files: "little" or "big", and the bytes before the first voxel.
    progress
        Called as progress(done, total, what) while reading.

    Raises
    ------
    FileError
        Missing, unreadable, truncated or unknown files; those with several volumes, none of them chosen.
    VolumeError
        Contents that are no volume: no finite value, a singular pose.
    MissingPackageError
        A VTK file without the vtk package.
    """
    path = Path(path)
    if example := example_name(path):
        volume = EXAMPLES[example]()
        return volume if spacing is None else volume.with_spacing(spacing)
    try:
        kind = _kind(path, shape is not None or dtype is not None)
        if series is not None and kind != "DICOM":
            raise FileError(
                f"{path}: series={series!r} chooses from a DICOM folder, this is {kind}; leave it out"
            )
        stored = _stored(path, kind, series, shape, dtype, byte_order, header_bytes, progress)
        data = pick(stored, path, frame, component, progress)
        where = _where(path, stored, spacing)
    except OSError as error:
        culprit = error.filename or path
        raise FileError(
            f"{culprit}: cannot be read ({error.strerror or error}); check its permissions"
        ) from None
    except MemoryError:
        raise FileError(f"{path}: the volume does not fit into memory; crop or resample the file") from None
    try:
        return Volume(data, name=_name(path), **where)
    except VolumeError as error:
        raise VolumeError(f"{path}: {error}") from None


def _kind(path: Path, raw_stated: bool) -> str:
    if path.is_dir():
        return "TIFF" if _is_tiff_folder(path) else "DICOM"
    if not path.exists():
        raise FileError(f"{path}: no such file or folder; check the name")
    if not path.is_file():
        raise FileError(f"{path}: neither a file nor a folder; check the name")
    if path.stat().st_size == 0:
        raise FileError(f"{path}: the file is empty; copy or export it again")
    with path.open("rb") as file:
        head = file.read(132)
    if raw_stated:
        return "raw"
    kind = next((_BY_ENDING[e] for e in _BY_ENDING if path.name.lower().endswith(e)), None)
    if kind is None and head[128:] == b"DICM":
        return "DICOM"
    if kind is None:
        known = ", ".join(_BY_ENDING)
        raise FileError(
            f"{path}: unknown kind of file; known endings are {known}, and DICOM files of any name; "
            "for raw voxels state shape=(x, y, z) and dtype="
        )
    return kind


def _is_tiff_folder(folder: Path) -> bool:
    pages = _tiff_pages(folder)
    others = [f for f in folder.iterdir() if f.is_file() and f not in pages and _is_dicom(f)] if pages else []
    if others:
        raise FileError(
            f"{folder}: the folder holds DICOM ({others[0].name}) and TIFF ({pages[0].name}); part them"
        )
    return bool(pages)


def _is_dicom(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(132)[128:] == b"DICM"


def _tiff_pages(folder: Path) -> list[Path]:
    return [f for f in folder.iterdir() if f.is_file() and f.suffix.lower() in _ENDINGS["TIFF"]]


def _stored(path: Path, kind: str, series, shape, dtype, byte_order, header_bytes, progress) -> Stored:
    if kind == "raw":
        return raw.read(path, shape, dtype, byte_order, header_bytes)
    if kind == "numpy":
        return raw.read_npy(path)
    if kind == "DICOM":
        return dicom.read(path, series, progress)
    if kind == "TIFF" and path.is_dir():
        return tiff.read_folder(path, _tiff_pages(path), progress)
    readers = {"NRRD": nrrd, "NIfTI": nifti, "MetaImage": metaimage, "TIFF": tiff, "VTK": vtk_image}
    return readers[kind].read(path, progress)


def _where(path: Path, stored: Stored, spacing: Vector | None) -> dict:
    """Keywords of Volume for the pose."""
    if spacing is not None:
        return {"spacing": spacing}
    stated = np.array(stored.spacing if stored.spacing is not None else (1, 1, 1), np.float64)
    if not (np.isfinite(stated) & (stated > 0)).all():
        raise FileError(
            f"{path}: the header states the spacing {tuple(stated.tolist())}, which must be positive; "
            "state it with spacing=(x, y, z)"
        )
    matrix = stored.world_from_object
    with np.errstate(all="ignore"):
        singular = not np.linalg.det(matrix[:3, :3]) or not np.isfinite(matrix).all()
    return {
        "world_from_object": matrix,
        "orientation": letters(matrix) if stored.anatomical and not singular else "",
    }


def _name(path: Path) -> str:
    name = path.resolve().name
    ending = next((e for e in _BY_ENDING if name.lower().endswith(e)), "")
    return name[: len(name) - len(ending)] if not path.is_dir() else name
