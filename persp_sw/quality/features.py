"""What is known of a frame: before it is drawn what it will ask for, afterwards what it took."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from ..errors import SettingsError
from ..geometry.detail_zones import BEGIN, END
from ..geometry.faces import Face
from ..geometry.sight import EyeGeometry, seen_volume
from ..volume.levels import STANDARD_AXES

# Voxels a pixel beyond which coarser levels of detail take fewer slices: in the middle of their blending in.
COARSER = (BEGIN * END) ** 0.5


@dataclass(frozen=True)
class SceneFeatures:
    """What a frame of all its eyes asks for, at quality 1 and one sample a slice interval.

    Attributes
    ----------
    samples
        That rays take in the box of what can be seen, summed over faces; skipping empty space leaves fewer.
    pixels
        Of all faces.
    faces
        How many.
    scene
        Anything that differs where the scene does (volume, transfer function, regions): what was learnt of
        the old one then counts for little.
    """

    samples: float
    pixels: float
    faces: int = 1
    scene: Hashable = 0

    @property
    def shows_nothing(self) -> bool:
        """Whether no eye sees anything, so that the frame tells nothing of what frames cost."""
        return not (self.samples > 0 and self.pixels > 0)


@dataclass(frozen=True)
class FrameCost:
    """What a frame took, milliseconds; all eyes together.

    Attributes
    ----------
    ms
        Compositing.
    samples, pixels
        Taken and made; 0 where not counted.
    planning_ms
        Besides `ms`: what was spent on knowing the frame's features, which quality does not change. Together
        they have to keep to the budget.
    upload_ms, warp_ms, swap_ms
        What else the target time has to hold; without the wait for the display.

    Raises
    ------
    SettingsError
        A number that is negative or not finite.
    """

    ms: float
    samples: float = 0.0
    pixels: float = 0.0
    planning_ms: float = 0.0
    upload_ms: float = 0.0
    warp_ms: float = 0.0
    swap_ms: float = 0.0

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0 <= value < float("inf"):
                raise SettingsError(f"a frame's {field.name} must be finite and at least 0; given {value!r}")

    @property
    def other_ms(self) -> float:
        """All but compositing and planning."""
        return self.upload_ms + self.warp_ms + self.swap_ms


def features_of(plans: Iterable[tuple[EyeGeometry, Sequence[Face]]], scene: Hashable = 0) -> SceneFeatures:
    """Features of a frame from each eye's geometry and its faces as planned at quality 1."""
    every = [(geometry, face) for geometry, faces in plans for face in faces]
    samples = sum(samples_in_box(geometry, face) for geometry, face in every)
    pixels = sum(face.size[0] * face.size[1] for _, face in every)
    return SceneFeatures(samples, float(pixels), len(every), scene)


def samples_in_box(geometry: EyeGeometry, face: Face) -> float:
    """Samples that a face takes in a box that is seen throughout, one a slice interval or coarser voxel.

    The integral over the slices' distance D of the area that the face sees of a slice, in pixels: an extent
    of x voxels is x / (pitch · D) pixels. Steep rays, which leave the box early, so count for what they take.

    Accuracy: packets of 16 pixels take whole samples at its edges, steep ones twice as many: the count is up
    to twice this, in a ratio that changes slowly as the eye moves.
    """
    pitch = face.pitch
    if geometry.at_infinity:
        return float(np.prod((geometry.high - geometry.low)[list(STANDARD_AXES[face.axis])])) / pitch**2
    low = np.array(face.origin)
    high = low + np.multiply(face.size, pitch)
    distances, shown = seen_volume(geometry, face.axis, face.sign, low, high)
    finer = np.maximum(distances * pitch / COARSER, 1.0)
    return float((shown / finer).sum()) / pitch**2
