"""Long runs: many thousands of frames of a random walk, with transfer functions and planes that change."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Image
from ...errors import GraphicsError, MissingPackageError
from ...eye_image import EyeImage
from ...geometry.regions import Regions
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...volume.phantoms import synthetic_ct
from ...warp.canvas import Canvas
from ...warp.context import OffscreenContext, opengl
from ...warp.framebuffer import Framebuffer
from ...warp.texture import TextureWarp
from ..memory import resident_bytes
from .case import Case, Finding, Progress, Scale, Strip

_log = logging.getLogger("persp_sw")

SIZE = (48, 36)
# An eye image of such pictures has some 30 KiB and an encoded volume some 100: one lost in ten frames of the
# last 75 % of 20,000 would be 45 MB. Allocators keep a few of the largest frame's arrays.
GROWTH_MB = 16.0
# Sums of a ray's alphas, and bilinear means of them, in float32: a few roundings above 1.
ABOVE_ONE = 1e-5

_TRANSFER = TransferFunction(
    [(30, (0.2, 0.3, 0.8), 0.0), (120, (1.0, 0.6, 0.3), 0.1), (255, (1, 1, 1), 0.9)], 1.0
)
_PROGRESS_EVERY = 100


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
    views, previous = random_views(rng, renderer), None
    for number in range(count):
        if rng.random() < 0.02:
            renderer.transfer = random_transfer(rng)
            walk.edits += 1
        if rng.random() < 0.1:
            renderer.regions = random_regions(rng, renderer)
            walk.edits += 1
        view = next(views)
        try:
            previous = renderer.composite(view.eye, [view.wall], previous)
        except Exception:  # whatever it is: the run goes on, and tells how often
            if not walk.failures:
                _log.exception("frame %d of a long run failed", number)
            walk.failures += 1
            continue
        yield view, previous


def wrong_numbers(picture: Image) -> int:
    """How many of a picture's numbers no picture can have."""
    colours, alphas = picture[..., :3], picture[..., 3:]
    with np.errstate(invalid="ignore"):
        good = (picture >= 0) & (picture <= 1 + ABOVE_ONE)
        good[..., :3] &= colours <= alphas + ABOVE_ONE
    return int(np.count_nonzero(~good))


def walk_findings(count: int, progress: Progress) -> list[Finding]:
    """A run in the software warp."""
    renderer, walk, canvas = Renderer(synthetic_ct(24), _TRANSFER), Walk(), Canvas(*SIZE)
    first = next(random_views(np.random.default_rng(0), renderer))
    before = renderer.render(first)
    for number, (view, image) in enumerate(frames(renderer, count, 1, walk)):
        walk.wrong += wrong_numbers(renderer.warp(image, view, canvas))
        if number % max(count // 200, 1) == 0:
            walk.resident.append(resident_bytes())
        if number % _PROGRESS_EVERY == 0:
            progress(number, count, "random walk")
    renderer.transfer, renderer.regions = _TRANSFER, Regions()
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


def live_objects() -> int:
    """OpenGL's textures, buffers, framebuffers and vertex arrays in the context that is current."""
    gl = opengl()
    known = (gl.glIsTexture, gl.glIsBuffer, gl.glIsFramebuffer, gl.glIsRenderbuffer, gl.glIsVertexArray)
    return sum(bool(is_one(name)) for is_one in known for name in range(1, _NAMES))


_NAMES = 512  # drivers give the smallest free names


def texture_findings(count: int) -> list[Finding]:
    """A shorter run in the texture warp; none where there is no OpenGL."""
    renderer, walk, objects = Renderer(synthetic_ct(24), _TRANSFER), Walk(), []
    try:
        with OffscreenContext(), TextureWarp() as warp:
            target = Framebuffer(*SIZE)
            for view, image in frames(renderer, count, 2, walk):
                warp.upload(image)
                target.clear()
                warp.draw_view(view)
                objects.append(live_objects())
            target.close()
    except (GraphicsError, MissingPackageError) as error:
        _log.warning("no OpenGL, so no long run of the texture warp: %s", error)
        return []
    early = max(objects[: len(objects) // 4])
    return [
        Finding(
            f"{count:,} frames in OpenGL: objects more than in the first quarter",
            max(objects) - early,
            0,
            "textures are used again, and deleted when they do not fit",
        )
    ]


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """The software warp's run, then the texture warp's."""
    count = scale.pick(300, 20_000)
    found = walk_findings(count, progress)
    found += texture_findings(scale.pick(40, 500))
    progress(count, count, "done")
    return found


CASE = Case(
    "long-runs",
    "Long runs",
    "What is kept from frame to frame (encodings, textures, choices of faces) may grow, drift or fail after "
    "thousands of frames. An eye walks at random about a volume and through it, while transfer functions, "
    "clip planes and crops change; afterwards the first picture must come out again, bit for bit.",
    run,
)
