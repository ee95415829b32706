"""A clip plane that moves slowly: the picture follows it evenly, and does not step from slice to slice."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...arrays import Image, Vector
from ...geometry.regions import Regions
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from . import plain, single_axis
from .case import Finding, Scale, Strip
from .compositing import rms, view_towards

# As the atlas asks of eyes that cross an axis switch: no frame stands out by more.
STANDS_OUT = 1.5

_HAZE = TransferFunction([(0, (0.2, 0.4, 0.9), 0.0), (255, (1.0, 0.7, 0.4), 0.3)], 1.0)
_OPAQUE = TransferFunction(
    [
        (0, (0.1, 0.1, 0.6), 0.0),
        (60, (0.2, 0.4, 0.9), 0.9),
        (140, (0.3, 0.9, 0.4), 0.99),
        (255, (1, 0.5, 0.2), 0.99),
    ],
    1.0,
)
_NORMALS = {"along slices": (0.0, 0.0, 1.0), "slanted": (0.3, -0.2, 0.93)}
_TOWARDS = (0.25, 0.2, 1.0)


class _Steps(NamedTuple):
    """Frame-to-frame changes of a picture, rms over its pixels: the largest, and against their median."""

    largest: float
    stands_out: float


def field(n: int) -> Volume:
    """Smooth waves of some twelve voxels."""
    z, y, x = np.indices((n, n, n))
    waves = np.sin(0.5 * x) * np.cos(0.4 * y) * np.sin(0.5 * z + 0.7)
    return Volume((130 + 110 * waves).astype(np.float32), name="waves")


def _regions(volume: Volume, normal: Vector, depth: float) -> Regions:
    """What lies behind a plane across `normal` (towards the eye), `depth` voxels before the middle."""
    normal = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    return Regions(clip=[(*-normal, float(normal @ volume.centre) + depth)])


def _steps(pictures: list[NDArray[np.floating]]) -> _Steps:
    changes = [rms(after - before) for before, after in pairwise(pictures)]
    most, median = max(changes), float(np.median(changes))
    return _Steps(most, most / median if median else np.inf)  # from slice to slice most frames change nothing


def moving_findings(scale: Scale) -> list[Finding]:
    """A haze and opaque colours, cut by planes along the slices and slanted ones."""
    volume = field(scale.pick(25, 41))
    view = view_towards(volume, _TOWARDS, scale.pick((40, 32), (96, 80)), 1.7, 44.0)
    depths = np.arange(0, scale.pick(2.01, 4.01), scale.pick(1 / 8, 1 / 16))
    found = []
    for look, transfer in (("haze", _HAZE), ("opaque colours", _OPAQUE)):
        for name, normal in _NORMALS.items():
            renderer = Renderer(volume, transfer, Settings(residual=0))
            ours: list[Image] = []
            truths, casts, published = [], [], []
            for depth in depths:
                renderer.regions = _regions(volume, normal, float(depth))
                ours.append(renderer.render(view))
                truths.append(reference.render(volume, transfer, view, regions=renderer.regions))
                casts.append(plain.cast(volume, transfer, view, renderer.regions))
                published.append(single_axis.render(volume, transfer, view, renderer.regions))
            step, truth, cast, single = map(_steps, (ours, truths, casts, published))
            middle = len(depths) // 2
            strip = Strip(f"{look}, a plane {name}", ours[middle], truths[middle].astype(np.float32))
            found += [
                Finding(
                    f"a moving plane {name}, {look}: largest change in a frame over the reference's",
                    step.largest / truth.largest,
                    STANDS_OUT,
                    "no frame stands out by more than 1.5 ×; a plane that steps by slices has as many × as "
                    "there are frames a slice",
                    strips=(strip,),
                    ray_caster=cast.largest / truth.largest,
                    single_axis=single.largest / truth.largest,
                ),
                Finding(
                    f"a moving plane {name}, {look}: largest change over the median one",
                    step.stands_out,
                    STANDS_OUT * truth.stands_out,
                    "1.5 × the reference's",
                    ray_caster=cast.stands_out,
                    single_axis=single.stands_out,
                ),
            ]
    return found
