"""Text over the preview's pictures: the figures of a frame, and what the keys do."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from statistics import median
from typing import TYPE_CHECKING, Any

from ..stereo import MODES
from .keys import BINDINGS

if TYPE_CHECKING:
    from .wanted import Wanted


class Rate:
    """Frames a second: of the median of the last frames' times, so that one slow frame does not jump.

    Parameters
    ----------
    count
        How many frames.
    """

    def __init__(self, count: int = 15):
        self._seconds: deque[float] = deque(maxlen=count)

    def add(self, seconds: float) -> None:
        """A frame has taken so long."""
        self._seconds.append(seconds)

    @property
    def count(self) -> int:
        """Frames that it knows of."""
        return len(self._seconds)

    def clear(self) -> None:
        """Forget: what comes takes another time."""
        self._seconds.clear()

    @property
    def ms(self) -> float:
        """Of a frame; NaN before the first."""
        return 1e3 * median(self._seconds) if self._seconds else float("nan")

    @property
    def hz(self) -> float:
        """Frames a second; NaN before the first."""
        return 1e3 / max(self.ms, 1e-6) if self._seconds else float("nan")


def figures(wanted: Wanted, statistics: Mapping[str, Any], rate: Rate) -> str:
    """What the overlay says of a frame, line by line.

    Parameters
    ----------
    statistics
        Of all eye images together: composite_ms, warp_ms, warp (who did it), samples, faces,
        intermediate_size, compositings, samples_per_interval, preintegrated; and what `quality_line` needs.
    """
    s = statistics
    faces, images, (width, height) = s["faces"], s["compositings"], s["intermediate_size"]
    sampling = f"{s['samples_per_interval']} sample{'s' * (s['samples_per_interval'] > 1)} an interval"
    stereo = MODES[wanted.stereo.shown_mode] + ", eyes swapped" * wanted.stereo.swapped
    if len(set(wanted.stereo.channels)) == 2 and not wanted.outside:
        stereo += f", separation 1/{1 / wanted.separation:.0f}"
    camera = wanted.style
    if wanted.style == "fly":
        camera += f", {wanted.speed:.2g} {'rooms' if wanted.outside else 'volumes'} a second"
    lines = {
        "rate": f"{rate.hz:.1f} Hz, {rate.ms:.1f} ms a frame" if rate.count else "-",
        "composite": f"{s['composite_ms']:.1f} ms, {images} eye image{'s' * (images != 1)}",
        "warp": f"{s['warp_ms']:.1f} ms, {s['warp']}",
        "samples": f"{_short(s['samples'])}, {sampling}{', pre-integrated' * bool(s['preintegrated'])}",
        "faces": f"{faces}, {width} × {height} pixels",
        "quality": quality_line(s),
        "stereo": stereo,
        "preset": wanted.preset or "the scene's own",
        "camera": camera,
    }
    if wanted.picked:  # value, at, depth, distance
        lines |= dict(part.split(" ", 1) for part in wanted.picked.split(", "))
    if wanted.outside:
        x, y, z = wanted.head.position
        moved = {None: "by keys", True: "recorded", False: "recorded, halted"}[wanted.path_runs]
        lines["head"] = f"{x:+.2f} {y:+.2f} {z:+.2f} m, {moved}"
    lines["help"] = "H"
    width = max(map(len, lines))
    return "\n".join(f"{name:<{width}}  {text}" for name, text in lines.items())


def quality_line(statistics: Mapping[str, Any]) -> str:
    """A frame's quality, and why it is that: of `quality`, `why` (of its `Choice`) and `target_hz`."""
    quality, why, target_hz = (statistics[name] for name in ("quality", "why", "target_hz"))
    reason = {"": "", "held": ", held", "refined": ", refined at rest"}
    return f"{quality:#.2g}{reason.get(why, f', follows {target_hz:g} Hz')}"


def help_text() -> str:
    """Keys and what they do, from the one table there is."""
    width = max(len(binding.shown) for binding in BINDINGS)
    return "\n".join(f"{binding.shown:<{width}}  {binding.text}" for binding in BINDINGS)


def fitting_letter(text: str, size: tuple[int, int], most: int = 15) -> int:
    """Height of letters, pixels, with which a text fits a window; at most `most`, at least 6."""
    lines = text.splitlines() or [""]
    # Letters are 0.6 of their height wide, lines 1.3 of it high, margins half of it.
    across = size[0] / (0.61 * max(map(len, lines)) + 2)
    down = size[1] / (1.31 * len(lines) + 2)
    return int(max(min(most, across, down), 6))


def _short(count: float) -> str:
    """1234567 as 1.23 M."""
    for size, unit in ((1e9, " G"), (1e6, " M"), (1e3, " k")):
        if count >= size:
            return f"{count / size:.3g}{unit}"
    return f"{count:.0f}"
