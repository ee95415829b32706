"""CalVR's configuration: screens, channels and windows, host by host.

Nothing states the unit; the kernel's own defaults are millimetres. Source: ScreenConfig, ScreenBase,
TrackingManager, TrackerVRPN and XMLReader of CalVR.
"""

from __future__ import annotations

import numpy as np

from .draft import Draft, DraftTracker, DraftWall
from .includes import Includes
from .report import Report, quoted
from .scopes import Settings, hosts_of, sections_for
from .screens import ROOM_FROM_Z_UP, passed_over, screen_corners, stereo_mode, turn, viewport_place
from .xml_file import Element

_MOST_SCREENS = 100
_READ = {
    "PipeConfig", "WindowConfig", "ChannelConfig", "ScreenConfig", "NumScreens", "NumWindows", "NumChannels",
    "NumPipes", "ViewerPosition", "Stereo", "EyeSeparation", "Input", "LOCAL", "GLOBAL",
}  # fmt: skip


def is_calvr(document: Element) -> bool:
    """Whether a document has any of CalVR's own sections."""
    own = {"ScreenConfig", "ChannelConfig", "WindowConfig", "PipeConfig", "LOCAL", "GLOBAL", "INCLUDE"}
    return any(child.name in own for child in document.children)


def read_calvr(document: Element, report: Report) -> Draft:
    """The screens of all hosts of a CalVR configuration."""
    Includes(document, report).append(document)
    draft = Draft("CalVR", unit=None, default_rest=np.zeros(3))
    shown: list[Settings] = []
    for settings in _hosts(document, report):
        with report.part(f"host {settings.host!r}"):
            walls = _walls(settings, report)
            draft.walls += walls
            if walls:
                shown.append(settings)
    if shown:
        with report.part("the viewer"):
            _read_viewer(shown[0], draft)
        with report.part("the tracker"):
            draft.tracker = _head_tracker(shown[0], report)
    rest = passed_over([child.name for child in document.children], _READ)
    if rest:
        report.note(f"not read, being no walls, eyes or head trackers: {rest}")
    return draft


def _hosts(document: Element, report: Report) -> list[Settings]:
    """What each host sees; the document itself counts first, as CalVR has it."""
    shared = [document, *(element for element in document.walk() if element.name == "GLOBAL")]
    local = [element for element in document.walk() if element.name == "LOCAL"]
    hosts: dict[str, set[str]] = {}
    with report.part("hosts"):
        hosts = hosts_of(local, report)
    if not hosts:
        return [Settings(shared, "", report)]
    return [Settings([*shared, *sections_for(local, names)], host, report) for host, names in hosts.items()]


def _walls(settings: Settings, report: Report) -> list[DraftWall]:
    """One wall for each screen of a host, numbered without gaps."""
    walls = []
    for number in range(settings.count("NumScreens", _MOST_SCREENS, _MOST_SCREENS)):
        screen = next(settings.elements(f"ScreenConfig.Screen:{number}"), None)
        if screen is None:
            break
        comment = settings.text(f"ScreenConfig.Screen:{number}", "comment")
        name = f"screen {number}" if comment in ("", "S0") else comment
        with report.part(f"wall {name!r} of host {settings.host!r}"):
            walls.append(_wall(settings, number, name, screen, report))
    return walls


def _wall(settings: Settings, number: int, name: str, screen: Element, report: Report) -> DraftWall:
    where = f"{settings.where(screen)}: screen {number}"
    path = f"ScreenConfig.Screen:{number}"
    width, height = settings.number(path, "width", 600.0), settings.number(path, "height", 400.0)
    if width <= 0 or height <= 0:
        raise report.broken(where, f"width and height are above 0; given {width:g} and {height:g}")
    origin = np.array([settings.number(path, f"origin{axis}") for axis in "XYZ"])
    rotation = turn(*(settings.number(path, angle) for angle in "hpr"))
    corners = screen_corners(origin, width, height, rotation)
    wall = DraftWall(name, *corners, where=where, machine=settings.host)
    channel = f"ChannelConfig.Channel:{settings.whole(path, 'channelIndex', number)}"
    mode = settings.text(channel, "stereoMode", "MONO")
    if mode.upper() == "FIXED_VIEWER":
        place = [settings.number(f"{channel}.ViewerPosition", axis) for axis in "xyz"]
        wall.viewer = ROOM_FROM_Z_UP @ np.array(place)
    else:
        wall.stereo = stereo_mode(mode, where, report)
    _place_window(settings, channel, wall, report)
    return wall


def _place_window(settings: Settings, channel: str, wall: DraftWall, report: Report) -> None:
    """Pixels and place of a wall's window; its host and X screen, where a host has several of these."""
    path = f"WindowConfig.Window:{settings.whole(channel, 'windowIndex')}"
    if not settings.has(channel) or not settings.has(path):
        report.note(f"{wall.where}: its channel or its window is not described")
        return
    size = (settings.whole(path, "width", 600), settings.whole(path, "height", 400))
    left, bottom = settings.number(channel, "left"), settings.number(channel, "bottom")
    right = left + settings.number(channel, "width", 600.0)
    top = bottom + settings.number(channel, "height", 400.0)
    # What CalVR calls a window's bottom goes to osg::GraphicsContext as y, which counts from the top.
    window = (settings.whole(path, "left"), settings.whole(path, "bottom"), *size)
    wall.pixels, wall.window = viewport_place(
        window, (left, bottom, right, top), wall.stereo, wall.where, report
    )
    pipes = {_display(settings, pipe.get("name")) for pipe in settings.elements("PipeConfig.Pipe")}
    if len(pipes) > 1:
        display = _display(settings, settings.text(path, "pipeIndex", "0"))
        wall.machine = f"{settings.host}:{display}"


def _display(settings: Settings, pipe: str) -> str:
    """X server and screen of a pipe: 0.2."""
    path = f"PipeConfig.Pipe:{pipe}"
    return f"{settings.whole(path, 'server')}.{settings.whole(path, 'screen')}"


def _read_viewer(settings: Settings, draft: Draft) -> None:
    if settings.has("ViewerPosition"):
        place = [settings.number("ViewerPosition", axis) for axis in "xyz"]
        draft.rest = ROOM_FROM_Z_UP @ np.array(place)
    if settings.find("Stereo", "separation"):
        draft.eye_separation = settings.number("Stereo", "separation")
    if settings.find("EyeSeparation") and not settings.is_on("EyeSeparation"):
        draft.eye_separation = 0.0


def _head_tracker(settings: Settings, report: Report) -> DraftTracker | None:
    """head = shift of the body · system · tracked pose · turn of the body, in CalVR's axes."""
    system = settings.whole("Input.Head0Address", "system")
    body = settings.whole("Input.Head0Address", "body")
    path = f"Input.TrackingSystem{system}"
    kind = settings.text(path).upper()
    if not kind:
        return None
    server = settings.text(f"{path}.VRPN.Server")
    if kind != "VRPN" or not server:
        report.note(f"tracking system {quoted(kind)} is not read; fill in [tracker]")
        return None
    tracker = DraftTracker("vrpn", server, head=body)
    tracker.room_turn = ROOM_FROM_Z_UP @ _turn(settings, path)
    shift = _offset(settings, path) + _offset(settings, f"{path}.Body{body}")
    tracker.room_offset = ROOM_FROM_Z_UP @ shift
    tracker.head_turn = _turn(settings, f"{path}.Body{body}") @ ROOM_FROM_Z_UP.T
    if settings.has("Input.Hand0.Address") and settings.whole("Input.Hand0.Address", "system") == system:
        tracker.wand = settings.whole("Input.Hand0.Address", "body")
    return tracker


def _turn(settings: Settings, path: str) -> np.ndarray:
    return turn(*(settings.number(f"{path}.Orientation", angle) for angle in "hpr"))


def _offset(settings: Settings, path: str) -> np.ndarray:
    return np.array([settings.number(f"{path}.Offset", axis) for axis in "xyz"])
