"""A random walk: an eye goes about a volume and through it, while looks and regions change."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Image
from ...eye_image import EyeImage
from ...geometry.regions import Regions
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer

_log = logging.getLogger("persp_sw")

SIZE = (48, 36)
# Sums of a ray's alphas, and bilinear means of them, in float32: a few roundings above 1.
ABOVE_ONE = 1e-5

TRANSFER = TransferFunction(
    [(30, (0.2, 0.3, 0.8), 0.0), (120, (1.0, 0.6, 0.3), 0.1), (255, (1, 1, 1), 0.9)], 1.0
)


@dataclass
class Walk:
    """What a run of frames found.

    Attributes
    ----------
    failures
        Frames that raised an exception.
    wrong
        Numbers that were not finite, or outside 0 … 1, or colours brighter than their alpha.
    edits
        Changes of the transfer function, and of regions.
    resident
        Bytes that the process held, from time to time.
    """

    failures: int = 0
    wrong: int = 0
    edits: int = 0
    resident: list[int] = field(default_factory=list)

    @property
    def growth_mb(self) -> float:
        """From the first quarter's end to the end, medians of a tenth of the run each."""
        count = len(self.resident)
        part = max(count // 10, 1)
        early, late = self.resident[count // 4 : count // 4 + part], self.resident[-part:]
        return float(np.median(late) - np.median(early)) / 1e6


def random_transfer(rng: np.random.Generator) -> TransferFunction:
    """Two to six points anywhere, now and then a step, faint or opaque."""
    values = np.sort(rng.choice(256, rng.integers(2, 7), replace=False)).astype(float)
    if rng.random() < 0.3:
        values[1] = values[0]
    strength = 10 ** rng.uniform(-4, 0)
    points = [(value, tuple(rng.uniform(0, 1, 3)), strength * rng.uniform(0, 1)) for value in values]
    return TransferFunction(points, 10 ** rng.uniform(-1, 1))


def random_regions(rng: np.random.Generator, renderer: Renderer) -> Regions:
    """A clip plane, or two, through the volume; now and then a crop, which may be empty."""
    volume = renderer.volume
    high = np.array(volume.size) - 1.0
    planes = []
    for _ in range(rng.integers(0, 3)):
        normal = rng.normal(size=3)
        planes.append((*normal, float(-normal @ (high * rng.uniform(0.1, 0.9, 3)))))
    crop = np.sort(rng.uniform(0, 1, (3, 2)) * high[:, None], axis=1).ravel() if rng.random() < 0.3 else None
    return Regions(crop, planes)


def random_views(rng: np.random.Generator, renderer: Renderer) -> Iterator[View]:
    """An eye that walks about the volume and through it, and looks towards its middle."""
    centre, reach = renderer.volume.centre, max(renderer.volume.extent)
    place, speed = np.array((0.3, 0.2, 1.5)), np.zeros(3)
    while True:
        speed = 0.9 * speed + 0.05 * rng.normal(size=3) - 0.005 * place
        place = np.clip(place + speed, -2.5, 2.5)
        eye = centre + reach * place
        yield View.look_at(eye, centre + reach * rng.uniform(-0.1, 0.1, 3), (0.1, 1.0, 0.2), 70.0, SIZE)


def frames(renderer: Renderer, count: int, seed: int, walk: Walk) -> Iterator[tuple[View, EyeImage]]:
    """`count` frames' views and eye images; what went wrong is noted in `walk`."""
    rng = np.random.default_rng(seed)
    views = random_views(rng, renderer)
    for number in range(count):
        if rng.random() < 0.02:
            renderer.transfer = random_transfer(rng)
            walk.edits += 1
        if rng.random() < 0.1:
            renderer.regions = random_regions(rng, renderer)
            walk.edits += 1
        view = next(views)
        try:
            image = renderer.composite(view.eye, [view.wall])
        except Exception:  # whatever it is: the run goes on, and tells how often
            if not walk.failures:
                _log.exception("frame %d of a long run failed", number)
            walk.failures += 1
            continue
        yield view, image


def wrong_numbers(picture: Image) -> int:
    """How many of a picture's numbers no picture can have."""
    colours, alphas = picture[..., :3], picture[..., 3:]
    with np.errstate(invalid="ignore"):
        good = (picture >= 0) & (picture <= 1 + ABOVE_ONE)
        good[..., :3] &= colours <= alphas + ABOVE_ONE
    return int(np.count_nonzero(~good))
