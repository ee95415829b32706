"""What of a rig one machine can show."""

from __future__ import annotations

import platform
from dataclasses import replace

from ..rig import Rig, RigError
from .check import clashing_windows
from .problems import nearest_of

ALL = "all"


def rig_on_machine(rig: Rig, machine: str | None = None, *, offscreen: bool = False) -> Rig:
    """The rig of those walls that this machine is to show.

    Parameters
    ----------
    machine
        Whose walls; "all" shows those of every machine here. None: of a rig of several machines those of this
        machine, by its host name; of a rig of one, or none, all.
    offscreen
        Pictures are only written: without a `machine` all walls, whatever their windows.

    Raises
    ------
    RigError
        Several machines show the rig and this is none of them, `machine` is none of them, or two walls fill
        the same monitor.
    """
    if machine is None and not offscreen and len(rig.machines) > 1:
        machine = next((name for name in rig.machines if _host(name) == _host(platform.node())), None)
        if machine is None:
            raise RigError(_several(rig))
    if machine not in (None, ALL):
        if machine not in rig.machines:
            raise RigError(f"no wall is shown by machine {machine!r}; {nearest_of(machine, rig.machines)}")
        rig = replace(rig, walls=[wall for wall in rig.walls if wall.machine == machine])
    clashes = [] if offscreen else clashing_windows(rig)
    if clashes:
        raise RigError("; ".join(clashes))
    return rig


def _several(rig: Rig) -> str:
    own = {name: [wall.name for wall in rig.walls if wall.machine == name] for name in rig.machines}
    listed = "; ".join(f"{name or 'not named'} ({', '.join(walls)})" for name, walls in own.items())
    first = next(name for name in own if name)
    return (
        f"this rig is shown by {len(own)} machines, {listed}; this one, {platform.node()}, is none of them. "
        f"Start it on each with --machine {first}, …; or show all walls here with --machine {ALL}"
    )


def _host(name: str) -> str:
    """A host's name without its domain; that of an X display on it, too ("node1:0.1")."""
    return name.partition(":")[0].partition(".")[0].lower()
