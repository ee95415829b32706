"""COVISE's configuration (COCONFIG): the screens of OpenCOVER, host by host.

Lengths are millimetres. A channel draws a screen into a viewport of a window. Source: coVRConfig,
coCoverConfig, VRViewer and person.cpp of OpenCOVER.
"""

from __future__ import annotations

from math import radians, tan

import numpy as np

from .draft import Draft, DraftWall
from .includes import Includes
from .opencover_tracking import head_tracker
from .report import Report
from .scopes import Settings, hosts_of, sections_for
from .screens import ROOM_FROM_Z_UP, passed_over, screen_corners, stereo_mode, turn, viewport_place
from .xml_file import Element

# OpenCOVER's section; VIVE, its successor, renamed it.
_TOP = "COVER|VIVE"
_SECTIONS = ("GLOBAL", "CLUSTER", "LOCAL")
_READ = {
    "ScreenConfig", "ChannelConfig", "ViewportConfig", "WindowConfig", "PipeConfig", "NumScreens",
    "NumChannels", "NumWindows", "NumViewports", "NumPipes",
    "Stereo", "StereoMode", "MonoView", "ViewerPosition", "Input",
}  # fmt: skip
_MOST_SCREENS = 50
# OpenCOVER's own place of the eyes, in its axes and unit.
_DEFAULT_VIEWER = np.array([0.0, -2000.0, 30.0])


def is_opencover(document: Element) -> bool:
    """Whether a document has COVISE's root, or OpenCOVER's section somewhere."""
    return bool(document.all("COCONFIG")) or any(e.name in _TOP.split("|") for e in document.walk())


def read_opencover(document: Element, report: Report) -> Draft:
    """The screens of all hosts of a COVISE configuration."""
    Includes(document, report).splice(document)
    draft = Draft("OpenCOVER", unit="mm", default_rest=ROOM_FROM_Z_UP @ _DEFAULT_VIEWER)
    sections = _sections(document)
    views = _hosts(document, sections, report)
    shown: list[Settings] = []
    for settings in views:
        with report.part(f"host {settings.host!r}"):
            walls = _walls(settings, report)
            draft.walls += walls
            if walls:
                shown.append(settings)
    _read_viewer(shown, draft, report)
    if shown:
        with report.part("the tracker"):
            draft.tracker = head_tracker(shown[0], report)
    _say_the_rest(sections, report)
    return draft


def _sections(document: Element) -> list[Element]:
    """GLOBAL, CLUSTER and LOCAL, wherever they are; a file without any is one GLOBAL."""
    found = [element for element in document.walk() if element.name in _SECTIONS]
    return found or document.all("COCONFIG") or [document]


def _hosts(document: Element, sections: list[Element], report: Report) -> list[Settings]:
    """What each host sees."""
    local = [section for section in sections if section.name == "LOCAL"]
    clusters = [section for section in sections if section.name == "CLUSTER"]
    masters = list(dict.fromkeys(section.get("master").strip().lower() for section in clusters))
    if len(masters) > 1:
        report.note(f"{document.path.name}: clusters of {', '.join(masters)}; that of {masters[0]} is read")
        clusters = sections_for(clusters, {masters[0]}, "master")
    shared = [*clusters, *(section for section in sections if section.name not in ("LOCAL", "CLUSTER"))]
    hosts: dict[str, set[str]] = {}
    with report.part("hosts"):
        hosts = hosts_of(local, report)
    if not hosts:
        return [Settings(shared, "", report)]
    return [Settings([*sections_for(local, names), *shared], host, report) for host, names in hosts.items()]


def _walls(settings: Settings, report: Report) -> list[DraftWall]:
    """One wall for each channel of a host that has a screen of its own."""
    screens = settings.count(f"{_TOP}.NumScreens", 1, _MOST_SCREENS)
    channels = settings.count(f"{_TOP}.NumChannels", screens, _MOST_SCREENS)
    walls = []
    for channel in range(channels):
        path = f"{_TOP}.ChannelConfig.Channel:{channel}"
        number = settings.whole(path, "screenIndex", channel)
        screen = next(settings.elements(f"{_TOP}.ScreenConfig.Screen:{number}"), None)
        if screen is None:
            continue
        name = settings.text(f"{_TOP}.ScreenConfig.Screen:{number}", "comment") or f"screen {number}"
        if not settings.is_on(f"{_TOP}.ScreenConfig.Screen:{number}", "render", True):
            report.note(f"{settings.where(screen)}: screen {name!r} is switched off (render) and left out")
            continue
        with report.part(f"wall {name!r} of host {settings.host!r}"):
            walls.append(_wall(settings, channel, number, name, screen, screens, report))
    return walls


def _wall(
    settings: Settings, channel: int, number: int, name: str, screen: Element, screens: int, report: Report
) -> DraftWall:
    where = f"{settings.where(screen)}: screen {name!r}"
    corners = _corners(settings, f"{_TOP}.ScreenConfig.Screen:{number}", where, report)
    wall = DraftWall(name, *corners, where=where, machine=settings.host)
    wall.stereo = _stereo(settings, channel, screens, where, report)
    place = _viewport(settings, channel, where, report)
    if place:
        wall.pixels, wall.window = viewport_place(*place, wall.stereo, where, report)
    return wall


def _corners(settings: Settings, path: str, where: str, report: Report) -> tuple[np.ndarray, ...]:
    frustum = settings.text(path, "frustum")
    if frustum:
        return _frustum_corners(frustum, settings.number(path, "radius", 2800.0), where, report)
    width, height = settings.number(path, "width", 2000.0), settings.number(path, "height", 1500.0)
    origin = np.array([settings.number(path, f"origin{axis}") for axis in "XYZ"])
    if width <= 0 or height <= 0:
        raise report.broken(where, f"width and height are above 0; given {width:g} and {height:g}")
    return screen_corners(origin, width, height, turn(*(settings.number(path, angle) for angle in "hpr")))


def _frustum_corners(text: str, radius: float, where: str, report: Report) -> tuple[np.ndarray, ...]:
    """A screen by a projector's place, direction and opening angles at a distance (as OpenCOVER reads it)."""
    x, y, z, h, p, r, left, right, bottom, top = report.numbers(where, "frustum", text.split(";"), 10)
    if max(map(abs, (left, right, bottom, top))) > 89 or radius <= 0:
        raise report.broken(where, "frustum: angles are within ±89 degrees and the radius is above 0")
    to_left, to_right = tan(radians(-left)) * radius, tan(radians(right)) * radius
    down, up = tan(radians(-bottom)) * radius, tan(radians(top)) * radius
    width, height = to_left + to_right, up + down
    if width <= 0 or height <= 0:
        raise report.broken(where, "frustum: left and bottom are below right and top")
    rotation = turn(h, p, r)
    middle = np.array([to_right - width / 2, radius, up - height / 2])
    return screen_corners(np.array([x, y, z]) + rotation @ middle, width, height, rotation)


def _stereo(settings: Settings, channel: int, screens: int, where: str, report: Report) -> str:
    """How a channel shows two eyes: its own mode, else the passive pair, the window's, the host's."""
    own = settings.text(f"{_TOP}.ChannelConfig.Channel:{channel}", "stereoMode")
    if not settings.is_on(f"{_TOP}.Stereo", default=True):
        return "mono"
    if own:
        return stereo_mode(own, where, report)
    names = [settings.text(f"{_TOP}.ScreenConfig.Screen:{i}", "comment") for i in (0, 1)]
    if screens > 1 and names[0] == names[1]:
        return ("left", "right")[channel % 2]
    if one_eye := settings.text(f"{_TOP}.MonoView"):
        return stereo_mode(one_eye, where, report)
    window = settings.whole(f"{_TOP}.ChannelConfig.Channel:{channel}", "windowIndex", channel)
    if settings.is_on(f"{_TOP}.WindowConfig.Window:{window}", "stereo"):
        return "quad"
    mode = settings.text(f"{_TOP}.StereoMode")
    if not mode and settings.is_on(f"{_TOP}.Stereo"):
        report.note(f"{where}: stereo is on, but no mode is named; mono")
    return stereo_mode(mode, where, report)


def _viewport(
    settings: Settings, channel: int, where: str, report: Report
) -> tuple[tuple[int, int, int, int], tuple[float, float, float, float]] | None:
    """The window of a channel and the box in it, pixels; None where no window is described."""
    path = f"{_TOP}.ChannelConfig.Channel:{channel}"
    viewport = settings.whole(path, "viewportIndex", channel)
    own = f"{_TOP}.ViewportConfig.Viewport:{viewport}"
    box = own if settings.find(own, "windowIndex") else path
    number = settings.whole(box, "windowIndex", channel)
    window = f"{_TOP}.WindowConfig.Window:{number}"
    if not settings.has(window):
        return None
    if settings.number(window, "bottom") and not settings.find(window, "top"):
        report.note(f"{where}: its window's bottom is ignored, as OpenCOVER does, which counts from the top")
    size = (settings.whole(window, "width", 1024), settings.whole(window, "height", 768))
    left, bottom = (
        _in_pixels(settings.number(box, side), side_size)
        for side, side_size in zip(("left", "bottom"), size, strict=True)
    )
    ends = []
    names = (("right", "width", left), ("top", "height", bottom))
    for (end, length, start), side_size in zip(names, size, strict=True):
        edge = settings.number(box, end, -1.0)
        if edge < 0:
            edge = start + _in_pixels(settings.number(box, length, 1.0), side_size)
            ends.append(edge)
        else:
            ends.append(_in_pixels(edge, side_size))
    place = (settings.whole(window, "left"), settings.whole(window, "top"), *size)
    return place, (left, bottom, *ends)


def _in_pixels(value: float, size: int) -> float:
    """Up to 1 a share of the window, beyond it pixels."""
    return value if value > 1 else value * size


def _read_viewer(shown: list[Settings], draft: Draft, report: Report) -> None:
    """Where the eyes are at rest and how far apart; hosts that differ are said."""
    path = f"{_TOP}.ViewerPosition"
    places, distances = {}, {}
    for settings in shown:
        with report.part("the viewer's place"):
            if settings.has(path):
                places[settings.host] = tuple(settings.number(path, axis) for axis in "xyz")
            distance = _eye_distance(settings, report)
            if distance is not None and settings.is_on(f"{_TOP}.Stereo", default=True):
                distances[settings.host] = distance
    for what, values in (("the viewer", places), ("the distance of the eyes", distances)):
        if len(set(values.values())) > 1:
            host = next(iter(values))
            report.note(f"{what} differs from host to host; that of {host or 'all'} is taken")
    if places:
        draft.rest = ROOM_FROM_Z_UP @ np.array(next(iter(places.values())))
    if distances:
        draft.eye_separation = next(iter(distances.values()))


def _eye_distance(settings: Settings, report: Report) -> float | None:
    """The default person's, else the host's; None: not stated."""
    for person in settings.elements(f"{_TOP}.Input.Persons.Person"):
        if person.get("default").lower() == "true" and person.get("eyeDistance"):
            return report.number(settings.where(person), "eyeDistance", person.get("eyeDistance"))
    text = settings.text(f"{_TOP}.Stereo", "separation")
    if text.upper().startswith("AUTO"):
        report.note("the eyes' separation is AUTO, which is not read")
        return None
    return settings.number(f"{_TOP}.Stereo", "separation") if text else None


def _say_the_rest(sections: list[Element], report: Report) -> None:
    outside = [child.name for section in sections for child in section.children]
    inside = [
        f"COVER.{child.name}"
        for section in sections
        for top in section.all(*_TOP.split("|"))
        for child in top.children
        if child.name not in _READ
    ]
    rest = passed_over([*outside, *inside], {*_TOP.split("|"), *_SECTIONS, "COCONFIG"})
    if rest:
        report.note(f"not read, being no walls, eyes or head trackers: {rest}")
