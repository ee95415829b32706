"""Sheets one voxel thin, seen at all angles from along their normal to along the sheet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import reference
from ...arrays import Vector
from ...optics.transfer import TransferFunction
from ...volume.grid import Volume
from . import plain, single_axis
from .case import Finding, Scale, Strip
from .compositing import composite, faces_of, rms, view_towards

# Where neither is stated: what a plain ray caster with as many samples shows, and half as much again.
PLAIN = 1.5
# Samples s voxels apart along the normal sum a tent of one voxel's half width with a relative error of up to
# 2·sinc²(1/s), rms √2·sinc²(1/s), of either sign with where they fall. A sheet across a diagonal, seen along
# it, has √3 voxels between two samples: one an interval, and the interval is √3 long.
FAINT = float(np.sqrt(2) * np.sinc(1 / np.sqrt(3)) ** 2)
# The same of a picture's sum: some hundred places where a ray may meet the sheet, and of them the mean.
FAINT_BRIGHTNESS = FAINT / np.sqrt(100)

WHITE = (1.0, 0.95, 0.9)


class _Errors(NamedTuple):
    """Relative errors: of the summed opacity, and of the pixels, rms over that of the picture."""

    brightness: float
    rms: float


def sheet(n: int, normal: Vector) -> Volume:
    """8-bit: a sheet through the middle, a tent of one voxel's half width along its normal."""
    normal = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    z, y, x = np.indices((n, n, n)) - (n - 1) / 2
    away = np.abs(normal[0] * x + normal[1] * y + normal[2] * z)
    return Volume(np.rint(255 * np.maximum(1 - away, 0)).astype(np.uint8), name="sheet")


def _towards(normal: Vector, angle_deg: float) -> NDArray[np.float64]:
    """A direction at an angle to the normal, turned to a side that is along no axis."""
    normal = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    aside = np.cross(normal, (0.5, -0.3, 0.81))
    aside = aside / np.linalg.norm(aside)
    return np.cos(np.radians(angle_deg)) * normal + np.sin(np.radians(angle_deg)) * aside


def _errors(pictures: list[NDArray[np.floating]], truths: list[NDArray[np.floating]]) -> _Errors:
    """Of all faces of a view together: one beside the sheet may show next to nothing of it."""
    picture, truth = (np.concatenate([face.reshape(-1, 4) for face in faces]) for faces in (pictures, truths))
    return _Errors(abs(float(picture[:, 3].sum() / truth[:, 3].sum()) - 1), rms(picture - truth) / rms(truth))


def sheet_findings(scale: Scale) -> list[Finding]:
    """The worst angle of a faint sheet and of an opaque one."""
    angles = scale.pick((0, 45, 80, 89), (0, 15, 30, 40, 45, 50, 60, 70, 80, 85, 89))
    normals = scale.pick(((0, 0, 1), (1, 2, 2)), ((0, 0, 1), (1, 2, 2), (1, 0, 1), (1, 1, 1)))
    n, size = scale.pick((25, (32, 32)), (33, (64, 64)))
    found = []
    for name, opacity in (("faint", 0.02), ("opaque", 0.99)):
        transfer = TransferFunction([(0, WHITE, 0.0), (255, WHITE, opacity)], 1.0)
        ours, casts, published, strips = [], [], [], []
        for normal in normals:
            volume = sheet(n, normal)
            for angle in angles:
                view = view_towards(volume, _towards(normal, angle), size, 1.7, 25.0)
                faces = list(faces_of(composite(volume, transfer, view)))
                pictures = [picture for picture, _ in faces]
                truths = [reference.render(volume, transfer, rays) for _, rays in faces]
                ours.append(_errors(pictures, truths))
                casts.append(_errors([plain.cast(volume, transfer, rays) for _, rays in faces], truths))
                largest = max(range(len(faces)), key=lambda n: pictures[n].size)
                truth = truths[largest].astype(np.float32)
                strips.append(Strip(f"{name} sheet {normal} at {angle}°", pictures[largest], truth))
                faces = single_axis.faces_of(volume, transfer, view)
                pictures, views = zip(*faces, strict=True)
                published.append(_errors(pictures, [reference.render(volume, transfer, v) for v in views]))
        worst = int(np.argmax([error.rms for error in ours]))
        own, cast, single = (
            _Errors(*(max(each) for each in zip(*of, strict=True))) for of in (ours, casts, published)
        )
        found.append(
            Finding(
                f"{name} sheets one voxel thin: relative rms error at the worst angle",
                own.rms,
                FAINT if name == "faint" else PLAIN * cast.rms,
                "√2·sinc²(1/√3): samples √3 voxels apart on a tent, along a diagonal"
                if name == "faint"
                else "1.5 × a plain ray caster",
                strips=(strips[0], strips[worst]),
                ray_caster=cast.rms,
                single_axis=single.rms,
            )
        )
        found.append(
            Finding(
                f"{name} sheets one voxel thin: error of the summed opacity at the worst angle",
                own.brightness,
                FAINT_BRIGHTNESS if name == "faint" else max(PLAIN * cast.brightness, FAINT_BRIGHTNESS),
                "√2·sinc²(1/√3), over the √100 of its phases in a picture"
                + ("" if name == "faint" else ", or 1.5 × a plain ray caster"),
                ray_caster=cast.brightness,
                single_axis=single.brightness,
            )
        )
    return found
