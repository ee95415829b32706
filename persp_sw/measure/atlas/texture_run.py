"""A long run of the texture warp: laps of one random walk, after each of which OpenGL must hold as much."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ...arrays import Image
from ...errors import GraphicsError, MissingPackageError
from ...geometry.regions import Regions
from ...renderer import Renderer
from ...settings import Settings
from ...volume.phantoms import synthetic_ct
from ...warp.context import OffscreenContext
from ...warp.framebuffer import Framebuffer
from ...warp.gl_census import census, growth
from ...warp.texture import TextureWarp
from ..memory import resident_bytes
from .case import Finding, Progress, Strip
from .walk import TRANSFER, Walk, frames, wrong_numbers

_log = logging.getLogger("persp_sw")

_SEED, _SLOTS = 2, ("left", "right")
# Pictures that hosts draw into, and pictures of other sizes that a host lays over.
_TARGETS = ((48, 36), (64, 64), (200, 20))
_PIXELS = 192  # of an eye image a side: one face of float32 is 590 KB
# A face's texture lost in ten frames of 500 would be 29 MB; allocators keep an image of every kind.
LAP_GROWTH_MB = 8.0
_SETTINGS = Settings(intermediate_size=_PIXELS)


@dataclass
class Laps:
    """What was found after each lap.

    Attributes
    ----------
    walk
        Of all laps.
    objects
        OpenGL's, by kind.
    left
        OpenGL's objects after all was closed.
    resident
        Bytes that the process held.
    pictures
        The fullest one of each lap.
    """

    walk: Walk = field(default_factory=Walk)
    objects: list[dict[str, int]] = field(default_factory=list)
    left: int = 0
    resident: list[int] = field(default_factory=list)
    pictures: list[Image] = field(default_factory=list)


def lap(renderer: Renderer, warp: TextureWarp, count: int, walk: Walk) -> Iterator[Image]:
    """Draw a walk's frames, each into a framebuffer of its own size: two slots, eyes that have moved since,
    slabs, with and without depth, and a picture laid over. The same in every lap.
    """
    rng = np.random.default_rng(_SEED)
    renderer.transfer, renderer.regions, renderer.settings = TRANSFER, Regions(), _SETTINGS
    for number, (view, image) in enumerate(frames(renderer, count, _SEED, walk)):
        slot = _SLOTS[number % 2]
        warp.upload(image, slot)
        width, height = _TARGETS[rng.integers(len(_TARGETS))]
        target = Framebuffer(width, height)
        target.clear()
        warp.draw_view(view, slot)
        other = _SLOTS[rng.integers(2)] if number else slot
        depths = (0.1, 1e3) if rng.random() < 0.5 else (None, None)
        warp.draw_view(view, other, *depths)
        if rng.random() < 0.2:
            warp.draw_picture(np.zeros((*rng.integers(2, 40, 2), 4), np.float32))
        picture = target.read()
        walk.wrong += wrong_numbers(picture)
        target.close()
        yield picture
        renderer.settings = replace(_SETTINGS, depth_slabs=int(rng.choice([0, 0, 1, 3])))


def run_laps(count: int, laps: int, progress: Progress) -> Laps:
    """So many laps of so many frames, in a context of its own.

    Raises
    ------
    GraphicsError, MissingPackageError
        There is no OpenGL.
    """
    found, renderer = Laps(), Renderer(synthetic_ct(24), TRANSFER)
    with OffscreenContext():
        with TextureWarp() as warp:
            for number in range(laps):
                pictures = lap(renderer, warp, count, found.walk)
                found.pictures.append(max(pictures, key=lambda picture: float(picture[..., 3].mean())))
                found.objects.append(census())
                found.resident.append(resident_bytes())
                progress(number + 1, laps, "laps in OpenGL")
        found.left = sum(census().values())
    return found


def texture_findings(count: int, laps: int, progress: Progress) -> list[Finding]:
    """Laps in the texture warp; none, and a line in the log that says so, where there is no OpenGL."""
    try:
        found = run_laps(count, laps, progress)
    except (GraphicsError, MissingPackageError) as error:
        _log.warning("no OpenGL, so no long run of the texture warp: %s", error)
        return []
    first, last = found.objects[0], found.objects[-1]
    more = ", ".join(f"{last[kind] - n} {kind}" for kind, n in first.items() if last[kind] > n)
    held = ", ".join(f"{n} {kind}" for kind, n in last.items() if n)
    what = f"{laps} laps of {count:,} frames in OpenGL"
    return [
        Finding(
            f"{what}: objects more than after the first lap",
            growth(first, last),
            0,
            f"the same frames need the same objects; {f'more: {more}' if more else f'held: {held}'}",
        ),
        Finding(f"{what}: objects left when all is closed", found.left, 0, "all that was made is deleted"),
        Finding(
            f"{what}: frames that failed, numbers that no picture can have",
            found.walk.failures + found.walk.wrong,
            0,
            "none may",
        ),
        Finding(
            f"{what}: growth of the process after the first",
            (found.resident[-1] - found.resident[0]) / 1e6,
            LAP_GROWTH_MB,
            "a face's texture lost in ten frames of 500 is 29 MB",
            "MB",
        ),
        Finding(
            f"{what}: change of the fullest picture from lap to lap",
            max(float(np.abs(picture - found.pictures[0]).max()) for picture in found.pictures),
            0.0,
            "the same numbers in the same order: bit for bit",
            strips=(Strip("the last lap's fullest picture", found.pictures[-1], found.pictures[0]),),
        ),
    ]
