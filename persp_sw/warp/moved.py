"""What both warps draw of an eye image for an eye that has moved since it was made."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Vector
from ..eye_image import EyeImage
from ..geometry.placement import beyond_eye, depth_range, middle_of

Array = NDArray[np.float64]

# Pixels of a face. An eye that has moved by less at the image's distance is its own: hosts tell theirs by
# float32 matrices, and the whole image is exact there and costs a layer instead of several.
_STILL = 1 / 16


def shift_of(image: EyeImage, position: Vector) -> Array:
    """How far (object xyz) an eye at a world position is from the image's own; zeros for that one itself."""
    moved = np.asarray(position, np.float64) - image.eye.position
    return np.linalg.solve(image.world_from_object[:3, :3], moved)


def distance_of(image: EyeImage) -> float:
    """D at which the image lies: where its colours are if that was measured, else its box's middle."""
    if image.depth is not None:
        return image.depth
    faces, box = image.faces, image.box
    if not faces or not np.isfinite(box).all():
        return 1.0
    if faces[0].parallel is not None:
        return faces[0].sign * float(box[:, faces[0].axis].sum()) / 2
    eye = np.linalg.solve(image.world_from_object, np.append(image.eye.position, 1))[:3]
    return middle_of(*depth_range(faces, eye, box))


def distance_for(image: EyeImage, shift: Array) -> float:
    """D at which the image is drawn for an eye that has moved by `shift`."""
    return beyond_eye(distance_of(image), image.faces, shift)


def layers_for(image: EyeImage, shift: Array) -> tuple[EyeImage, ...]:
    """What to lay over one another, the last on top: the image for its own eye, its slabs for a moved one."""
    if not image.slabs:
        return (image,)
    still = _STILL * image.faces[0].pitch * distance_of(image)
    return (image,) if np.abs(shift).max() <= still else image.slabs[::-1]
