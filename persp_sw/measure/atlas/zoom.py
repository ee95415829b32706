"""Case 4: the eye comes from ten volume widths away until it touches a surface."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from ...volume.phantoms import synthetic_ct
from ..metrics import psnr
from . import plain, single_axis
from .case import Case, Finding, Progress, Scale, Strip
from .eye_paths import Array
from .looks import LOOKS
from .obliquity import TRAPEZOID

_FARTHEST = 10.0  # volume widths
_TOUCHING = 0.05  # voxels from the surface
_TOWARDS = np.array([0.42, 0.27, 0.87])  # the eye comes from there
_SOLID = 115.0  # value of the surface that is touched: bone's
_FOVY = 60.0

# Smooth functions, volumes of 64³: what users are promised at quality 1, and the goal from inside.
_PROMISED_DB = 38.0
_INSIDE_DB = 40.0
_TWO = Settings(samples_per_interval=2)
# A medium in which no voxel is left out and no ray ends early: what a picture can cost at most.
_FAINT = TransferFunction([(0, (1, 1, 1), 0.001), (255, (1, 1, 1), 0.002)])


@dataclass(frozen=True, eq=False)
class _Way:
    """The eye's way to a surface."""

    volume: Volume
    touched: Array
    back: Array
    gaps: Array
    pixels: int

    @classmethod
    def of(cls, scale: Scale) -> _Way:
        volume = synthetic_ct(64)
        width = max(volume.extent)
        back = _TOWARDS / np.linalg.norm(_TOWARDS)
        # From outside along the way, in hundredths of a voxel: the first place as dense as the surface.
        down = np.arange(width, -width, -0.01)
        places = volume.centre + down[:, None] * back
        values = np.zeros(len(places))
        inside = ((places >= 0) & (places <= np.array(volume.size) - 1)).all(1)
        values[inside] = plain.interpolated(volume, places[inside])
        touched = places[np.argmax(values >= _SOLID)]
        gaps = np.geomspace(_FARTHEST * width, _TOUCHING, scale.pick(9, 33))
        return cls(volume, touched, back, gaps, scale.pick(64, 128))

    def view(self, gap: float, finer: int = 1) -> View:
        """From `gap` before the surface; with `finer`² pixels for each."""
        eye = self.touched + gap * self.back
        centre = self.touched - max(self.volume.extent) / 4 * self.back
        return View.look_at(eye, centre, (0, 1, 0), _FOVY, (self.pixels * finer,) * 2)

    def holds(self, eye: Array) -> bool:
        """Whether the eye is in the box of voxel centres."""
        return bool((eye >= 0).all() and (eye <= np.array(self.volume.size) - 1).all())

    def truth(self, look: str, gap: float) -> NDArray[np.float64]:
        """Where pixels are larger than half a voxel, their mean; else what is in their middle."""
        voxels = 2 * np.tan(np.radians(_FOVY / 2)) * gap / self.pixels
        finer = int(np.clip(np.ceil(2 * voxels), 1, 4))
        fine = reference.render(self.volume, LOOKS[look], self.view(gap, finer))
        return fine.reshape(self.pixels, finer, self.pixels, finer, 4).mean((1, 3))


def sharpness(picture: NDArray[np.floating], truth: NDArray[np.floating]) -> float:
    """The energy of a picture's steps between neighbouring pixels over the truth's, square root: 1 as sharp.

    1 too where the truth has no steps.
    """

    def steps(image):
        return sum(float((np.diff(image, axis=axis) ** 2).sum()) for axis in (0, 1))

    of_truth = steps(np.asarray(truth, np.float64))
    return float(np.sqrt(steps(np.asarray(picture, np.float64)) / of_truth)) if of_truth > 0 else 1.0


def with_rays(view: View, rays: int) -> View:
    """The view with so many pixels, but no more than it has, in a square."""
    edge = min(int(np.sqrt(rays)), *view.size)
    return View(view.eye, replace(view.wall, pixels=(edge, edge)))


def enlarged(picture: NDArray[np.floating], pixels: int) -> NDArray[np.float64]:
    """A square picture with `pixels` a side, bilinear between its pixels' middles."""
    places = np.clip((np.arange(pixels) + 0.5) * len(picture) / pixels - 0.5, 0, len(picture) - 1)
    low = np.minimum(places.astype(int), max(len(picture) - 2, 0))
    high, share = np.minimum(low + 1, len(picture) - 1), places - low
    rows = picture[low] + share[:, None, None] * (picture[high] - picture[low])
    return rows[:, low] + share[None, :, None] * (rows[:, high] - rows[:, low])


def _sharpness(way: _Way, progress: Progress) -> list[Finding]:
    """All the way, of either look."""
    found = []
    for look, transfer in LOOKS.items():
        renderer = Renderer(way.volume, transfer)
        sharp, of_as_many, strips, published = [], [], [], []
        for at, gap in enumerate(way.gaps):
            progress(at, len(way.gaps), f"zoom, {look}")
            view, truth = way.view(gap), way.truth(look, gap)
            image = renderer.composite(view.eye, [view.wall])
            picture = renderer.warp(image, view)
            sharp.append(sharpness(picture, truth))
            ideal = enlarged(
                reference.render(way.volume, transfer, with_rays(view, len(image.pixels))), way.pixels
            )
            of_as_many.append(sharp[-1] / sharpness(ideal, truth))
            published.append(sharpness(single_axis.render(way.volume, transfer, view), truth))
            strips.append(Strip(f"{look}, {gap:.3g} voxels from the surface", picture, truth))
        softest = int(np.argmin(of_as_many))
        found.append(
            Finding(
                f"sharpness at its least, {look}",
                of_as_many[softest],
                1 / 1.5,
                "1 / 1.5 of a converged ray caster with as many rays as the image has pixels, enlarged",
                "of as many rays",
                at_least=True,
                strips=[strips[at] for at in (0, softest, -1)],
            )
        )
        most = int(np.argmax(sharp))
        cast = plain.cast(way.volume, transfer, way.view(way.gaps[most]))
        rival = sharpness(cast, way.truth(look, way.gaps[most]))
        found.append(
            Finding(
                f"sharpness at its most, {look}",
                sharp[most],
                1.5 * max(rival, 1.0),
                "1.5 × a plain ray caster from there: above 1 are edges that are none",
                "of the reference",
                strips=[strips[most], Strip("plain ray caster", cast, strips[most].reference)],
                ray_caster=rival,
                single_axis=float(np.nanmax(published)),
            )
        )
    return found


def _accuracy(way: _Way) -> list[Finding]:
    """PSNR of the smooth look: at the settings one gets from outside, and inside with two samples, too."""
    inside = [gap for gap in way.gaps if way.holds(way.view(gap).eye.position)]
    outside = [gap for gap in way.gaps if gap not in inside]
    found = []
    for place, gaps, settings, bound, derived in (
        ("outside", outside, Settings(), _PROMISED_DB, "what users are promised of smooth functions"),
        (
            "inside",
            inside,
            Settings(),
            None,
            "1.5 × a ray caster that samples on voxel planes, 2 × the errors of midpoints",
        ),
        ("inside, two samples", inside, _TWO, _INSIDE_DB, "goal of smooth functions from inside"),
    ):
        renderer = Renderer(way.volume, LOOKS["smooth"], settings)
        pictures = [renderer.render(way.view(gap)) for gap in gaps]
        truths = [way.truth("smooth", gap) for gap in gaps]
        values = [psnr(picture, truth) for picture, truth in zip(pictures, truths, strict=True)]
        worst = int(np.argmin(values))
        cast = plain.cast(way.volume, LOOKS["smooth"], way.view(gaps[worst]))
        rival = psnr(cast, truths[worst])
        published = [
            psnr(single_axis.render(way.volume, LOOKS["smooth"], way.view(gap)), truth)
            for gap, truth in zip(gaps, truths, strict=True)
        ]
        least = rival - 20 * np.log10(TRAPEZOID) if bound is None else bound
        found.append(
            Finding(
                f"PSNR at its least, smooth, {place}",
                values[worst],
                float(least),
                derived,
                "dB",
                at_least=True,
                strips=[Strip(f"{gaps[worst]:.3g} voxels from the surface", pictures[worst], truths[worst])],
                ray_caster=rival,
                single_axis=min((value for value in published if not np.isnan(value)), default=np.nan),
            )
        )
    return found


def _costs(way: _Way) -> list[Finding]:
    """Samples and the intermediate image's size, in a medium that hides nothing."""
    edge = max(way.volume.size)
    renderer = Renderer(way.volume, _FAINT, Settings(residual=0))
    samples, sizes = [], []
    for gap in way.gaps:
        view = way.view(gap)
        samples.append(renderer.composite(view.eye, [view.wall]).samples)
        sizes.append(max(renderer.last["intermediate_size"]))
    tangent = renderer.settings.single_face_tangent
    largest = edge * (1 + 2 * tangent) / 2 + 19
    return [
        Finding(
            "samples at their most",
            max(samples),
            1.5 * edge**3,
            "1.5 × one of each voxel, which is what a pixel a voxel takes",
            "samples",
        ),
        Finding(
            "intermediate image at its largest",
            max(sizes),
            largest,
            "a box from D to D + n: n / D ≤ 6 tangents at a pitch of 2 / (D + n), 3.5 n; and 16 + 3",
            "pixels",
        ),
        Finding(
            "intermediate image at its smallest, from a volume width on",
            min(size for size, gap in zip(sizes, way.gaps, strict=True) if gap <= max(way.volume.extent)),
            np.tan(np.radians(_FOVY / 2)) * edge / 2,
            "the view's 2·tan 30° at half a pixel a voxel on a last slice n / 2 away, or nearer none is seen",
            "pixels",
            at_least=True,
        ),
    ]


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """Sharpness, accuracy, samples and size of the intermediate image along the way."""
    way = _Way.of(scale)
    return [*_sharpness(way, progress), *_accuracy(way), *_costs(way)]


CASE = Case(
    "zoom",
    "Zoom",
    "The image in which shear-warp composites has the volume's resolution, not the screen's: close up the "
    "published method shows it magnified and soft, and with a pixel for each voxel of the nearest slice it "
    "would shrink to nothing before the eye, or grow without end. Here its pitch follows the nearest and the "
    "farthest visible slice and the walls' own pixels.",
    run,
)
