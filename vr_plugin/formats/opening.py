"""A rig from any file that describes one."""

from __future__ import annotations

from pathlib import Path

from ..rig import Rig, RigError
from ..rigs.file import load_rig


def open_rig(path: str | Path, unit: str | None = None, *, warn: bool = True) -> Rig:
    """The rig of a rig file (.toml), or of another system's wall file.

    Parameters
    ----------
    unit
        Of the lengths in another system's file, where that does not say: mm, cm, m, in or ft.
    warn
        Whether what is doubtful in a rig file is logged.

    Raises
    ------
    RigError
        As `load_rig` or `formats.read_rig`; a unit for a rig file, whose lengths are metres.
    """
    if Path(path).suffix.lower() == ".toml":
        if unit not in (None, "m"):
            raise RigError(f"{path}: lengths of a rig file are metres; leave the unit {unit!r} out")
        return load_rig(path, warn=warn)
    from .reading import read_rig  # a reader of XML, which a rig file need not wait for

    return read_rig(path, unit)
