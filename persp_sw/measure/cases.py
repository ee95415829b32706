"""What the benchmark renders: fixed volumes, transfer functions, eyes and picture sizes.

Real volumes come from a folder; made-up ones (`ct128`: `phantoms.synthetic_ct`) are always there.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..errors import FileError, PerspSWError
from ..geometry.regions import Regions
from ..geometry.view import View
from ..optics.look import Look
from ..optics.transfer import TransferFunction
from ..optics.transfer2d import TransferFunction2D
from ..volume import phantoms
from ..volume.files import load
from ..volume.grid import Volume

DATA_VARIABLE = "PERSP_SW_DATA"  # names the folder of real volumes
REAL = ("engine", "bonsai", "mni152", "heptane")  # used where the folder has them
FUNCTIONS = ("fog", "ramp", "surface")
LOOKS = ("front", "corner", "inside")
FRAMES = 15  # of the eye's path; the first only warms up

# Where things become visible, and the value of a surface.
_LEVELS = {
    "engine": (0, 90),
    "bonsai": (12, 45),
    "mni152": (30, 110),
    "heptane": (8, 40),
    "ct": (10, 100),
}
# Towards the eye. Near the corner all three axes serve equally badly: the worst case of shear-warp.
_TOWARDS = {"front": (0.42, 0.27, 0.87), "corner": (0.58, 0.55, 0.60), "inside": (0.42, 0.27, 0.87)}
_STEP = np.array((0.003, 0.0015, -0.001))  # of the eye from frame to frame, in volume edges
_SUFFIXES = (".nrrd", ".nii.gz", ".nii", ".mha", ".npy", ".vti", ".tif")


@dataclass(frozen=True, eq=False)
class Stage:
    """What one case renders.

    Attributes
    ----------
    views
        The eye's path. The first view warms up, the others are timed over and over, the last one's picture is
        judged.
    """

    volume: Volume
    transfer: TransferFunction | TransferFunction2D
    views: Sequence[View]
    regions: Regions = field(default_factory=Regions)
    look: Look = field(default_factory=Look)


@dataclass(frozen=True)
class Case:
    """One line of the benchmark: its name, its labels, and how to get at it.

    Attributes
    ----------
    open
        Reads or makes the volume. PerspSWError where that fails.
    """

    name: str
    volume: str
    function: str
    look: str
    size: tuple[int, int]
    open: Callable[[], Stage]

    @property
    def labels(self) -> dict[str, object]:
        """For reports."""
        return {
            "case": self.name,
            "volume": self.volume,
            "function": self.function,
            "view": self.look,
            "size": list(self.size),
        }


def data_folder(given: str | Path | None) -> Path | None:
    """The folder of real volumes: what is given, else what the environment names; None if neither."""
    name = given or os.environ.get(DATA_VARIABLE)
    if not name:
        return None
    folder = Path(name)
    if not folder.is_dir():
        raise FileError(f"there is no data folder {folder}; check --data or {DATA_VARIABLE}")
    return folder / "volumes" if (folder / "volumes").is_dir() else folder


def find_volume(folder: Path, name: str) -> Path | None:
    """The volume file in `folder` whose name begins so; None where there is none."""
    return next((p for p in sorted(folder.glob(f"{name}*")) if p.name.endswith(_SUFFIXES)), None)


def default_volumes(folder: Path | None) -> list[str]:
    """The real volumes that are there, and a made-up one."""
    return [name for name in REAL if folder is not None and find_volume(folder, name)] + ["ct256"]


def fixed_cases(
    volumes: Iterable[str],
    folder: Path | None = None,
    functions: Iterable[str] = FUNCTIONS,
    looks: Iterable[str] = LOOKS,
    sizes: Iterable[int] = (512, 1024),
) -> list[Case]:
    """All combinations, volume by volume.

    Parameters
    ----------
    volumes
        Names in the data folder (their beginning suffices), `ctN` for a made-up one of N³, or paths of volume
        files; with `@N` resampled so that the longest edge has N voxels.
    sizes
        Edges of the square pictures, pixels.

    Raises
    ------
    FileError
        A volume that is nowhere.
    """
    cases = []
    for name in volumes:
        _check_name(name, folder)
        stem = re.sub(r"[^\w@]", "_", Path(name).name.split(".")[0])
        for function in functions:
            for look in looks:
                for size in sizes:
                    case = f"{stem}-{function}-{look}-{size}"

                    def opened(name=name, function=function, look=look, size=size) -> Stage:
                        volume = volume_named(name, folder)
                        transfer = transfer_for(name, function, volume)
                        return Stage(volume, transfer, eye_path(volume, look, (size, size)))

                    cases.append(Case(case, stem, function, look, (size, size), opened))
    return cases


@lru_cache(maxsize=1)
def volume_named(name: str, folder: Path | None) -> Volume:
    """The volume of that name, see `fixed_cases`; the last one is kept in memory."""
    base, _, edge = name.partition("@")
    made_up = _made_up(base)
    volume = phantoms.synthetic_ct(made_up) if made_up else load(_path(base, folder))
    return resampled(volume, int(edge)) if edge else volume


def resampled(volume: Volume, size: int | tuple[int, int, int]) -> Volume:
    """The volume on another grid, trilinearly; its extent stays.

    Voxels that are whole numbers are rounded.

    Parameters
    ----------
    size
        Voxels of the longest edge, or along x, y and z, at least 2.
    """
    data = volume.data.astype(np.float32)
    if isinstance(size, int):
        factor = (size - 1) / (max(volume.size) - 1)
        name = f"{volume.name}@{size}"
        size = tuple(max(2, round((count - 1) * factor) + 1) for count in volume.size)
    else:
        name = f"{volume.name}@{'×'.join(map(str, size))}"
    for axis, (count, wanted) in enumerate(zip(data.shape, size[::-1], strict=True)):
        at = np.linspace(0, count - 1, wanted)
        below = np.minimum(at.astype(np.intp), max(count - 2, 0))
        shape = [1, 1, 1]
        shape[axis] = wanted
        weight = (at - below).astype(np.float32).reshape(shape)
        above = np.minimum(below + 1, count - 1)
        data = data.take(below, axis) * (1 - weight) + data.take(above, axis) * weight
    if volume.data.dtype.kind != "f":
        np.rint(data, out=data)
    pose = volume.world_from_object.copy()
    old, new = np.array(volume.size), np.array(data.shape[::-1])
    pose[:3, :3] *= (old - 1) / np.maximum(new - 1, 1)
    return Volume(data.astype(volume.data.dtype), world_from_object=pose, name=name)


def transfer_for(name: str, function: str, volume: Volume) -> TransferFunction:
    """One of the three transfer functions, opacities per smallest voxel spacing.

    fog lets all of the volume shine through, ramp grows from the first visible value to the top, surface is
    opaque within a twelfth of the range of values.
    """
    low, high = volume.value_range
    unit = (high - low) / 255 or 1.0
    key = next((known for known in _LEVELS if Path(name).name.startswith(known)), None)
    start, surface = (low + level * unit for level in _LEVELS.get(key, (13, 90)))
    grey = low + 128 * unit
    rows = {
        "fog": [
            (start + 6 * unit, (0.2, 0.3, 0.8), 0.0),
            (start + 40 * unit, (0.4, 0.6, 0.9), 0.006),
            (max(high, start + 41 * unit), (1.0, 0.9, 0.7), 0.020),
        ],
        "ramp": [
            (start, (0.2, 0.3, 0.8), 0.0),
            (grey, (0.9, 0.6, 0.3), (grey - start) / (high - start)),
            (high, (1.0, 1.0, 1.0), 1.0),
        ],
        "surface": [
            (surface, (0.9, 0.7, 0.5), 0.0),
            (surface + 20 * unit, (0.9, 0.7, 0.5), 1.0),
            (max(high, surface + 21 * unit), (1.0, 1.0, 1.0), 1.0),
        ],
    }
    if volume.value_range[0] == volume.value_range[1]:
        raise PerspSWError(f"the volume {name} has one value only; there is nothing to measure")
    return TransferFunction(rows[function], opacity_unit=min(volume.spacing))


def eye_path(volume: Volume, look: str, size: tuple[int, int], frames: int = FRAMES) -> list[View]:
    """The views of an eye that moves a little from frame to frame; the centre of the picture stays."""
    edge = max(volume.extent) + min(volume.spacing)
    towards = np.array(_TOWARDS[look]) / np.linalg.norm(_TOWARDS[look])
    inside = look == "inside"
    eye = volume.centre + (0.1 if inside else 1.7) * edge * towards
    centre = volume.centre - 0.3 * edge * towards if inside else volume.centre
    return [
        View.look_at(eye + frame * _STEP * edge, centre, (0, 1, 0), 90 if inside else 45, size)
        for frame in range(frames + 1)
    ]


def _made_up(base: str) -> int | None:
    match = re.fullmatch(r"ct(\d+)", base)
    return int(match[1]) if match else None


def _check_name(name: str, folder: Path | None) -> None:
    base, at, edge = name.partition("@")
    if at and not (edge.isdecimal() and int(edge) >= 2):
        raise PerspSWError(f"a volume is resampled by NAME@N with N ≥ 2 voxels; given {name!r}")
    if not _made_up(base):
        _path(base, folder)


def _path(base: str, folder: Path | None) -> Path:
    found = Path(base) if Path(base).exists() else find_volume(folder, base) if folder else None
    if found is None:
        where = f"in {folder} " if folder else ""
        raise FileError(
            f"there is no volume {base!r} {where}nor a file of that name; name the folder of real volumes "
            f"with --data or {DATA_VARIABLE}, or use a made-up volume such as ct128"
        )
    return found
