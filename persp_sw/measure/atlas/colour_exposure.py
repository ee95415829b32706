"""Colour exposure: colours that a surface hides, and that show through it all the same.

Where the scalar rises through a thin opaque layer of one colour to what lies behind it in another, a sample
that falls beyond the layer shows the hidden colour. Source of the name: Yuan, *Improved GPU ray casting for
uniform grids*, 2011, section 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume
from . import plain, single_axis
from .case import Finding, Scale, Strip
from .compositing import composite, faces_of, view_towards

# The mean colour of an opaque piece is taken over its first two optical depths, evenly, not weighted by
# exp(−d): behind a layer d deep 1 − d/2 shows instead of exp(−d). They differ most at d = ln 2.
EVEN_WEIGHT = (1 - np.log(2)) / 2
# Where neither is stated: what a plain ray caster with as many samples shows, and half as much again.
PLAIN = 1.5

RED, BLUE = 0, 2
_LAYER = TransferFunction(
    [
        *((80.0, (1, 0, 0), 0.0), (80.0, (1, 0, 0), 1.0)),
        *((110.0, (1, 0, 0), 1.0), (110.0, (0, 0, 1), 1.0)),
        (255.0, (0, 0, 1), 1.0),
    ],
    1.0,
)
# World directions from an edge whose scalar rises along +x: before it, at growing slants.
_BEFORE = ((-1, 0.02, 0.01), (-1, 0.3, 0.2), (-1, 0.7, 0.3), (-0.7, 0.3, 1), (-0.6, 0.6, 0.8), (-0.4, 0.2, 1))


def edge(width: float) -> Volume:
    """8-bit, 13 voxels a side: 0, and 200 beyond an edge across x that is `width` voxels wide."""
    x = np.arange(13)
    rise = np.clip((x - 5.5) / width + 0.5, 0, 1)
    return Volume(np.broadcast_to(np.rint(200 * rise), (13, 13, 13)).astype(np.uint8), name="edge")


def ball(n: int) -> Volume:
    """8-bit: a ball of 200 with a rim two voxels wide."""
    z, y, x = np.indices((n, n, n)) - (n - 1) / 2
    away = np.sqrt(x * x + y * y + z * z) - 0.36 * n
    return Volume(np.rint(200 * np.clip(0.5 - away / 2, 0, 1)).astype(np.uint8), name="ball")


def _surplus(picture: NDArray[np.floating], truth: NDArray[np.floating]) -> NDArray[np.floating]:
    """Of each pixel that the surface covers, how much more of the hidden colour shows than should."""
    covered = truth[..., 3] > 0.99
    return np.maximum((picture - truth)[..., BLUE], 0)[covered]


def exposure_findings(scale: Scale) -> list[Finding]:
    """The hidden colour's surplus behind plane edges, and on a ball beside a plain ray caster's."""
    size = scale.pick((32, 24), (96, 72))
    across, along, along_casts, finer, strips = [], [], [], [], []
    published: dict[bool, list[NDArray[np.floating]]] = {True: [], False: []}  # whether across the slices
    for width in scale.pick((1, 3), (1, 2, 3)):
        volume = edge(width)
        for towards in _BEFORE:
            view = view_towards(volume, towards, size, 1.7, 25.0)
            twice = composite(volume, _LAYER, view, samples_per_interval=2, preintegrated=True)
            finer += [
                _surplus(picture, reference.render(volume, _LAYER, rays)).max(initial=0.0)
                for (picture, rays), face in zip(faces_of(twice), twice.faces, strict=True)
                if face.axis != 0
            ]
            image = composite(volume, _LAYER, view)
            for (picture, rays), face in zip(faces_of(image), image.faces, strict=True):
                truth = reference.render(volume, _LAYER, rays)
                if face.axis == 0:
                    across.append(_surplus(picture, truth).max(initial=0.0))
                    continue
                surplus = _surplus(picture, truth)
                if not surplus.size:  # a face that shows the surface's rim alone
                    continue
                cast = plain.cast(volume, _LAYER, rays)
                along.append(surplus.mean())
                along_casts.append(_surplus(cast, truth).mean())
                label = f"a layer along the slices, edge {width} wide, from {towards}"
                strips.append(Strip(label, picture, truth.astype(np.float32), gain=1.0))
            found = single_axis.composite(volume, _LAYER, view)
            truth = reference.render(volume, _LAYER, found.rays)
            published[found.axis == 0].append(_surplus(found.pixels, truth))
    worst = strips[int(np.argmax(along))]
    strips = []
    volume = ball(scale.pick(25, 49))
    view = view_towards(volume, (0.42, 0.27, 0.87), scale.pick((48, 48), (128, 128)))
    ours, casts = [], []
    for picture, rays in faces_of(composite(volume, _LAYER, view)):
        truth = reference.render(volume, _LAYER, rays)
        surplus = _surplus(picture, truth)
        if not surplus.size:
            continue
        cast = plain.cast(volume, _LAYER, rays)
        ours.append(surplus)
        casts.append(_surplus(cast, truth))
        strips += [
            Strip(f"a hidden colour: {name}", shown, truth.astype(np.float32), gain=1.0)
            for name, shown in (("ours", picture), ("plain ray caster", cast))
        ]
    ((pixels, rays),) = single_axis.faces_of(volume, _LAYER, view)
    exposed = _surplus(pixels, reference.render(volume, _LAYER, rays)).mean()
    return [
        Finding(
            "colour exposure: most hidden colour through an edge across the slices",
            float(max(across)),
            EVEN_WEIGHT,
            "(1 − ln 2) / 2: an opaque piece's colour is that of its first two optical depths, evenly",
            single_axis=float(max(surplus.max(initial=0.0) for surplus in published[True])),
        ),
        Finding(
            "colour exposure: mean hidden colour through an edge along the slices, worst view",
            float(max(along)),
            PLAIN * float(max(along_casts)),
            "1.5 × a plain ray caster; a piece sees the values of the cell in its middle only",
            strips=(worst,),
            ray_caster=float(max(along_casts)),
            single_axis=float(max(surplus.mean() for surplus in published[False] if surplus.size)),
        ),
        Finding(
            "colour exposure: most hidden colour through an edge along them, two pre-integrated samples",
            float(max(finer)),
            EVEN_WEIGHT,
            "3/8 voxel behind a cell's border may be missed, 0.15 voxel or more of a layer is left: an "
            "optical depth of 2: (1 − ln 2) / 2, as across the slices",
        ),
        Finding(
            "colour exposure: mean hidden colour on a ball",
            float(np.concatenate(ours).mean()),
            PLAIN * float(np.concatenate(casts).mean()),
            "1.5 × a plain ray caster",
            strips=strips,
            ray_caster=float(np.concatenate(casts).mean()),
            single_axis=float(exposed),
        ),
    ]
