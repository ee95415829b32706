"""Reference pictures kept on disk: cast once for a volume, a look, a view and a version of the reference."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from .. import reference
from ..errors import FileError
from ..geometry.regions import Regions
from ..geometry.view import View
from ..optics.look import Look
from ..optics.transfer import TransferFunction
from ..optics.transfer2d import TransferFunction2D
from ..volume.grid import Volume

TOLERANCE = 1e-4  # of the reference; the pictures are within 1e-6 of the truth or so, see `reference.render`
_REFERENCE_SOURCES = sorted(Path(reference.__file__).parent.glob("*.py"))


def default_cache() -> Path:
    """Beside the compiled kernels, in the user's cache folder."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "persp_sw" / "references"


@dataclass
class Truths:
    """Reference pictures, cast when first asked for.

    Parameters
    ----------
    folder
        Where they are kept; it may be emptied at any time.
    threads
        Of the reference; None: all.
    """

    folder: Path = field(default_factory=default_cache)
    threads: int | None = None
    cast: int = 0  # pictures that had to be cast

    def __post_init__(self):
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(
                f"cannot make the folder {self.folder} for reference pictures: {error.strerror}; choose "
                "another with --cache"
            ) from None

    def of(
        self,
        volume: Volume,
        transfer: TransferFunction | TransferFunction2D,
        view: View,
        regions: Regions,
        progress: Callable[[int, int, str], None] | None = None,
        look: Look | None = None,
    ) -> NDArray[np.float32]:
        """(h, w, 4) linear premultiplied; rounded to float32, 6e-8."""
        path = self.folder / f"{key_of(volume, transfer, view, regions, look)}.npz"
        try:
            with path.open("rb") as source, np.load(source, allow_pickle=False) as file:
                return file["truth"]
        except (OSError, EOFError, KeyError, ValueError, BadZipFile):
            pass  # not there, or damaged: cast it
        truth = reference.render(
            volume,
            transfer,
            view,
            regions=regions,
            look=look,
            tolerance=TOLERANCE,
            threads=self.threads,
            progress=progress,
        ).astype(np.float32)
        self.cast += 1
        part = path.with_name(f"{path.stem}-{os.getpid()}.part")
        try:
            with part.open("wb") as file:
                np.savez_compressed(file, truth=truth)
            part.replace(path)  # whole or not at all
        except OSError as error:
            raise FileError(f"cannot keep a reference picture in {self.folder}: {error.strerror}") from None
        return truth


def key_of(
    volume: Volume,
    transfer: TransferFunction | TransferFunction2D,
    view: View,
    regions: Regions,
    look: Look | None = None,
) -> str:
    """A name for all that a reference picture depends on, the reference's own source included."""
    transfer = transfer.with_unit(min(volume.spacing))
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in _REFERENCE_SOURCES))
    parts: list[Any] = [
        *("volume", volume.data.shape, volume.data.dtype.str, volume.world_from_object.tolist()),
        *("transfer", transfer.to_dict()),
        *("view", view.direction_from_pixel.tolist(), view.size),
        *("eye", view.eye.position.tolist(), view.eye.near),
        # From infinity all pixels have one direction: where the wall stands tells their rays apart.
        *(("infinity", view.wall.world_from_pixel.tolist()) if view.eye.is_at_infinity else ()),
        *("regions", regions, TOLERANCE),
        *("look", look or Look()),
    ]
    digest.update(repr(parts).encode())
    digest.update(np.ascontiguousarray(volume.data))
    return digest.hexdigest()[:32]
