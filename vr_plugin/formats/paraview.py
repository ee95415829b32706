"""ParaView's .pvx: the displays of a CAVE or a tiled wall.

Machine elements carry three corners in the room's axes, which are ours, in a unit that nothing states; a
fourth corner follows. Source: vtkDisplayConfiguration of ParaView 5.13 and the wiki page on .pvx files.
"""

from __future__ import annotations

import re

import numpy as np

from ..rig import WindowPlace
from .draft import Draft, DraftWall
from .report import Broken, Report, quoted
from .xml_file import Element

_STEREO = {
    "none": "mono",
    "crystaleyes": "quad",
    "redblue": "anaglyph",
    "anaglyph": "anaglyph",
    "interlaced": "interlaced",
    "left": "left",
    "right": "right",
    "splitviewporthorizontal": "side_by_side",
}
_CORNERS = ("LowerLeft", "LowerRight", "UpperRight", "UpperLeft")
_READ = {"Name", "Environment", "Geometry", "StereoType", "FullScreen", *_CORNERS}
# How windows look and what is drawn over them; nothing of a rig.
_IDLE = {"ShowBorders", "Show2DOverlays", "Coverable"}
_GEOMETRY = re.compile(r"(\d{1,5})x(\d{1,5})(?:([+-]\d{1,6})([+-]\d{1,6}))?")


def is_paraview(document: Element) -> bool:
    """Whether a document's root is pvx."""
    return bool(document.all("pvx"))


def read_paraview(document: Element, report: Report) -> Draft:
    """The displays of a .pvx file."""
    draft = Draft("ParaView", unit=None, default_rest=np.zeros(3))
    process = _process(document.all("pvx")[0], report)
    machines = process.all("Machine")
    for number, machine in enumerate(machines):
        name = machine.get("Name") or f"display {number}"
        with report.part(f"wall {name!r}"):
            draft.walls.append(_wall(machine, name, report))
    if not machines:
        report.problem(process.where, "no Machine element: a .pvx of displays has one for each")
    _name_machines(draft.walls, report)
    _read_eyes(process, draft, report)
    for element in process.children:
        if element.name not in ("Machine", "EyeSeparation", "Stereo"):
            report.note(f"{element.where}: <{element.name}> is not read")
    return draft


def _process(pvx: Element, report: Report) -> Element:
    """The element that holds the Machines: a server's Process, else the last one, else the root."""
    processes = pvx.all("Process")
    if not processes:
        return pvx
    servers = [process for process in processes if process.get("Type") == "server"]
    chosen = servers[0] if servers else processes[-1]
    for child in pvx.children:
        if child is not chosen and (child.name != "Process" or child.children):
            report.note(f"{child.where}: <{child.name}> beside the server's Process is not read")
    return chosen


def _wall(machine: Element, name: str, report: Report) -> DraftWall:
    where = f"{machine.where}: Machine {quoted(name)}"
    corners: dict[str, np.ndarray] = {}
    failed = False
    for key in _CORNERS:
        if text := machine.get(key):
            try:
                corners[key] = np.array(report.numbers(where, key, text, 3))
            except Broken:
                failed = True
    if failed:
        raise Broken
    if len(corners) < 3:
        missing = ", ".join(key for key in _CORNERS[:3] if key not in corners)
        raise report.broken(
            where,
            f"no {missing}: without the corners of the display nobody knows where it stands. "
            "Measure them, or start from one of the project's configs (configs/desktop.toml)",
        )
    wall = DraftWall(name, *_three_corners(corners, where, report), where=where)
    if geometry := machine.get("Geometry"):
        wall.pixels, wall.window = _geometry(where, geometry, report)
    else:
        wall.window = WindowPlace(fullscreen=True)
    if machine.get("FullScreen").lower() in ("1", "true", "yes"):
        wall.window = WindowPlace(fullscreen=True)
    wall.stereo = _stereo(machine, where, report)
    wall.machine = _display(machine)
    for key in machine.attributes:
        if key not in _READ and key not in _IDLE:
            report.note(f"{where}: attribute {key} is not read")
    return wall


def _three_corners(corners: dict[str, np.ndarray], where: str, report: Report) -> tuple[np.ndarray, ...]:
    """Lower left, lower right, upper left of any three; a fourth must agree."""
    lower_left, lower_right, upper_right, upper_left = (corners.get(key) for key in _CORNERS)
    if len(corners) == 4:
        miss = np.linalg.norm(lower_left + upper_right - lower_right - upper_left)
        if miss > 0.01 * np.linalg.norm(upper_right - lower_left):
            raise report.broken(where, f"its four corners make no parallelogram: they miss by {miss:.3g}")
    if lower_left is None:
        lower_left = lower_right + upper_left - upper_right
    if lower_right is None:
        lower_right = lower_left + upper_right - upper_left
    if upper_left is None:
        upper_left = lower_left + upper_right - lower_right
    return lower_left, lower_right, upper_left


def _geometry(where: str, text: str, report: Report) -> tuple[tuple[int, int], WindowPlace]:
    match = _GEOMETRY.fullmatch(text.strip())
    if not match or not all(1 <= int(n) <= 16384 for n in match.groups()[:2]):
        raise report.broken(
            where, f"Geometry is WIDTHxHEIGHT+X+Y in pixels, at most 16384; given {quoted(text)}"
        )
    size = (int(match[1]), int(match[2]))
    position = (int(match[3]), int(match[4])) if match[3] else None
    return size, WindowPlace(position=position, size=size)


def _stereo(machine: Element, where: str, report: Report) -> str:
    given = machine.get("StereoType")
    key = re.sub("[^a-z]", "", given.lower())
    if not key:
        return "mono"
    if key not in _STEREO:
        report.note(f"{where}: stereo type {quoted(given)} is not one of ours; mono")
    return _STEREO.get(key, "mono")


def _name_machines(walls: list[DraftWall], report: Report) -> None:
    """Which host or display shows each wall: DISPLAY says, unless all name one local display.

    ParaView gives the n-th Machine to the n-th process, wherever that runs; the file knows no hosts.
    """
    displays = {wall.machine for wall in walls}
    if len(displays) != 1 or not next(iter(displays)).startswith(":"):
        return
    fill = len(walls) > 1 and any(wall.pixels is None for wall in walls)
    if fill:
        display = next(iter(displays))
        report.note(f"all displays say DISPLAY={display} and fill it: taken as one host each, by their names")
    for wall in walls:
        wall.machine = wall.name if fill else ""


def _display(machine: Element) -> str:
    match = re.search(r"DISPLAY=([\w.:-]+)", machine.get("Environment"))
    return match[1] if match else ""


def _read_eyes(process: Element, draft: Draft, report: Report) -> None:
    for element in process.all("EyeSeparation"):
        with report.part("the eyes' separation"):
            draft.eye_separation = report.number(
                f"{element.where}: EyeSeparation", "Value", element.get("Value")
            )
    for element in process.all("Stereo"):
        key = re.sub("[^a-z]", "", element.get("Type").lower())
        if key in _STEREO:
            for wall in draft.walls:
                wall.stereo = _STEREO[key] if wall.stereo == "mono" else wall.stereo
