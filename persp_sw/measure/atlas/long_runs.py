"""Long runs: many thousands of frames of a random walk, with transfer functions and planes that change."""

from __future__ import annotations

import numpy as np

from ...geometry.regions import Regions
from ...renderer import Renderer
from ...volume.phantoms import synthetic_ct
from ...warp.canvas import Canvas
from ..memory import resident_bytes
from .case import Case, Finding, Progress, Scale, Strip
from .texture_run import texture_findings
from .walk import SIZE, TRANSFER, Walk, frames, random_views, wrong_numbers

# An eye image of such pictures has some 30 KiB and an encoded volume some 100: one lost in ten frames of the
# last 75 % of 20,000 would be 45 MB. Allocators keep a few of the largest frame's arrays.
GROWTH_MB = 16.0
_PROGRESS_EVERY = 100


def walk_findings(count: int, progress: Progress) -> list[Finding]:
    """A run in the software warp."""
    renderer, walk, canvas = Renderer(synthetic_ct(24), TRANSFER), Walk(), Canvas(*SIZE)
    first = next(random_views(np.random.default_rng(0), renderer))
    before = renderer.render(first)
    for number, (view, image) in enumerate(frames(renderer, count, 1, walk)):
        walk.wrong += wrong_numbers(renderer.warp(image, view, canvas))
        if number % max(count // 200, 1) == 0:
            walk.resident.append(resident_bytes())
        if number % _PROGRESS_EVERY == 0:
            progress(number, count, "random walk")
    renderer.transfer, renderer.regions = TRANSFER, Regions()
    after = renderer.render(first)
    what = f"{count:,} frames of a random walk, {walk.edits:,} edits"
    return [
        Finding(f"{what}: frames that failed", walk.failures, 0, "none may"),
        Finding(f"{what}: numbers that no picture can have", walk.wrong, 0, "none may"),
        Finding(
            f"{what}: growth of the process",
            walk.growth_mb,
            GROWTH_MB,
            "from the first quarter's end; one eye image or encoded volume lost in ten frames is more",
            "MB",
        ),
        Finding(
            f"{what}: change of the first picture when drawn again",
            float(np.abs(after - before).max()),
            0.0,
            "the same numbers in the same order: bit for bit",
            strips=(Strip("after the walk", after, before),),
        ),
    ]


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """The software warp's run, then the texture warp's."""
    count = scale.pick(300, 20_000)
    found = walk_findings(count, progress)
    found += texture_findings(scale.pick(30, 500), 3, progress)
    progress(count, count, "done")
    return found


CASE = Case(
    "long-runs",
    "Long runs",
    "What is kept from frame to frame (encodings, textures, pictures' memory) may grow, drift or fail after "
    "thousands of frames. An eye walks at random about a volume and through it, while transfer functions, "
    "clip planes and crops change; afterwards the first picture must come out again, bit for bit.",
    run,
)
