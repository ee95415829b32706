"""The ladder that `persp-sw chart` measured for a machine, volume, function and look: kept and found."""

from __future__ import annotations

import hashlib
import logging
import os
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import _jit
from ..errors import FileError, SettingsError
from ..optics.look import Look
from ..optics.transfer import TransferFunction
from ..optics.transfer2d import TransferFunction2D
from ..volume.grid import Volume
from .ladder import Ladder
from .processor import processor

if TYPE_CHECKING:
    from ..renderer import Renderer

_log = logging.getLogger("persp_sw")
_PACKAGE = Path(_jit.__file__).parent
# What decides how long a frame takes, and what a quality means.
_SOURCES = (
    *("_jit.py", "compositor.py", "planning.py", "sampling.py", "kernels/*.py", "geometry/*.py"),
    *("optics/classification.py", "optics/classification2d.py", "optics/preintegration.py"),
    *("optics/reflectance.py", "optics/shading.py", "optics/shadows.py", "volume/mip.py", "volume/runs.py"),
)
_SAMPLED = 64  # voxels along each axis that a volume is known by


def default_folder() -> Path:
    """In the user's data folder, XDG_DATA_HOME."""
    home = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(home) / "persp_sw" / "ladders"


def machine_key(threads: int | None) -> str:
    """Processor and threads to composite with; None: all cores."""
    return f"{processor()}, {threads or _jit.max_threads()} threads"


def volume_key(
    volume: Volume, transfer: TransferFunction | TransferFunction2D, look: Look | None = None
) -> str:
    """Size, type, and a hash of a volume, its transfer function and look; some 2 ms, for large volumes, too.

    Hashed are the size, the type, the spacing, about 64³ voxels evenly spread, the function's points or
    shapes and its unit, and of the look what it costs, but not where its lights are or how they shine. Not
    hashed are name, pose and regions: they change from start to start, or from frame to frame.
    """
    transfer = transfer.with_unit(min(volume.spacing))
    spacing = [f"{length:.6g}" for length in volume.spacing]
    drawn = transfer.shapes if isinstance(transfer, TransferFunction2D) else transfer.points
    facts = (
        volume.size,
        volume.data.dtype.name,
        spacing,
        drawn,
        transfer.opacity_unit,
        *_costs(look or Look()),
    )
    digest = hashlib.sha256(repr(facts).encode())
    steps = (slice(None, None, max(1, count // _SAMPLED)) for count in volume.data.shape)
    digest.update(np.ascontiguousarray(volume.data[tuple(steps)]))
    size = "x".join(map(str, volume.size))
    return f"{size} {volume.data.dtype.name} {digest.hexdigest()[:16]}"


def _costs(look: Look) -> tuple[object, ...]:
    """What of a look decides how much work a picture is; nothing of a plain one."""
    if look.is_plain:
        return ()
    casting = [light.shadows for light in look.lighting.lights] if look.lighting else None
    return casting, look.modulation is not None, look.gradient_distance


@cache
def program_key() -> str:
    """Changes with what makes frames faster or slower: compositing's sources, their kind, the compiler."""
    digest = hashlib.sha256()
    for pattern in _SOURCES:
        for path in sorted(_PACKAGE.glob(pattern)):
            digest.update(path.read_bytes())
    kind = "vector" if _jit.VECTORS else "portable"
    return f"{digest.hexdigest()[:16]} {kind}, numba {version('numba')}, llvmlite {version('llvmlite')}"


def ladder_for(renderer: Renderer, folder: Path | None = None) -> Ladder:
    """The ladder measured for a renderer's volume, function and look on this machine, with its threads.

    The built-in ladder where none was measured. So, too, with a line in the log, where the file cannot be
    read or is damaged, or where the program has changed since: nothing here stops a session. Age alone makes
    no ladder stale, for only the ratios of its costs count. It sets whatever a chart varies, in place of the
    user's own choice. Cost: `volume_key`'s; another transfer function or look has another ladder.

    Parameters
    ----------
    folder
        Where ladders are kept; None: `default_folder`.
    """
    machine = machine_key(renderer.settings.threads)
    volume = volume_key(renderer.volume, renderer.transfer, renderer.look)
    try:
        ladder = Ladder.load(folder or default_folder(), machine, volume)
    except (SettingsError, OSError) as error:
        _log.warning("the saved ladder is not used: %s", error)
        return Ladder.default()
    if ladder.volume and ladder.program != program_key():
        _log.warning(
            "the saved ladder of this volume is not used: it was measured with another version; "
            "`persp-sw chart` measures it anew"
        )
        return Ladder.default()
    return ladder


def save_ladder(ladder: Ladder, folder: Path | None = None) -> Path:
    """Keep a ladder where `ladder_for` looks for it; returns the file.

    Raises
    ------
    FileError
        The folder cannot be written to.
    """
    folder = folder or default_folder()
    try:
        return ladder.save(folder)
    except OSError as error:
        raise FileError(f"cannot keep the ladder in {folder}: {error.strerror or error}") from None
