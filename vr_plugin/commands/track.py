"""`persp-sw track`: live poses of a tracker, and a VRPN server to try a rig without one."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import click
import numpy as np
from rich.box import SIMPLE
from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from persp_sw.commands.output import console, plain

from ..pose import Pose, rotation_of
from ..trackers import MouseTracker, PathTracker, Recording, Sample, Tracker, TrackerError
from ..trackers.addresses import LOOPBACK, host_and_port, place_of
from ..trackers.dtrack_samples import FLYSTICK
from ..trackers.opening import open_tracker
from ..trackers.statistics import Statistics
from ..trackers.terminal import TerminalEvents, terminal_input
from ..trackers.vrpn_server import VrpnServer
from ..trackers.vrpn_wire import PORT

_PAUSE_S = 0.002
_MOUSE_HZ = 60.0

_EPILOG = """\b
Examples:
  persp-sw track Tracker0@cave-host            a VRPN server's poses, buttons and axes
  persp-sw track dtrack:0.0.0.0:5000           DTrack packets from other machines
  persp-sw track walk.csv.gz                   a recorded path, at its own speed
  persp-sw track Tracker0@localhost --json --seconds 5 | jq .position
  persp-sw track --serve walk.csv.gz           a VRPN server: Tracker0@127.0.0.1:3883
  persp-sw track --serve mouse --wand 1        the same, moved by this terminal's keys and mouse
  persp-sw track --serve walk.csv.gz --listen 0.0.0.0:3883

\b
Poses are in the tracker's own axes and metres; a rig's room_from_tracker is not applied.
`late` is the time from stamp to arrival; of another machine's stamps, what exceeds the
fastest message. --serve mouse: drag to look about, right button to shift, wheel and W A S D
Q E to walk, R to go back; with Ctrl the mouse moves the wand and presses its buttons.
"""


@click.command(epilog=_EPILOG)
@click.argument("address", required=False)
@click.option(
    "--seconds", type=click.FloatRange(min=0, min_open=True), help="Stop after this time; else at Ctrl-C."
)
@click.option("--json", "as_json", is_flag=True, help="A JSON object for each sample, a line each.")
@click.option("--hold", is_flag=True, help="A recorded path stays at its end; otherwise it starts again.")
@click.option("--serve", metavar="RECORDING|mouse", help="Be a VRPN server of a recorded path or the mouse.")
@click.option(
    "--listen",
    metavar="[HOST][:PORT]",
    default=f"{LOOPBACK}:{PORT}",
    show_default=True,
    help="Where the server listens; other machines reach it only if an address is given.",
)
@click.option("--name", default="Tracker0", show_default=True, help="The server's device.")
@click.option("--wand", type=click.IntRange(0, 255), help="--serve mouse: a wand, as this sensor.")
def track(
    address: str | None,
    seconds: float | None,
    as_json: bool,
    hold: bool,
    serve: str | None,
    listen: str,
    name: str,
    wand: int | None,
) -> None:
    """Print what a tracker at ADDRESS tells, live; or be one.

    ADDRESS is Tracker0@host[:3883] (VRPN), dtrack[:address]:5000 (DTrack), or a recorded path (.csv,
    .csv.gz).
    """
    if (address is None) == (serve is None):
        raise click.UsageError("give either ADDRESS or --serve RECORDING|mouse")
    end = "hold" if hold else "loop"
    with contextlib.suppress(KeyboardInterrupt):  # the usual way to stop it
        if serve is not None:
            _serve(serve, end, listen, name, wand, seconds, as_json)
        else:
            _watch(open_tracker(place_of(address), end=end), seconds, as_json)


def _watch(tracker: Tracker, seconds: float | None, as_json: bool) -> None:
    statistics = Statistics()

    def step(now: float) -> None:
        samples = tracker.poll(now)
        statistics.add(samples, now)
        if as_json:
            for sample in samples:
                click.echo(json.dumps(plain(line_of(sample)), allow_nan=False))

    with contextlib.closing(tracker), _shown(as_json, lambda: _report(tracker.status, statistics)):
        _run(step, seconds)
        if not statistics.samples:
            raise TrackerError(f"nothing was heard within {seconds:g} s: {tracker.status}")


def _serve(
    what: str, end: str, listen: str, name: str, wand: int | None, seconds: float | None, as_json: bool
) -> None:
    mouse = MouseTracker(wand=wand) if what == "mouse" else None
    source: Tracker = mouse or PathTracker(Recording.load(what), end)
    host, port = host_and_port(listen, LOOPBACK, PORT, "--listen")
    statistics = Statistics()
    with contextlib.closing(VrpnServer(name, host, port)) as server, terminal_input() as typed:
        where = f"{server.name}@{server.address}:{server.port}"
        events = TerminalEvents(mouse) if mouse else None
        next_at = -np.inf

        def step(now: float) -> None:
            nonlocal next_at
            if events:
                events.feed(typed(), now)
            samples = []
            if now >= next_at:
                samples = source.poll(now)
                next_at = now + (1 / _MOUSE_HZ if mouse else 0.0)
            statistics.add(samples, now)
            server.send(samples, now)

        if as_json:
            click.echo(json.dumps({"serving": what, "address": where}))
        else:
            click.echo(f"serving {what} as {where}; Ctrl-C stops it")

        def report() -> Group:
            return _report(f"{source.status}; {server.clients} clients of {where}", statistics)

        with _shown(as_json, report):
            _run(step, seconds)


def _run(step: Callable[[float], None], seconds: float | None) -> None:
    """Call `step` with the time, again and again, with pauses that let others work."""
    start = time.monotonic()
    while seconds is None or time.monotonic() - start < seconds:
        step(time.monotonic())
        time.sleep(_PAUSE_S)


@contextlib.contextmanager
def _shown(as_json: bool, report: Callable[[], Group]) -> Iterator[None]:
    """A table that is drawn anew ten times a second; where stdout is no terminal, once at the end."""
    screen = console()
    if as_json:
        yield
    elif screen.is_terminal:
        with Live(get_renderable=report, console=screen, refresh_per_second=10):
            yield
    else:
        try:
            yield
        finally:
            screen.print(report())


def line_of(sample: Sample) -> dict[str, Any]:
    """A sample for programs: metres, quaternion x, y, z, w; stamp in seconds of this machine's clock."""
    line: dict[str, Any] = {"stamp": sample.stamp, "sensor": sample.sensor, "kind": sample.kind}
    if sample.pose is not None:
        line |= {"position": sample.pose.position, "orientation": sample.pose.orientation}
    if sample.kind in ("buttons", "axes"):
        line[sample.kind] = getattr(sample, sample.kind)
    return line


def _report(status: str, statistics: Statistics) -> Group:
    now = time.monotonic()
    table = Table(box=SIMPLE, padding=(0, 1), pad_edge=False)
    table.add_column("sensor", no_wrap=True)
    table.add_column("kind", no_wrap=True)
    for heading in ("x, y, z (m)", "yaw, pitch, roll (°)", "Hz", "late ms"):
        table.add_column(heading, justify="right", no_wrap=True)
    for (sensor, kind), one in sorted(statistics.sensors.items()):
        late = one.latency_s(now)
        place, turn = _cells(one.last)
        number = f"flystick {sensor - FLYSTICK}" if sensor >= FLYSTICK else str(sensor)
        table.add_row(
            number,
            kind,
            place,
            turn,
            Text("silent", style="yellow") if late is None else f"{one.rate_hz(now):.1f}",
            "" if late is None else f"{1000 * late:.1f}",
        )
    return Group(Text(status, style="cyan"), *([table] if statistics.sensors else []))


def _cells(sample: Sample) -> tuple[str | Text, str]:
    """What a sample says, in the table's two columns."""
    if sample.kind == "lost":
        return Text("not seen", style="yellow"), ""
    if sample.kind == "buttons":
        return " ".join("●" if pressed else "○" for pressed in sample.buttons[:16]), ""
    if sample.kind == "axes":
        return " ".join(f"{axis:+.2f}" for axis in sample.axes[:8]), ""
    place = " ".join(f"{coordinate:+.3f}" for coordinate in sample.pose.position)
    return place, " ".join(f"{angle:+6.1f}" for angle in yaw_pitch_roll(sample.pose))


def yaw_pitch_roll(pose: Pose) -> tuple[float, float, float]:
    """Degrees: left is above 0, then up, then tilted to the left, for a sensor that looks along −z, y up."""
    r = rotation_of(pose.orientation)
    yaw, roll = np.arctan2(r[0, 2], r[2, 2]), np.arctan2(r[1, 0], r[1, 1])
    pitch = np.arcsin(np.clip(-r[1, 2], -1.0, 1.0))
    return tuple(float(angle) for angle in np.rad2deg((yaw, pitch, roll)))
