"""What there is to know of a rig, as words beside its picture."""

from __future__ import annotations

import textwrap

import numpy as np

from ..rigs.check import WallMeasures, findings
from .drawing import Sheet, text_width
from .scene import INK, LEFT_EYE, PALE, RIGHT_EYE, RoomScene

_ROWS = 9  # walls that are listed
_LINE = 24
_COLUMNS = (20, 158, 274, 394, 488)
WARNING = (190, 60, 0)

Area = tuple[int, int, int, int]


def draw_facts(sheet: Sheet, area: Area, scene: RoomScene) -> None:
    """Write the table of walls and what else there is to say into an area (left, top, right, bottom)."""
    left, top, right, bottom = area
    rig = scene.rig
    y = top
    clustered = len(rig.machines) > 1 or bool(rig.machines[0])
    headings = ("wall", "metres", "pixels", "stereo", "machine" if clustered else "a pixel")
    ends = (*_COLUMNS[1:], right - left + 8)
    for column, heading in zip(_COLUMNS, headings, strict=True):
        sheet.text((left + column, y), heading, 14, PALE)
    y += _LINE
    colours = {name: wall.colour for wall in scene.walls for name in wall.names}
    for wall in rig.walls[:_ROWS]:
        measures = WallMeasures.of(rig, wall)
        chip = np.array([[left, y - 6], [left + 11, y - 6], [left + 11, y + 6], [left, y + 6]])
        sheet.area(chip, colours[wall.name])
        words = (
            wall.name,
            " × ".join(f"{v:.3g}" for v in measures.size),
            " × ".join(map(str, wall.wall.pixels)),
            wall.stereo.replace("_", " "),
            wall.machine if clustered else f"{1e3 * measures.pixel[0]:.3g} mm",
        )
        for column, end, text in zip(_COLUMNS, ends, words, strict=True):
            sheet.text((left + column, y), _fitting(text, end - column - 8), 15, INK)
        y += _LINE
    if len(rig.walls) > _ROWS:
        sheet.text((left + 18, y), f"… and {len(rig.walls) - _ROWS} more", 14, INK)
        y += _LINE
    y += 12
    for name, text, colour in _sentences(scene):
        for number, line in enumerate(textwrap.wrap(text, 60)):
            if y > bottom - 8:
                return
            if number == 0:
                sheet.text((left, y), name, 15, PALE if colour == INK else colour)
            sheet.text((left + 92, y), line, 15, colour)
            y += 21
        y += 6
    if y < bottom - 10:
        sheet.dot((left + 98, y + 2), 4, LEFT_EYE)
        sheet.text((left + 108, y + 2), "left eye", 13, PALE)
        sheet.dot((left + 188, y + 2), 4, RIGHT_EYE)
        sheet.text((left + 198, y + 2), "right eye;  arrows: fronts of walls", 13, PALE)


def _fitting(text: str, width: float) -> str:
    """Text, its middle left out where it is too long: machines differ in their last letters."""
    if text_width(text, 15) <= width:
        return text
    start = end = len(text) // 2
    while start > 1 and text_width(text[:start] + "…" + text[end:], 15) > width:
        start, end = start - (start <= len(text) - end), end + (start > len(text) - end)
    return text[:start] + "…" + text[end:]


def _sentences(scene: RoomScene) -> list[tuple[str, str, tuple[int, int, int]]]:
    rig = scene.rig
    rest = ", ".join(f"{v:.3g}" for v in rig.eyes.rest_pose.position)
    rows = [("eyes", f"{1e3 * rig.eyes.separation:.3g} mm apart; at rest at ({rest})", INK)]
    tracker = rig.tracker
    rows.append(("tracker", tracker.kind + (f", {tracker.address}" if tracker.address else ""), INK))
    if scene.volume is not None:
        edges = [np.linalg.norm(scene.box[n] - scene.box[0]) for n in (1, 2, 4)]
        metres = " × ".join(f"{edge:.3g}" for edge in edges)
        at = ", ".join(f"{v:.3g}" for v in scene.box.mean(0))
        rows.append(("volume", f"{scene.volume.name or 'unnamed'}: {metres} m, its middle at ({at})", INK))
    if scene.path_inside is not None:
        rows.append(
            (
                "head path",
                f"{100 * scene.path_inside:.1f} % of it inside the walls; it begins light and ends dark",
                INK,
            )
        )
    rows += [("doubtful", finding, WARNING) for finding in findings(rig)]
    return rows
