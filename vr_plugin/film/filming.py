"""A film taken frame by frame, by one renderer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import median
from time import perf_counter
from typing import Any

import persp_sw as psw

from ..cameras import Camera
from .files import FilmFile
from .shots import Shot

_TIMES = ("composite_ms", "warp_ms")
_COUNTS = ("faces", "intermediate_size", "samples", "runs_bytes", "threads")


def take_film(
    renderer: psw.Renderer,
    shot: Shot,
    cameras: Sequence[Camera],
    file: FilmFile,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> dict[str, Any]:
    """Take a frame of each camera and add it to the file, which is there, whole, only if all goes well.

    The same scene and cameras give the same frames, bit by bit.

    Returns
    -------
    Medians over all frames but the first: `ms` of a frame, `composite_ms` and `warp_ms` of its (last) eye,
    `file_ms` of handing it to the file; `encode_ms` and `compile_ms`, sums over all; the last frame's counts.
    """
    rows, encode_ms, compile_ms = [], 0.0, 0.0
    with file:
        for number, camera in enumerate(cameras):
            progress(number, len(cameras), "frames")
            start = perf_counter()
            frame = shot.take(renderer, camera)
            taken = perf_counter()
            file.add(frame)
            end = perf_counter()
            last = renderer.last
            encode_ms, compile_ms = encode_ms + last["encode_ms"], compile_ms + last["compile_ms"]
            row = {"ms": 1e3 * (end - start), "file_ms": 1e3 * (end - taken)}
            rows.append(row | {name: last[name] for name in _TIMES})
        progress(len(cameras), len(cameras), "frames")
    timed = rows[1:] or rows
    times = {name: median(row[name] for row in timed) for name in rows[0]}
    counts = {name: renderer.last[name] for name in _COUNTS}
    return {**times, "encode_ms": encode_ms, "compile_ms": compile_ms, **counts}
