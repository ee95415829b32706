"""A preview's trace: a record of each frame that it shows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import persp_sw as psw

from ..record import Times, record_of
from ..rig import QualityAim
from ..shown import Shown
from .pictures import Composited

TARGET_HZ = 30.0  # a rate at which a mouse feels attached to the volume, and one core shows 256³ voxels well


class Recorder:
    """Writes frames into a trace; without one it does nothing.

    Poses are those of the camera, in the volume's world; in the view from outside the head's, in the room.

    Parameters
    ----------
    target_hz
        What frames are judged by; 0: `TARGET_HZ`.
    """

    def __init__(self, trace: psw.TraceWriter | None = None, target_hz: float = 0.0):
        self._trace, self._target_ms = trace, 1e3 / (target_hz or TARGET_HZ)
        self._count = 0

    @property
    def is_on(self) -> bool:
        """Whether anybody wants to know what frames take."""
        return self._trace is not None

    def add(self, done: Composited, times: Times, *, is_new: bool = True, on_display: bool = True) -> None:
        """A frame was shown; `is_new`: its eye images had not been shown before."""
        if self._trace is not None:
            shown = Shown(done.inside, done.inside.moment, is_new)
            record = record_of(self._count, shown, times, self._target_ms, on_display=on_display)
            self._trace.write(record)
        self._count += 1


@contextmanager
def recorder_to(
    file: str | Path | None, scene: str, settings: psw.Settings, target_hz: float, aim: QualityAim
) -> Iterator[Recorder]:
    """A recorder that writes a trace file; None: one that does nothing.

    Raises
    ------
    TraceError
        A file that cannot be made.
    """
    if file is None:
        yield Recorder()
        return
    limits = {"min_quality": aim.min_quality, "max_quality": aim.max_quality} if target_hz else {}
    header = {"scene": scene, "target_hz": target_hz or TARGET_HZ, **limits, "settings": settings}
    with psw.TraceWriter(file, header) as trace:
        yield Recorder(trace, target_hz)
