"""Hard voxel values and hard transfer functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ... import reference
from ...arrays import Image
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from ..exact import shown_part
from ..metrics import max_error
from . import single_axis
from .bad_input import taken_without_a_word
from .case import Case, Finding, Progress, Scale, Strip
from .face_views import (
    TIMES_MIDPOINTS,
    WHY_TIMES_MIDPOINTS,
    face_view,
    judged_faces,
    judged_single_axis,
    rms_errors,
    rms_ratio,
    single_axis_ratio,
)
from .missing_values import BESIDE_A_GAP, miscounted, shown_in_gaps, with_gaps

_COLOUR = np.array([0.9, 0.6, 0.3])
_FUNCTION_POINTS = 4096
_SHOWN = (
    "int16 with negatives",
    "float32 with NaN and infinities",
    "4096 points",
    "two points at one value",
)

Rows = list[tuple[float, tuple[float, float, float], float]]


@dataclass(frozen=True, eq=False)
class Scene:
    """Voxels and a transfer function that are hard in some way."""

    name: str
    volume: Volume
    transfer: TransferFunction


def field(n: int) -> NDArray[np.float64]:
    """n³ smooth values in −1 … 1, [z, y, x]."""
    z, y, x = np.indices((n, n, n)) / (n - 1.0)
    return (np.sin(9 * x + 4 * y) + np.sin(8 * y - 5 * z + 1) + np.sin(7 * z + 6 * x * y + 2)) / 3


def smooth_rows(low: float, high: float) -> Rows:
    """Transparent up to a fifth of the way from `low` to `high`, then denser, per voxel."""
    return [
        (low + 0.2 * (high - low), (0.1, 0.3, 0.9), 0.0),
        (low + 0.6 * (high - low), (0.95, 0.6, 0.2), 0.05),
        (high, (1, 1, 0.9), 0.2),
    ]


def scenes(n: int) -> list[Scene]:
    """All that can be seen and compared with the reference."""
    values = field(n)
    signed = np.rint(1000 * values - 200).astype(np.int16)
    return [
        Scene("int16 with negatives", Volume(signed), TransferFunction(smooth_rows(-1200, 800))),
        Scene("int16, all negative", Volume(signed - 3000), TransferFunction(smooth_rows(-4200, -2200))),
        Scene(
            "int16, its whole range",
            Volume(_over_range(values)),
            TransferFunction(smooth_rows(-32768, 32767)),
        ),
        Scene(
            "float32 with NaN and infinities",
            Volume(with_gaps(field(n))),
            TransferFunction(smooth_rows(-1, 1)),
        ),
        Scene("float32, tiny", Volume((1e-30 * values).astype(np.float32)), _function(1e-30)),
        Scene("float32, huge", Volume((1e38 * values).astype(np.float32)), _function(1e38)),
        Scene("4096 points", Volume(signed), many_points()),
        Scene("two points at one value", Volume(_bytes(values)), TransferFunction(step_rows(120.0))),
        Scene("points beyond the values", Volume(_bytes(values)), TransferFunction(smooth_rows(-700, 900))),
    ]


def _function(scale: float) -> TransferFunction:
    return TransferFunction(smooth_rows(-scale, scale))


def _bytes(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.rint(127.5 + 127.5 * values).astype(np.uint8)


def _over_range(values: NDArray[np.float64]) -> NDArray[np.int16]:
    low, high = values.min(), values.max()
    return np.rint(-32768 + (values - low) / (high - low) * 65535).astype(np.int16)


def many_points() -> TransferFunction:
    """4,096 points: a smooth function with a ripple on its opacity."""
    values = np.linspace(-1200, 800, _FUNCTION_POINTS)
    share = (values + 1200) / 2000
    opacity = 0.06 * share**2 * (1 + 0.3 * np.sin(40 * share))
    colours = np.stack([share, 0.5 + 0.3 * np.sin(9 * share), 1 - share], 1)
    return TransferFunction(
        [(v, tuple(c), a) for v, c, a in zip(values, colours.tolist(), opacity, strict=True)]
    )


def step_rows(at: float) -> Rows:
    """A step: nothing below `at`, which two points share, a thin medium from there on."""
    return [
        (0.0, tuple(_COLOUR), 0.0),
        (at, tuple(_COLOUR), 0.0),
        (at, tuple(_COLOUR), 0.04),
        (255.0, (1, 1, 1), 0.1),
    ]


def view_of(volume: Volume, pixels: int) -> View:
    """From in front, above and to the right; the volume fills the picture."""
    reach = max(volume.extent)
    eye = volume.centre + reach * np.array([0.9, 0.7, 1.4])
    return View.look_at(eye, volume.centre, (0, 1, 0), 42, (pixels, pixels))


@dataclass(frozen=True, eq=False)
class Seen:
    """A scene's picture, its numbers that are none, and RMS errors of a face's rays: ours, a ray caster's."""

    scene: Scene
    ours_rms: float
    plain_rms: float
    lost: int
    strip: Strip
    published_ratio: float  # of the shear-warp of 2001, over a ray caster's on its rays

    @property
    def ratio(self) -> float:
        """Ours over the ray caster's; infinite where that one makes no error at all."""
        return rms_ratio(self.ours_rms, self.plain_rms)


def seen(scene: Scene, pixels: int) -> Seen:
    """A scene as ours, the reference and a plain ray caster show it."""
    settings = Settings(intermediate_size=pixels)  # as fine as the picture
    renderer = Renderer(scene.volume, scene.transfer, settings)
    view = view_of(scene.volume, pixels)
    ours = renderer.render(view)
    truth = reference.render(scene.volume, scene.transfer, view).astype(np.float32)
    lost = int(np.count_nonzero(~np.isfinite(ours)))
    strip = Strip(scene.name, ours, truth, gain=10)
    errors = rms_errors(judged_faces(renderer, view))
    return Seen(scene, *errors, lost, strip, single_axis_ratio(renderer, view))


def constants() -> list[tuple[str, DTypeLike, float]]:
    """Name, voxel type and value of volumes that have one value."""
    return [
        ("uint8 0", np.uint8, 0),
        ("uint8 255", np.uint8, 255),
        ("int16 −32768", np.int16, -32768),
        ("uint16 65535", np.uint16, 65535),
        ("float32 −7.5", np.float32, -7.5),
        ("float32 1e-40", np.float32, 1e-40),
        ("float32 3e38", np.float32, 3e38),
    ]


def constant_excess(dtype: DTypeLike, value: float) -> tuple[float, float]:
    """Largest error of a face's pixel of a volume with one value, over its bound; half of the light stays.

    Ours, and of the shear-warp of 2001.

    Bound: 2e-6 for a few float32 roundings, and half a unit in the last place of 1, 3e-8, for each of 9.
    """
    volume = Volume(np.full((9, 9, 9), value, dtype))
    exact = float(volume.data.flat[0])
    transfer = TransferFunction([(exact, tuple(_COLOUR), 0.1)], 1.0)
    view = view_of(volume, 32)
    image = Renderer(volume, transfer, Settings(residual=0)).composite(view.eye, [view.wall])

    def excess(pixels: Image, rays: View) -> float:
        entry, leave = shown_part(volume, rays)
        alpha = -np.expm1(-float(transfer.extinction(exact)) * (leave - entry))[..., None]
        error = np.abs(pixels - alpha * [*_COLOUR, 1]).max()
        return float(np.nan_to_num(error, nan=np.inf)) / (2e-6 + 9 * 3e-8)

    ours = [excess(image.face_pixels(n), face_view(image, n)) for n in range(len(image.faces))]
    published = [excess(*face) for face in single_axis.faces_of(volume, transfer, view)]
    return max(ours, default=np.inf), max(published, default=np.nan)


def change_by_denormals(n: int, pixels: int) -> float:
    """Largest change of a picture when its zeros become denormal numbers, of both signs."""
    values = np.maximum(field(n), 0).astype(np.float32)
    signs = np.where(np.indices(values.shape).sum(0) % 2, np.float32(1e-40), np.float32(-1e-42))
    pictures = []
    for data in (values, np.where(values == 0, signs, values)):
        volume = Volume(data)
        renderer = Renderer(volume, TransferFunction(smooth_rows(-1, 1)), Settings(residual=0))
        pictures.append(renderer.render(view_of(volume, pixels)))
    return max_error(*pictures)


def change_by_size(n: int, pixels: int) -> float:
    """Largest change of a picture when all values, and the function's, are times a power of two.

    Whole values from −7 to 7, so that denormal numbers can hold them: 1e-44, and up to 3e38.
    """
    values = np.rint(field(n) * 7).clip(-7, 7).astype(np.float32)
    pictures = []
    for exponent in (0, -149, -140, -126, -100, 125):
        size = np.ldexp(1.0, exponent)
        volume = Volume(np.ldexp(values, exponent))
        renderer = Renderer(volume, TransferFunction(smooth_rows(-7 * size, 7 * size)), Settings(residual=0))
        pictures.append(renderer.render(view_of(volume, pixels)))
    return max(max_error(pictures[0], other) for other in pictures[1:])


def run(scale: Scale, progress: Progress) -> list[Finding]:
    """The case."""
    n, pixels = scale.pick(24, 64), scale.pick(48, 160)
    every, found = scenes(n), []
    for number, scene in enumerate(every):
        progress(number, len(every), CASE.name)
        found.append(seen(scene, pixels))
    progress(len(every), len(every), CASE.name)
    worst = max(found, key=lambda one: np.nan_to_num(one.ratio, nan=np.inf))
    both = {name: constant_excess(dtype, value) for name, dtype, value in constants()}
    flat = {name: ours for name, (ours, _) in both.items()}
    taken = taken_without_a_word()
    return [
        Finding("numbers that are NaN or infinite", sum(s.lost for s in found), 0, "none is to be"),
        Finding(
            "voxels without a value that are not counted",
            miscounted(with_gaps(field(n))),
            0,
            "counted by the volume; info, render, view and cave say how many",
        ),
        Finding(
            "voxels of a ray that show beside a voxel without a value",
            shown_in_gaps(),
            0.01,
            "none: by default samples then lie in cells, not on slices; 1 % for slant and float32",
        ),
        Finding(
            "the same where one plain sample an interval is asked for",
            shown_in_gaps(1),
            BESIDE_A_GAP + 0.01,
            "½ on either side: a slice stands for half an interval beyond it; 1 % for slant and float32",
            single_axis=shown_in_gaps(1, judged_single_axis),
        ),
        Finding(
            "the same with two plain samples an interval",
            shown_in_gaps(2),
            BESIDE_A_GAP / 2 + 0.01,
            "¼ on either side",
        ),
        Finding(
            "RMS error of faces over a plain ray caster's, worst of all values and functions",
            worst.ratio,
            TIMES_MIDPOINTS,
            f"{WHY_TIMES_MIDPOINTS}. Worst: {worst.scene.name}, RMS {worst.ours_rms:.2g}",
            ray_caster=1,
            single_axis=float(np.max([one.published_ratio for one in found])),
            strips=[s.strip for s in found if s.scene.name in _SHOWN or s is worst],
        ),
        Finding(
            "volumes of one value: largest error of a face's pixel over its bound",
            max(flat.values()),
            1,
            f"closed form; float32 in every slice. Largest: {max(flat, key=flat.__getitem__)}",
            single_axis=max(of_2001 for _, of_2001 in both.values()),
        ),
        Finding(
            "zeros that become denormals: largest change",
            change_by_denormals(n, pixels),
            0,
            "1e-40 and 0 have the same entry of the table, and weights the same roundings",
        ),
        Finding(
            "values and function times 2^-149 … 2^125, 1e-44 … 3e38: largest change",
            change_by_size(n, pixels),
            0,
            "values of extreme size are brought near 1 by a power of two, which is exact",
        ),
        Finding(
            "bad functions and voxels taken without a word",
            len(taken),
            0,
            "each is an error that names the point" + (f"; taken: {', '.join(taken)}" if taken else ""),
        ),
    ]


CASE = Case(
    "values",
    "Hard values and hard transfer functions",
    "Voxel values are shifted, scaled and quantised on their way to a table: negative ones wrap, a constant "
    "volume divides by an empty range, one NaN spreads over the picture, an unsorted function gives rubbish "
    "without a word. Here the table covers what the function tells apart, voxels without a value are "
    "transparent and counted, two points at one value are a step, and what means nothing is refused.",
    run,
)
