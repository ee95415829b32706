"""Which format a file has, and its rig."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..rig import Rig, RigError
from .assemble import assemble
from .calvr import is_calvr, read_calvr
from .draft import Draft
from .opencover import is_opencover, read_opencover
from .paraview import is_paraview, read_paraview
from .report import Report
from .units import METRES
from .vrjuggler import is_vrjuggler, read_vrjuggler
from .xml_file import Element, parse, read_text

# By content, the most telling first: CalVR's files have no root of their own.
_READERS: tuple[tuple[Callable[[Element], bool], Callable[[Element, Report], Draft]], ...] = (
    (is_paraview, read_paraview),
    (is_vrjuggler, read_vrjuggler),
    (is_opencover, read_opencover),
    (is_calvr, read_calvr),
)
_FORMATS = "ParaView .pvx, COVISE/OpenCOVER and CalVR .xml, and VR Juggler 2 or 3 .jconf"


@dataclass(frozen=True)
class Reading:
    """A foreign file, read.

    Attributes
    ----------
    rig
        In metres and our axes.
    system
        Whose file it is: ParaView, OpenCOVER, CalVR or VR Juggler.
    notes
        What was left out, assumed or looks odd, each a sentence.
    """

    rig: Rig
    system: str
    notes: tuple[str, ...]


def import_rig(
    path: str | Path,
    unit: str | None = None,
    *,
    hosts: Sequence[str] = (),
    skip_broken: bool = False,
    pixels: tuple[int, int] | None = None,
) -> Reading:
    """Read the walls of another system's file; the content decides which.

    Parameters
    ----------
    unit
        mm, cm, m, in or ft: in what the file counts. COVISE (mm) and VR Juggler (m) need none.
    hosts
        Only the walls that these machines show.
    skip_broken
        Leave out walls and values that cannot be read, with a note, instead of refusing the file.
    pixels
        Width and height of walls whose file states none.

    Raises
    ------
    RigError
        Not a file of these formats, no walls, no unit; everything broken in it at once, with its place.
    """
    path = Path(path)
    report = Report(skip_broken)
    text = read_text(path)
    if not text.lstrip().startswith("<"):
        raise RigError(_no_xml(path, text))
    document = parse(text, path)
    for fits, read in _READERS:
        if fits(document):
            draft = read(document, report)
            break
    else:
        roots = ", ".join(dict.fromkeys(child.tag[:40] for child in document.children[:5])) or "none"
        raise RigError(f"{path}: XML, but of no system whose walls are read ({_FORMATS}); its roots: {roots}")
    rig = assemble(draft, report, file=path.name, unit=unit, hosts=tuple(hosts), pixels=pixels)
    return Reading(rig, draft.system, report.notes)


def read_rig(
    path: str | Path,
    unit: str | None = None,
    *,
    hosts: Sequence[str] = (),
    skip_broken: bool = False,
    pixels: tuple[int, int] | None = None,
) -> Rig:
    """As `import_rig`; the notes are logged as warnings."""
    reading = import_rig(path, unit, hosts=hosts, skip_broken=skip_broken, pixels=pixels)
    for note in reading.notes:
        logging.getLogger("persp_sw").warning("%s: %s", Path(path).name, note)
    return reading.rig


def _no_xml(path: Path, text: str) -> str:
    """Why a file that is no XML is not read, and what to do."""
    if path.suffix.lower() == ".toml":
        return f"{path}: a .toml is our own format already; give it to the command as it is"
    advice = f"Formats read: {_FORMATS}. Write its walls as a rig file instead: see configs/cave4.toml"
    if "config:" in text or path.suffix.lower() == ".cfg":
        return f"{path}: omegalib's and Vrui's .cfg files are not read. {advice}"
    return f"{path}: no XML. {advice}"


UNITS = tuple(METRES)
