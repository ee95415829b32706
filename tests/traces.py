"""Made-up sessions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

import persp_sw as psw

LIMITS = {"min_quality": 0.25, "max_quality": 2.0}


def write(path: Path, records: Iterable[psw.FrameRecord], header: Mapping[str, object] | None = None) -> Path:
    """A trace of these frames."""
    with psw.TraceWriter(path, header) as writer:
        for record in records:
            writer.write(record)
    return path


def session(count: int = 1500, hz: float = 90.0, seed: int = 1) -> list[psw.FrameRecord]:
    """Frames under a changing load, with spikes, a missed refresh after each, two rungs and a rest."""
    random = np.random.default_rng(seed)
    target, time, records = 1e3 / hz, 50.0, []
    for i in range(count):
        phase = 6.3 * i / count
        refined = 0.8 < i / count < 0.9
        spike = i % 400 == 399
        composite = (0.7 + 0.06 * random.standard_normal()) * target * (5 if spike else 1)
        frame = composite + 2.5
        records.append(
            psw.FrameRecord(
                i,
                time,
                time + frame / 1e3,
                head=(0.1 * np.sin(phase), 1.7, 0.2, 0, 0, 0, 1),
                target_ms=target,
                budget_ms=target - 2.5,
                quality=3.0 if refined else float(np.exp(0.6 * np.sin(phase))),
                rung="2 samples" if i < count / 2 else "1 sample",
                why="steady",
                expected_ms=0.7 * target,
                composite_ms=composite,
                planning_ms=0.3,
                upload_ms=0.4,
                warp_ms=1.5,
                swap_ms=0.3,
                frame_ms=frame,
                missed=2 if spike else 0,
                latency_ms=frame + 9,
                samples=4_000_000,
                pixels=900_000,
                faces=3,
                compositings=2,
                rewarped=True,
                image_age_ms=frame + 3,
                refined=refined,
            )
        )
        time += max(frame, target) / 1e3
    return records
