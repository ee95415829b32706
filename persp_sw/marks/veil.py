"""Marks as an eye sees them through the volume: cut into pieces, with the colours they are painted in.

Why colours are enough, without depth: `Probe`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Points
from ..geometry.view import Eye, View
from .shapes import Label, Line, Marks, Sheet

if TYPE_CHECKING:
    from ..probe import Probe

# Of the eye's distance from the wall's plane: what is nearer is not painted.
NEAREST = 0.02
_PIECE = 12.0  # pixels
_PIECES = 64
_CHANGE = 0.02  # of colour or opacity in front: between places that differ by more there is another …
_HALVINGS = 2  # … and so on
_CELLS = 10  # of a sheet's edge
_SEEN_BESIDE = 1.0  # picture sizes beyond its edges, in which lines still are cut into pieces


@dataclass(frozen=True, eq=False)
class VeiledLine:
    """A line's part that a view shows.

    Attributes
    ----------
    points
        (n, 3) world, along it, the first and the last of them what is shown.
    shares
        (n,) of the way from the first to the last, 0 … 1.
    tones
        (n, 3) linear, what it is painted in there; linear between.
    width, opacity
        As of `Line`.
    """

    points: Points
    shares: Points
    tones: Points
    width: float
    opacity: float


@dataclass(frozen=True, eq=False)
class VeiledSheet:
    """A sheet as a grid of triangles: of each cell, those before and behind its diagonal from (0, 0).

    Attributes
    ----------
    sheet
        Whose places they are.
    tones
        (n, n, 3) linear, by v and u, evenly from edge to edge; linear on triangles.
    """

    sheet: Sheet
    tones: Points

    @property
    def places(self) -> Points:
        """(n, n, 3) world, of the tones."""
        return _places(self.sheet, len(self.tones))


@dataclass(frozen=True, eq=False)
class VeiledLabel:
    """A word and what is seen of it: `veil` (4,) is the premultiplied colour before it, and transparency."""

    label: Label
    veil: Points


@dataclass(frozen=True, eq=False)
class Veiled:
    """What `veil` makes, in the order in which it is painted."""

    sheets: Sequence[VeiledSheet] = ()
    lines: Sequence[VeiledLine] = ()
    labels: Sequence[VeiledLabel] = ()


def veil(marks: Marks, view: View, probe: Probe | None) -> Veiled:
    """What marks look like in a view.

    Parameters
    ----------
    view
        Of its eye and wall; marks that lie outside the picture cost little.
    probe
        Of the volume that the picture shows; None: nothing hides them.

    Returns
    -------
    Lines in pieces of 12 pixels, or 3 where what is in front changes; sheets of 10 × 10 cells; words. What is
    not before the eye is left out.

    Cost: one ray a piece, or a corner of a cell.
    """
    sheets = sorted(marks.sheets, key=lambda sheet: _towards(sheet, view.eye))
    labels = [label for label in marks.labels if view.viewport_from_world[2] @ (*label.point, 1.0) > NEAREST]
    cut = [(line, shares) for line in marks.lines if (shares := _pieces(line, view)) is not None]
    places = [_places(sheet, _CELLS + 1).reshape(-1, 3) for sheet in sheets]
    places += [label.point[None] for label in labels]
    before = _in_front(probe, view.eye, places)
    shown_sheets = []
    for sheet, rgba in zip(sheets, before, strict=False):
        tones = rgba[:, :3] + (1 - rgba[:, 3:]) * sheet.colour
        shown_sheets.append(VeiledSheet(sheet, tones.reshape(_CELLS + 1, _CELLS + 1, 3)))
    shown_labels = []
    for label, rgba in zip(labels, before[len(sheets) :], strict=True):
        rgba = rgba[0] if label.veiled else np.zeros(4)
        shown_labels.append(VeiledLabel(label, np.append(rgba[:3], 1 - rgba[3])))
    return Veiled(shown_sheets, _veiled_lines(cut, probe, view.eye), shown_labels)


def _veiled_lines(cut: Sequence[tuple[Line, Points]], probe: Probe | None, eye: Eye) -> list[VeiledLine]:
    """Lines with what is in front of their places, and of others between them where that changes."""
    shares = [places for _, places in cut]
    before = [np.zeros((len(places), 4)) for places in shares]
    new = shares if probe is not None else []
    for halving in range(_HALVINGS + 1):
        asked = [n for n, places in enumerate(new) if len(places) and cut[n][0].veiled]
        if not asked:
            break
        found = _in_front(probe, eye, [_along(cut[n][0], new[n]) for n in asked])
        for n, rgba in zip(asked, found, strict=True):
            if halving:
                at = np.searchsorted(shares[n], new[n])
                shares[n], before[n] = np.insert(shares[n], at, new[n]), np.insert(before[n], at, rgba, 0)
            else:
                before[n] = rgba
        changes = [np.abs(np.diff(rgba, axis=0)).max(1) > _CHANGE for rgba in before]
        new = [
            (places[1:] + places[:-1])[changing] / 2 for places, changing in zip(shares, changes, strict=True)
        ]
    shown = []
    for (line, _), places, rgba in zip(cut, shares, before, strict=True):
        tones = rgba[:, :3] + (1 - rgba[:, 3:]) * line.colour
        along = (places - places[0]) / (places[-1] - places[0])
        shown.append(VeiledLine(_along(line, places), along, tones, line.width, line.opacity))
    return shown


def _along(line: Line, shares: Points) -> Points:
    """(n, 3) world places on a line."""
    return line.start + shares[:, None] * (line.end - line.start)


def _in_front(probe: Probe | None, eye: Eye, places: Sequence[Points]) -> list[Points]:
    """`Probe.in_front` of several arrays at once."""
    if probe is None or not places:
        return [np.zeros((len(points), 4)) for points in places]
    everything = probe.in_front(eye, np.concatenate(places))
    return np.split(everything, np.cumsum([len(points) for points in places])[:-1])


def _pieces(line: Line, view: View) -> Points | None:
    """(n,) shares of its way, of places along what of a line is before the eye, in the picture or near it."""
    matrix = view.viewport_from_world
    ends = np.array([matrix @ (*line.start, 1.0), matrix @ (*line.end, 1.0)])
    (x, y, w), (width, height) = ends.T, view.size
    beside = _SEEN_BESIDE * width, _SEEN_BESIDE * height
    inside = np.array(
        [
            w - NEAREST,
            x + beside[0] * w,
            (width + beside[0]) * w - x,
            y + beside[1] * w,
            (height + beside[1]) * w - y,
        ]
    )
    low, high = 0.0, 1.0
    for here, there in inside:
        if here < 0 and there < 0:
            return None
        if (here < 0) != (there < 0):
            at = here / (here - there)
            low, high = (max(low, at), high) if here < 0 else (low, min(high, at))
    if not high > low:
        return None
    shares = np.array([low, high])[:, None]
    cut = ends[0] + shares * (ends[1] - ends[0])
    pixels = np.linalg.norm(cut[1, :2] / cut[1, 2] - cut[0, :2] / cut[0, 2])
    count = int(np.clip(np.ceil(pixels / _PIECE), 1, _PIECES))
    return np.linspace(low, high, count + 1)


def _places(sheet: Sheet, count: int) -> Points:
    """(count, count, 3) world places evenly on a sheet, by v and u."""
    v, u = np.meshgrid(*2 * [np.linspace(0, 1, count)], indexing="ij")
    return sheet.corner + u[..., None] * sheet.edges[0] + v[..., None] * sheet.edges[1]


def _towards(sheet: Sheet, eye: Eye) -> int:
    """How many of a sheet's edges go towards the eye: of sheets with a common corner, the nearer more."""
    way = eye.position if eye.is_at_infinity else eye.position - sheet.corner
    frame = np.column_stack([*sheet.edges, np.cross(*sheet.edges)])
    return int((np.linalg.solve(frame, way)[:2] > 0).sum())
