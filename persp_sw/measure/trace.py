"""The record of a session, frame by frame: what each was meant to be, what it took, when it was seen.

A trace is a text file of JSON lines, a header first, then an object a frame; `docs/steady-frames.md` lists
the fields. It is written while frames have to be in time: a frame's line is made and buffered, nothing more.
"""

from __future__ import annotations

import gzip
import json
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, is_dataclass
from datetime import datetime, timezone
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from ..errors import TraceError
from .machine import describe_machine

FORMAT, VERSION = "persp_sw trace", 1

# Decimals kept: microseconds, micrometres and parts in a million; of milliseconds 0.1 µs.
_DECIMALS, _MS_DECIMALS = 6, 4
# Two seconds of frames at 90 Hz, which a crash would lose; compressed, as much after compression.
_BUFFER_BYTES = 1 << 16
# Better levels make it 8 % smaller at most and cost more of the frame's time.
_GZIP_LEVEL = 1
POSE_NUMBERS = 7

_log = logging.getLogger("persp_sw")


@dataclass(frozen=True, slots=True, eq=False)
class FrameRecord:
    """One frame that was shown. What is not known, or was not done in it, is None.

    Attributes
    ----------
    frame
        Number, from 0.
    time_s, shown_s
        Seconds of the loop's clock: when the frame began, and when its swap had ended (None: no display).
    head
        The pose that its eye images were composited for: x, y, z in metres of the room, then the unit
        quaternion x, y, z, w.
    shown_head
        The pose it was shown for; None: `head` itself.
    target_ms, budget_ms
        What the whole frame may take, and what that leaves for compositing.
    quality, rung, why, expected_ms
        The controller's `Choice`: what was chosen, on which rung, why, and the compositing time predicted.
    composite_ms, planning_ms, upload_ms, warp_ms, swap_ms
        What each stage took, of all eyes together.
    frame_ms
        The whole frame: from the end of the one before to its own.
    missed
        Refreshes of the display since the frame before that had to show that one again.
    latency_ms
        From the tracker's stamp of the head's sample to the end of the swap.
    samples, pixels, faces, compositings
        Voxel samples composited, pixels and faces of the eye images, eye images that show anything.
    rewarped
        Whether eye images composited for another pose were shown.
    image_age_ms
        From the beginning of the shown eye images' compositing to the end of the swap.
    refined
        Whether the head was at rest and the picture is one refined beyond what the target allows.

    Raises
    ------
    TraceError
        A pose that is not 7 numbers. Nothing else is checked: a frame has no time for it.
    """

    frame: int
    time_s: float
    shown_s: float | None = None
    head: Sequence[float] | None = None
    shown_head: Sequence[float] | None = None
    target_ms: float | None = None
    budget_ms: float | None = None
    quality: float | None = None
    rung: str = ""
    why: str = ""
    expected_ms: float | None = None
    composite_ms: float | None = None
    planning_ms: float | None = None
    upload_ms: float | None = None
    warp_ms: float | None = None
    swap_ms: float | None = None
    frame_ms: float | None = None
    missed: int = 0
    latency_ms: float | None = None
    samples: int | None = None
    pixels: int | None = None
    faces: int | None = None
    compositings: int | None = None
    rewarped: bool = False
    image_age_ms: float | None = None
    refined: bool = False

    def __post_init__(self):
        for pose in (self.head, self.shown_head):
            if pose is not None and len(pose) != POSE_NUMBERS:
                raise TraceError(f"a pose is x, y, z and a quaternion x, y, z, w; given {pose!r}")

    def values(self) -> dict[str, Any]:
        """What a trace keeps of it: rounded, without what is None, not finite or the field's default."""
        kept = {}
        for name, default, keep in _FIELDS:
            value = getattr(self, name)
            if value is not None:
                value = keep(value)
                if value is not None and value != default:
                    kept[name] = value
        return kept


def _seconds(value: float) -> float | None:
    value = float(value)
    return round(value, _DECIMALS) if math.isfinite(value) else None


def _milliseconds(value: float) -> float | None:
    value = float(value)
    return round(value, _MS_DECIMALS) if math.isfinite(value) else None


def _pose(values: Sequence[float]) -> list[float] | None:
    kept = [round(value, _DECIMALS) for value in map(float, values)]
    return kept if math.isfinite(sum(kept)) else None


def _keeper(name: str, annotation: str) -> Callable[[Any], Any]:
    """What turns a field's value into what the file holds."""
    kind = annotation.partition(" ")[0]
    if kind == "float":
        return _milliseconds if name.endswith("_ms") else _seconds
    return {"int": int, "bool": bool, "str": str}.get(kind, _pose)


_FIELDS = tuple((f.name, f.default, _keeper(f.name, str(f.type))) for f in fields(FrameRecord))


class TraceWriter:
    """Writes a trace, as a context manager or until `close`.

    It costs a frame about 30 µs, compressed 35; one in some 200 (compressed: some 1000) hands what is
    buffered to the system. What cannot be written once the session runs (a full disk) does not end it: that
    is said once, and nothing more is written.

    Parameters
    ----------
    path
        Made anew, with its folder; compressed where the name ends in .gz.
    header
        What the session was: by convention `rig`, `scene`, `target_hz`, `settings`, and the controller's
        `min_quality` and `max_quality`. Anything that JSON holds, arrays and dataclasses. The format, the
        date and the machine are added.

    Attributes
    ----------
    frames
        Records taken.
    failed
        Why nothing is written any more; None: all is well.

    Raises
    ------
    TraceError
        A file that cannot be made.
    """

    def __init__(self, path: str | Path, header: Mapping[str, Any] | None = None):
        self.path = Path(path)
        self.frames = 0
        self.failed: str | None = None
        self._encode = json.JSONEncoder(
            allow_nan=False,
            separators=(",", ":"),
            default=_plain,  # in ASCII: names of files may be no text
        ).encode
        started = datetime.now(timezone.utc).isoformat(timespec="seconds")
        ours = {"format": FORMAT, "version": VERSION, "started": started}
        first = {**ours, **_finite({"machine": describe_machine(), **(header or {})}), **ours}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = _opened(self.path)
        except OSError as error:
            raise TraceError(_said(self.path, error)) from None
        try:
            self._write(first)
            self._file.flush()
        except OSError as error:
            self._let_go()
            raise TraceError(_said(self.path, error)) from None

    def write(self, record: FrameRecord) -> None:
        """One more frame."""
        self.frames += 1
        if self.failed is None:
            try:
                self._write(record.values())
            except OSError as error:
                self._fail(error)

    def close(self) -> None:
        """Write what is buffered."""
        if self.failed is None and not self._file.closed:
            try:
                self._file.close()
            except OSError as error:
                self._fail(error)

    def __enter__(self) -> TraceWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _write(self, values: dict[str, Any]) -> None:
        self._file.write((self._encode(values) + "\n").encode())

    def _fail(self, error: OSError) -> None:
        self.failed = error.strerror or str(error)
        _log.warning("the trace %s is cut off: %s", self.path, self.failed)
        self._let_go()

    def _let_go(self) -> None:
        with suppress(OSError):  # what it still holds cannot be written either
            self._file.close()


def _opened(path: Path) -> BinaryIO:
    if path.suffix.lower() == ".gz":
        return gzip.open(path, "wb", _GZIP_LEVEL)
    return path.open("wb", _BUFFER_BYTES)


def _said(path: Path, error: OSError) -> str:
    return f"cannot write the trace {path}: {error.strerror or error}; choose another file"


def _finite(value: Any) -> Any:
    """A header's values with null for numbers that JSON does not have."""
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, str | int | None) else _finite(_plain(value))


def _plain(value: Any) -> Any:
    """Arrays as lists, dataclasses as objects, anything else as its text."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return str(value)
