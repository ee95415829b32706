"""DICOM folders: which series they hold and where each of their slices lies."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..errors import FileError
from .dicom_tags import DamagedError, Tags, numbers, read_tags
from .stored import Progress

_IMAGES = [f"1.2.840.10008.5.1.4.1.1.{n}" for n in ("2", "2.1", "4", "4.1", "128", "128.1")]  # CT, MR, PET


@dataclass(frozen=True)
class Slice:
    """One slice: frame `frame` of file `path`. Vectors are LPS in mm; None where the file states none."""

    path: Path
    frame: int
    position: tuple[float, ...] | None
    orientation: tuple[float, ...] | None  # direction of a row (x), then of a column (y)
    spacing: tuple[float, float] | None  # along x, along y
    thickness: float | None
    rescale: tuple[str, str]
    size: tuple[int, int]  # columns, rows
    frames: int
    bits: int  # of a stored value
    syntax: str
    encapsulated: bool


@dataclass(frozen=True)
class Series:
    """One DICOM series of a folder.

    Attributes
    ----------
    number
        Its place in the list, from 1.
    slices
        Number of slices (frames of multi-frame files counted).
    size
        Columns and rows of its first slice.
    """

    number: int
    uid: str
    description: str
    modality: str
    slices: int
    size: tuple[int, int]
    parts: tuple[Slice, ...] = field(repr=False)

    def __str__(self) -> str:
        columns, rows = self.size
        words = f"{self.modality} {self.description}".strip() or "no description"
        return f"{self.number}: …{self.uid[-12:]}  {words}, {self.slices} slices of {columns}×{rows}"


def list_series(folder: str | Path, progress: Progress | None = None) -> list[Series]:
    """The image series of a folder, or of its sub-folders where it has no DICOM image itself.

    Files that are not DICOM images are ignored. Sorted by series number, then UID.

    Raises
    ------
    FileError
        The folder is missing or cannot be read, or one of its DICOM files is damaged.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise FileError(f"{folder}: no such folder; give a folder of DICOM files")
    found: dict[str, list[tuple[int, Tags, list[Slice]]]] = {}
    try:
        for depth in range(_DEPTH):
            _scan(sorted(f for f in folder.glob("*/" * depth + "*") if f.is_file()), found, progress)
            if found:
                break
    except OSError as error:
        raise FileError(
            f"{error.filename}: cannot be read ({error.strerror}); check its permissions"
        ) from None
    listed = sorted(found.items(), key=lambda item: (item[1][0][0], item[0]))
    return [_series(i + 1, uid, files) for i, (uid, files) in enumerate(listed)]


def file_tags(path: Path) -> Tags | None:
    """The elements of one DICOM file with pixels; None for anything else.

    Raises
    ------
    FileError
        A DICOM file that is damaged or truncated.
    """
    try:
        tags = read_tags(path)
    except DamagedError:
        raise FileError(f"{path}: {_DAMAGED}") from None
    if tags is None:
        return None
    values, sop_class = tags.values, tags.values.get("sop_class", "")
    if not tags.has_pixels:
        if "rows" in values or sop_class in _IMAGES:
            raise FileError(f"{path}: {_DAMAGED}")
        return None
    size = [values.get(name, 0) for name in ("rows", "columns", "bits")]
    frames = _frames(values)
    if min(size) < 1 or frames < 1:
        raise FileError(f"{path}: {_DAMAGED}")
    wanted = -(-size[0] * size[1] * size[2] * frames * values.get("samples", 1) // 8)
    if str(values.get("photometric", "")).endswith("_422"):  # two of three samples are stored
        wanted = wanted * 2 // 3
    if tags.pixel_bytes is not None and tags.pixel_bytes < wanted:
        raise FileError(f"{path}: truncated: {tags.pixel_bytes} of {wanted} bytes of pixels; {_AGAIN}")
    return tags


_DEPTH = 5  # how deep the folders of a CD go: patient, study, series
_AGAIN = "copy it again, or take it out of the folder"
_DAMAGED = f"the DICOM file is truncated or damaged; {_AGAIN}"


def _frames(values: dict) -> int:
    stated = numbers(values.get("frames"))
    return int(stated[0]) if stated else 1


def _scan(files: list[Path], found: dict, progress: Progress | None) -> None:
    for i, path in enumerate(files):
        tags = file_tags(path)
        if tags is not None:
            stated = numbers(tags.values.get("number"))
            entry = (int(stated[0]) if stated else 0, tags, slices_of(path, tags))
            found.setdefault(tags.values.get("series_uid") or "unknown", []).append(entry)
        if progress:
            progress(i + 1, len(files), "looking for DICOM")


def _series(number: int, uid: str, files: list[tuple[int, Tags, list[Slice]]]) -> Series:
    first = files[0][1].values
    parts = tuple(part for _, _, parts in files for part in parts)
    return Series(
        number, uid, first.get("description", ""), first.get("modality", ""), len(parts), parts[0].size, parts
    )


def slices_of(path: Path, tags: Tags) -> list[Slice]:
    """The slices of one file, with what each frame of a multi-frame file says for itself."""
    values, frames = tags.values, _frames(tags.values)
    shared = (values.get("shared") or [{}])[0]
    per_frame = values.get("per_frame") or []
    offsets = numbers(values.get("grid_offsets"))
    slices = []
    for frame in range(frames):
        own = per_frame[frame] if frame < len(per_frame) else {}
        look = _Lookup(values, shared, own)
        position = look("frame_position", "position") if frames == 1 or "frame_position" in own else None
        orientation = look("frame_orientation", "orientation")
        if position is None and len(offsets) == frames > 1:
            position = _along_normal(values, orientation, offsets[frame])
        pixel = look("measures", "pixel_spacing")
        thickness = look("measures", "gap_spacing") or look("measures", "thickness")
        slices.append(
            Slice(
                path,
                frame,
                position if position and len(position) == 3 else None,
                orientation if orientation and len(orientation) == 6 else None,
                (pixel[1], pixel[0]) if pixel and len(pixel) == 2 else None,
                thickness[0] if thickness else None,
                (look.text("transformation", "slope"), look.text("transformation", "intercept")),
                (values["columns"], values["rows"]),
                frames,
                values["bits"],
                tags.syntax,
                tags.encapsulated,
            )
        )
    return slices


class _Lookup:
    """Elements of a frame: its own functional groups first, then the shared ones, then the data set."""

    def __init__(self, values: dict, shared: dict, own: dict):
        self._places = (own, shared)
        self._values = values

    def text(self, sequence: str, name: str) -> str:
        for place in self._places:
            items = place.get(sequence) or [{}]
            if items[0].get(name):
                return items[0][name]
        return self._values.get(name, "")

    def __call__(self, sequence: str, name: str) -> tuple[float, ...] | None:
        return tuple(numbers(self.text(sequence, name))) or None


def _along_normal(values: dict, orientation, offset: float) -> tuple[float, ...] | None:
    """Position of a frame of a dose grid, whose frames are given as distances along the normal."""
    first = numbers(values.get("position"))
    if len(first) != 3 or not orientation or len(orientation) != 6:
        return None
    (a, b, c), (d, e, f) = orientation[:3], orientation[3:]
    normal = (b * f - c * e, c * d - a * f, a * e - b * d)
    return tuple(p + offset * n for p, n in zip(first, normal, strict=True))
