"""The warp on the processor."""

from __future__ import annotations

import numpy as np

from .. import _jit
from ..arrays import Image
from ..eye_image import EyeImage
from ..geometry.parallel import Shear
from ..geometry.view import View
from ..kernels.warp import FACE_COLUMNS, warp
from ..volume.levels import STANDARD_AXES


def warp_eye_image(
    eye_image: EyeImage, view: View, threads: int | None = None, out: Image | None = None
) -> Image:
    """The picture of `view` from an eye image composited for walls that include the view's.

    Returns
    -------
    (height, width, 4) float32, linear, premultiplied, row 0 on top, no background; `out` if given.

    Accuracy: the look-up is bilinear; which ray a pixel looks up is exact to float64 for the eye that the
    image was composited for, whatever the pose.
    """
    width, height = view.size
    if out is None:
        out = np.empty((height, width, 4), np.float32)
    if not eye_image.faces:
        out[:] = 0
        return out
    object_from_world = np.linalg.inv(eye_image.world_from_object)
    matrix = object_from_world[:3, :3] @ view.direction_from_pixel
    faces = np.empty((len(eye_image.faces), FACE_COLUMNS))
    face_of = np.full(6, -1, np.int64)
    for number, face in enumerate(eye_image.faces):
        axes, sign = STANDARD_AXES[face.axis], face.sign
        if face.parallel is not None:  # the "direction" of a pixel is (i, j, 1) on slice k = 0
            shear = Shear(face.axis, face.sign, face.parallel)
            matrix, axes, sign = shear.plane_from_pixel(object_from_world, view), (0, 1, 2), 1
        faces[number] = *axes, sign, *face.origin, face.pitch, *face.size, eye_image.offset(number)
        face_of[2 * face.axis + (face.sign > 0)] = number
    if len(eye_image.faces) == 1:
        face_of[:] = 0  # a single face shows all rays
    _jit.set_threads(threads or _jit.max_threads())
    warp(
        np.ascontiguousarray(matrix),
        faces,
        face_of,
        eye_image.pixels,
        _window(eye_image, view),
        out,
    )
    return out


def _window(eye_image: EyeImage, view: View) -> np.ndarray:
    """Columns and rows [begin, end, begin, end] outside of which the faces show nothing."""
    width, height = view.size
    corners = []
    for number, face in enumerate(eye_image.faces):
        (t_i, t_j), (w, h), pitch = face.origin, face.size, face.pitch
        tangents = [(t_i + u * w * pitch, t_j + v * h * pitch, 1.0) for u in (0, 1) for v in (0, 1)]
        corners.append(np.array(tangents) @ eye_image.world_from_tangents(number).T)
    at = view.project(np.concatenate(corners) + view.eye.w * view.eye.position)
    if not np.isfinite(at).all():  # part of a face lies beside or behind the eye
        return np.array([0, width, 0, height])
    low, high = np.floor(at.min(0)), np.ceil(at.max(0))
    size = np.array(view.size)
    low, high = np.clip(low, 0, size).astype(np.int64), np.clip(high, 0, size).astype(np.int64)
    return np.array([low[0], high[0], low[1], high[1]])
