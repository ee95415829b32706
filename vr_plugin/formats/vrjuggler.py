"""VR Juggler 2 and 3 (.jconf): the surface viewports of display windows.

Corners are metres in the room's axes, which are ours, or in a head's for a viewport that is tracked. A
simulator viewport is a camera from outside, not a wall. Source: VR Juggler's configuration guide and the
configurations that it ships.
"""

from __future__ import annotations

import numpy as np

from ..rig import WindowPlace
from .draft import Draft, DraftTracker, DraftWall
from .report import Broken, Report, quoted
from .xml_file import Element

_CORNERS = ("lower_left_corner", "lower_right_corner", "upper_right_corner", "upper_left_corner")
_EYES = {"left eye": "left", "right eye": "right"}
_READ = {
    "display_window", "machine_specific", "cluster_node", "user", "vrpn", "position_proxy", "alias",
    "simulated_positional_device", "display_system",
}  # fmt: skip
_HEAD = "VJHead"


def is_vrjuggler(document: Element) -> bool:
    """Whether a document is a configuration of JCCL."""
    return any(root.all("elements") for root in document.all("configuration"))


def read_vrjuggler(document: Element, report: Report) -> Draft:
    """The surface viewports of all windows, of all nodes of a cluster."""
    draft = Draft("VR Juggler", unit="m", default_rest=np.zeros(3))
    elements = [
        child for root in document.all("configuration") for e in root.all("elements") for child in e.children
    ]
    windows = [(window, machine) for window, machine in _windows(elements) if _is_active(window, report)]
    for window, machine in windows:
        draft.walls += _walls(window, machine, report)
    _count_from_top(draft.walls, report)
    with report.part("the user"):
        _read_user(elements, draft, report)
    with report.part("the tracker"):
        _read_head(elements, draft, report)
    rest = [e.name for e in elements if e.name not in _READ]
    if rest:
        names = ", ".join(dict.fromkeys(rest))
        report.note(f"not read, being no walls, eyes or head trackers: {names}")
    return draft


def _windows(elements: list[Element]) -> list[tuple[Element, str]]:
    """All display windows with the host that shows them; empty: this machine."""
    found = [(element, "") for element in elements if element.name == "display_window"]
    for node in elements:
        if node.name in ("machine_specific", "cluster_node"):
            host = node.value("host_name") or node.get("name")
            inside = [
                window for group in node.all("display_windows") for window in group.all("display_window")
            ]
            found += [(window, host) for window in inside]
    return found


def _is_active(element: Element, report: Report) -> bool:
    if element.value("active", "true").lower() in ("true", "1"):
        return True
    report.note(f"{element.where}: {element.name} {quoted(element.get('name'))} is not active and left out")
    return False


def _walls(window: Element, machine: str, report: Report) -> list[DraftWall]:
    name = window.get("name") or "window"
    simulators = [v for group in window.all("simulator_viewports") for v in group.all("simulator_viewport")]
    if simulators:
        report.note(
            f"{window.where}: window {quoted(name)}: its simulator viewports are no walls and left out"
        )
    viewports = [v for group in window.all("surface_viewports") for v in group.all("surface_viewport")]
    walls = []
    for viewport in viewports:
        if not _is_active(viewport, report):
            continue
        own = name if len(viewports) == 1 else f"{name}: {viewport.get('name')}"
        with report.part(f"wall {own!r}"):
            walls.append(_wall(window, viewport, own, machine, report))
    return walls


def _wall(window: Element, viewport: Element, name: str, machine: str, report: Report) -> DraftWall:
    where = f"{viewport.where}: {quoted(name)}"
    corners, failed = [], False
    for key in _CORNERS:
        try:
            corners.append(np.array(report.numbers(where, key, viewport.texts(key), 3)))
        except Broken:
            failed = True
    if failed:
        raise Broken
    lower_left, lower_right, upper_right, upper_left = corners
    miss = np.linalg.norm(lower_left + upper_right - lower_right - upper_left)
    if miss > 0.01 * np.linalg.norm(upper_right - lower_left):
        raise report.broken(where, f"its four corners make no parallelogram: they miss by {miss:.3g} m")
    wall = DraftWall(name, lower_left, lower_right, upper_left, where, machine=machine)
    wall.stereo = _stereo(window, viewport, where, report)
    _place(window, viewport, wall, report)
    if viewport.value("tracked").lower() in ("true", "1"):
        wall.fixed_to = "head"
    return wall


def _stereo(window: Element, viewport: Element, where: str, report: Report) -> str:
    view = viewport.value("view").lower()
    if view in _EYES:
        return _EYES[view]
    if view == "stereo":
        if window.value("stereo").lower() not in ("true", "1"):
            report.note(f"{where}: it shows both eyes, but its window has no stereo; quad taken")
        return "quad"
    report.note(f"{where}: view {quoted(viewport.value('view'))} is not one of ours; mono")
    return "mono"


def _place(window: Element, viewport: Element, wall: DraftWall, report: Report) -> None:
    """Pixels, and the window's place: counted from below until `_count_from_top`."""
    if not window.texts("size"):
        return
    width, height = report.numbers(wall.where, "size", window.texts("size"), 2)
    x, y = report.numbers(wall.where, "origin", window.texts("origin") or ["0", "0"], 2)
    share = report.numbers(wall.where, "viewport's size", viewport.texts("size") or ["1", "1"], 2)
    start = report.numbers(wall.where, "viewport's origin", viewport.texts("origin") or ["0", "0"], 2)
    size = (round(width * share[0]), round(height * share[1]))
    if not all(1 <= n <= 16384 for n in size):
        raise report.broken(wall.where, f"a viewport has 1 … 16384 pixels a side; given {size}")
    wall.pixels = size
    position = (round(x + width * start[0]), round(y + height * start[1]))
    full = window.value("full_screen").lower() in ("true", "1")
    wall.window = WindowPlace(fullscreen=True) if full else WindowPlace(position=position, size=size)


def _count_from_top(walls: list[DraftWall], report: Report) -> None:
    """Windows are placed from a screen's lower left corner, and its height is not stated."""
    placed = [wall for wall in walls if wall.window.position]
    tops = {
        machine: max(w.window.position[1] + w.window.size[1] for w in placed if w.machine == machine)
        for machine in {wall.machine for wall in placed}
    }
    for wall in placed:
        (x, y), size = wall.window.position, wall.window.size
        wall.window = WindowPlace(position=(x, tops[wall.machine] - y - size[1]), size=size)
    if placed and any(wall.window.position != (0, 0) for wall in placed):
        report.note("windows were counted from a screen's lower edge; ours hang from the top of the highest")


def _read_user(elements: list[Element], draft: Draft, report: Report) -> None:
    users = [element for element in elements if element.name == "user"]
    if len(users) > 1:
        report.note(f"{len(users)} users; a rig has one: {quoted(users[0].get('name'))}")
    for user in users[:1]:
        if text := user.value("interocular_distance"):
            draft.eye_separation = report.number(user.where, "interocular_distance", text)


def _read_head(elements: list[Element], draft: Draft, report: Report) -> None:
    """What VJHead leads to: alias, proxy, device."""
    named = {(element.name, element.get("name")): element for element in elements}
    user = next((element for element in elements if element.name == "user"), None)
    start = (user.value("head_position") if user else "") or _HEAD
    alias = named.get(("alias", start))
    proxy = named.get(("position_proxy", alias.value("proxy") if alias else start))
    if proxy is None or not proxy.value("device"):
        return
    device = proxy.value("device")
    if simulated := named.get(("simulated_positional_device", device)):
        place = simulated.texts("initial_position")
        if place:
            draft.rest = np.array(report.numbers(simulated.where, "initial_position", place, 3))
        return
    vrpn = named.get(("vrpn", device))
    if vrpn is None or not vrpn.value("tracker_server"):
        report.note(f"{proxy.where}: tracker {quoted(device)} is not read; fill in [tracker]")
        return
    head = report.whole(proxy.where, "unit", proxy.value("unit", "0"))
    draft.tracker = DraftTracker("vrpn", vrpn.value("tracker_server"), head=max(head, 0))
    if any(_is_turned(element) for element in (vrpn, proxy)):
        report.note(f"{vrpn.where}: its position filters are not read; fill in room_from_tracker")


def _is_turned(element: Element) -> bool:
    """Whether a position filter does anything."""
    for child in element.walk():
        plain = {"custom_scale": "1", "device_units": "1"}.get(child.name)
        if child.name.startswith(("pre_", "post_")):
            plain = "0"
        if plain and child.text.rstrip("0").rstrip(".").lstrip("-") not in (plain, plain.strip("0")):
            return True
    return False
