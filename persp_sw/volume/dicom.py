"""A DICOM series as one volume: slices in order along their normal, evenly spaced, or refused by name."""

from __future__ import annotations

import os
from collections import Counter
from contextlib import contextmanager, nullcontext
from pathlib import Path

import numpy as np

from ..arrays import Matrix, Voxels
from ..errors import FileError
from .dicom_series import Series, Slice, file_tags, list_series, slices_of
from .dicom_tags import BIG_ENDIAN
from .orientation import pose
from .stored import Progress, Stored, narrowed

EVEN = 0.1  # a slice may lie this share of the spacing away from its even place
TILT = np.radians(0.5)  # largest angle between the normal and the line of positions
_ALIKE = 1e-3  # largest difference of direction cosines, and relative of pixel spacings, within a volume
_UNREADABLE = {  # transfer syntaxes that GDCM cannot decode; 1.2.840.10008.1.2.4. goes before
    **{
        "94": "JPIP (referenced)",
        "95": "JPIP (referenced, deflated)",
        "201": "high-throughput JPEG 2000 (lossless)",
    },
    **{"202": "high-throughput JPEG 2000 (RPCL)", "203": "high-throughput JPEG 2000"},
    **{"110": "JPEG XL (lossless)", "111": "JPEG XL (recompressed JPEG)", "112": "JPEG XL"},
    **{str(n): "MPEG video" for n in (100, 101, 102, 103, 104, 105, 106, 107, 108)},
}
_SERIES_N = "series=N (--series N)"
_CONVERT = "convert it to an uncompressed transfer syntax, for instance with `gdcmconv --raw` or `dcmconv`"


def read(path: Path, series: int | str | None, progress: Progress | None) -> Stored:
    """Voxels and LPS pose in mm of one series: a folder, or the series that a file belongs to.

    Every slice is rescaled by its own slope and intercept.

    Raises
    ------
    FileError
        No series, several and none chosen, or slices that do not make an even grid.
    """
    where, parts = _parts(path, series, progress)
    parts, matrix, spacing = _arranged(where, parts)
    anatomical = parts[0].orientation is not None
    data = narrowed(_pixels(parts, progress), floats=True)
    return Stored(data[None], matrix, spacing, anatomical)


def _parts(path: Path, series: int | str | None, progress: Progress | None) -> tuple[str, list[Slice]]:
    if path.is_dir():
        chosen = _chosen(path, list_series(path, progress), series)
        return f"{path}: series {chosen.number}", list(chosen.parts)
    tags = file_tags(path)
    if tags is None:
        raise FileError(f"{path}: the file is not a DICOM image; check what it is")
    own = slices_of(path, tags)
    if len(own) > 1:
        return str(path), own
    uid = tags.values.get("series_uid")
    listed = list_series(path.parent, progress)
    mine = next((s for s in listed if s.uid == uid), None)
    return str(path), list(mine.parts) if mine else own


def _chosen(path: Path, listed: list[Series], series: int | str | None) -> Series:
    if not listed:
        raise FileError(f"{path}: the folder holds no DICOM image and no TIFF page; give another folder")
    lines = "\n".join(f"  {entry}" for entry in listed)
    if series is None:
        if len(listed) == 1:
            return listed[0]
        raise FileError(f"{path}: holds {len(listed)} series; choose one with {_SERIES_N}:\n{lines}")
    wanted = str(series).strip()
    for entry in listed:
        if wanted in (str(entry.number), entry.uid):
            return entry
    raise FileError(f"{path}: no series {series!r} in the folder; choose one with {_SERIES_N}:\n{lines}")


def _arranged(where: str, parts: list[Slice]) -> tuple[list[Slice], Matrix, tuple[float, ...]]:
    """Slices along +normal with their pose, or FileError saying why they are no volume."""
    _check_alike(where, parts)
    first = parts[0]
    axes = np.eye(3)
    if first.orientation is not None:
        axes[:2] = np.reshape(first.orientation, (2, 3))
        lengths = np.linalg.norm(axes[:2], axis=1)
        if not (np.abs(lengths - 1) < 0.01).all() or abs(axes[0] @ axes[1]) > 0.01:
            raise FileError(
                f"{where}: Image Orientation {first.orientation} is not two unit vectors at right angles; "
                "export the series again"
            )
        axes[:2] /= lengths[:, None]
        axes[2] = np.cross(axes[0], axes[1])
    pixel = first.spacing or (1.0, 1.0)
    if len(parts) == 1:
        spacing = (*pixel, first.thickness if first.thickness and first.thickness > 0 else 1.0)
        return parts, pose(axes, first.position or (0, 0, 0), spacing), spacing
    missing = [p for p in parts if p.position is None or p.orientation is None]
    if missing:
        raise FileError(
            f"{where}: {len(missing)} of {len(parts)} slices ({missing[0].path.name} is one) state no "
            "position or orientation (0020,0032 and 0020,0037), so their order is unknown; export them again"
        )
    positions = np.array([p.position for p in parts])
    order = np.argsort(positions @ axes[2], kind="stable")
    parts, positions = [parts[i] for i in order], positions[order]
    step = _even_step(where, parts, positions, axes[2])
    steps = (axes[0] * pixel[0], axes[1] * pixel[1], step)
    return parts, pose(steps, positions[0]), (*pixel, float(np.linalg.norm(step)))


def _check_alike(where: str, parts: list[Slice]) -> None:
    advice = "they are several volumes, export them as separate series"
    sizes = Counter(p.size for p in parts)
    if len(sizes) > 1:
        listed = ", ".join(f"{n} of {w}×{h}" for (w, h), n in sizes.most_common())
        raise FileError(f"{where}: slices of different sizes ({listed}); {advice}")
    for name, word, scale in (("orientation", "orientations", 1.0), ("spacing", "pixel spacings", None)):
        stated = [getattr(p, name) for p in parts]
        known = np.array([v for v in stated if v is not None])
        if 0 < len(known) < len(stated):
            raise FileError(
                f"{where}: only {len(known)} of {len(stated)} slices state their {word}; {advice}"
            )
        if len(known) and np.abs(known - known[0]).max() > _ALIKE * (scale or np.abs(known[0]).max()):
            apart = parts[int(np.abs(known - known[0]).max(axis=1).argmax())].path.name
            raise FileError(
                f"{where}: slices of different {word} ({parts[0].path.name} and {apart}); {advice}"
            )


def _even_step(where: str, parts: list[Slice], positions: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The step from slice to slice, or FileError where it is not the same everywhere."""
    depth = positions @ normal
    gaps = np.diff(depth)
    real = np.sort(gaps[gaps > 1e-3])
    usual = float(real[(len(real) - 1) // 2]) if len(real) else 0.0
    same = int((gaps <= max(1e-3, 0.01 * usual)).sum())
    if same:
        at = int(gaps.argmin())
        raise FileError(
            f"{where}: {same} of {len(parts)} slices lie where another lies ({parts[at].path.name} and "
            f"{parts[at + 1].path.name} are two): several phases, echoes or copies; export one of them"
        )
    step = (positions[-1] - positions[0]) / (len(parts) - 1)
    length = float(np.linalg.norm(step))
    away = np.linalg.norm(positions - positions[0] - np.arange(len(parts))[:, None] * step, axis=1)
    if away.max() > EVEN * length:
        widest = int(gaps.argmax())
        between = f"between {parts[widest].path.name} and {parts[widest + 1].path.name}"
        lost = gaps / usual
        if lost.max() > 1.5 and (np.abs(lost - np.rint(lost)) < 2 * EVEN).all():
            count = int(np.rint(lost).sum()) - len(gaps)
            raise FileError(
                f"{where}: {count} slice{'s' if count > 1 else ''} missing: {gaps[widest]:g} mm {between} "
                f"and {usual:g} mm between others; copy the whole series"
            )
        raise FileError(
            f"{where}: uneven spacing, {gaps.min():g} to {gaps[widest]:g} mm ({between}); "
            "resample the series to even slices"
        )
    angle = float(np.arccos(np.clip(step @ normal / length, -1, 1)))
    if angle > TILT:
        raise FileError(
            f"{where}: gantry tilt: the slices are stacked {np.degrees(angle):.1f}° off their normal; "
            "resample the series to upright slices"
        )
    return step


def _pixels(parts: list[Slice], progress: Progress | None) -> Voxels:
    """[z, y, x, component] rescaled values."""
    rescales: dict[Path, set] = {}
    for part in parts:
        rescales.setdefault(part.path, set()).add(part.rescale)
    mixed = next((path for path, found in rescales.items() if len(found) > 1), None)
    if mixed:  # GDCM would use those of the first frame for all
        raise FileError(
            f"{mixed}: its frames have different rescale slopes; convert it to one file per slice"
        )
    out, last, frames = None, None, None
    for z, part in enumerate(parts):
        if part.path != last:
            last, frames = part.path, _decoded(part)
        plane = frames[part.frame]
        if out is None:
            out = np.empty((len(parts), *plane.shape), _held_as(plane.dtype))
        elif plane.shape != out.shape[1:]:
            raise FileError(f"{part.path}: its pixels are unlike those of {parts[0].path.name}; {_CONVERT}")
        wider = _held_as(np.result_type(out, plane))
        if wider != out.dtype:
            out = out.astype(wider)
        out[z] = plane
        if progress:
            progress(z + 1, len(parts), "reading DICOM")
    return out


def _held_as(dtype: np.dtype) -> np.dtype:
    """Wide enough for the slices: integers as they are, everything else what a Volume keeps."""
    return dtype if dtype.kind in "iu" and dtype.itemsize <= 4 else np.dtype(np.float32)


def _decoded(part: Slice) -> Voxels:
    """[frame, y, x, component] of one file, as GDCM decodes and rescales it."""
    import SimpleITK as sitk

    number = part.syntax.rpartition("1.2.840.10008.1.2.4.")[2]
    if part.encapsulated and number in _UNREADABLE:
        raise FileError(
            f"{part.path}: compressed as {_UNREADABLE[number]} ({part.syntax}), not supported; {_CONVERT}"
        )
    if part.syntax == BIG_ENDIAN and part.bits > 16:  # GDCM swaps the bytes of such pixels wrongly
        raise FileError(f"{part.path}: {part.bits} bits in big-endian order are not supported; {_CONVERT}")
    reader = sitk.ImageFileReader()
    reader.SetImageIO("GDCMImageIO")
    reader.SetFileName(str(part.path))
    with _quiet(sitk, part.encapsulated):
        try:
            image = reader.Execute()
        except RuntimeError:
            how = f"transfer syntax {part.syntax}"
            raise FileError(f"{part.path}: the pixels cannot be decoded ({how}); {_CONVERT}") from None
        data = sitk.GetArrayFromImage(image)
    if image.GetNumberOfComponentsPerPixel() == 1:
        data = data[..., None]
    columns, rows = part.size
    return data.reshape(part.frames, rows, columns, -1)


@contextmanager
def _quiet(sitk, codecs: bool):
    """No warnings of ITK on the terminal, and for compressed pixels none of the C codecs either."""
    shown = sitk.ProcessObject.GetGlobalWarningDisplay()
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        with _without_stderr() if codecs else nullcontext():
            yield
    finally:
        sitk.ProcessObject.SetGlobalWarningDisplay(shown)


@contextmanager
def _without_stderr():
    kept, sink = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(sink)
