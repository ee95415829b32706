"""What cases about compositing alone share: views around a volume, the pixels of their faces, exact pictures.

The pixels of faces tell what compositing does; the warp's own error is not among them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image, Vector
from ...eye_image import EyeImage
from ...geometry.regions import Regions
from ...geometry.view import View
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume.grid import Volume
from ..exact import shown_part
from .face_views import face_view

Array = NDArray[np.float64]

# Along edges, corners and axes of the box, and in between, on all sides.
DIRECTIONS = (
    (0.42, 0.27, 0.87),
    (0.58, 0.55, 0.60),
    (-0.9, 0.3, 0.1),
    (0.1, -1.0, 0.2),
    (-0.5, -0.5, -0.7),
    (1.0, 0.0, 0.0),
    (0.02, 0.999, -0.03),
)


def view_towards(
    volume: Volume,
    towards: Vector,
    size: tuple[int, int],
    distance: float = 1.7,
    fovy_deg: float = 45.0,
) -> View:
    """A camera `distance` longest edges away from a volume's middle, in world direction `towards`."""
    towards = np.asarray(towards, np.float64) / np.linalg.norm(towards)
    up = (0, 1, 0) if abs(towards[1]) < 0.95 else (0, 0, 1)
    eye = volume.centre + distance * max(volume.extent) * towards
    return View.look_at(eye, volume.centre, up, fovy_deg, size)


def composite(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    regions: Regions | None = None,
    **settings: Any,
) -> EyeImage:
    """The eye image of a view, of rays that never stop early unless `settings` say so."""
    renderer = Renderer(volume, transfer, Settings(**{"residual": 0, **settings}), regions)
    return renderer.composite(view.eye, [view.wall])


def faces_of(image: EyeImage) -> Iterator[tuple[Image, View]]:
    """The pixels of each face, and the view they are of."""
    for number in range(len(image.faces)):
        yield image.face_pixels(number), face_view(image, number)


def homogeneous(
    volume: Volume,
    transfer: TransferFunction,
    view: View,
    regions: Regions | None = None,
) -> Array:
    """The exact picture of a volume that has one value: alpha = 1 − exp(−extinction · path length)."""
    value = float(volume.data.flat[0])
    entry, leave = shown_part(volume, view, regions)
    alpha = -np.expm1(-float(transfer.extinction(value)) * (leave - entry))
    return alpha[..., None] * np.append(transfer.colour(value), 1.0)


def rms(difference: NDArray[np.floating]) -> float:
    """Root mean square of all numbers, in float64."""
    return float(np.sqrt(np.mean(np.square(difference, dtype=np.float64))))
