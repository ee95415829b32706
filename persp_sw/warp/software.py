"""The warp on the processor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import _jit
from ..arrays import Image, Matrix
from ..errors import ViewError
from ..eye_image import EyeImage
from ..geometry.faces import Face
from ..geometry.parallel import Shear
from ..geometry.view import View
from ..kernels.warp import warp
from ..volume.levels import STANDARD_AXES
from .canvas import Canvas


def warp_eye_image(
    eye_image: EyeImage, view: View, threads: int | None = None, out: Image | Canvas | None = None
) -> Image:
    """The picture of `view` from an eye image composited for walls that include the view's.

    Returns
    -------
    (height, width, 4) float32, linear, premultiplied, row 0 on top, no background: of `out`, if given. A loop
    that draws on one `Canvas` clears no more than the picture before had drawn.

    Raises
    ------
    ViewError
        `out` has another size than the view.

    Accuracy: the look-up is bilinear; which ray a pixel looks up is exact to float64 for the eye that the
    image was composited for, whatever the pose.
    """
    width, height = view.size
    canvas = Canvas(width, height) if out is None else out
    if not isinstance(canvas, Canvas):
        canvas = Canvas.over(canvas)
    pixels = canvas.pixels
    if pixels.shape != (height, width, 4) or pixels.dtype != np.float32 or not pixels.flags.c_contiguous:
        raise ViewError(
            f"the view needs {height} rows of {width} pixels of 4 float32, contiguous; given "
            f"{pixels.dtype} {pixels.shape}"
        )
    if not eye_image.faces:
        pixels[:] = 0
        canvas.written[:] = 0
        return pixels
    object_from_world = np.linalg.inv(eye_image.world_from_object)
    faces = eye_image.faces
    _jit.set_threads(threads or _jit.max_threads())
    warp(
        np.array([_face_from_view(face, object_from_world, view) for face in faces]),
        np.array([_borders(face, len(faces), object_from_world, view) for face in faces]),
        np.array([(*face.size, eye_image.offset(number)) for number, face in enumerate(faces)]),
        eye_image.pixels,
        canvas.written,
        pixels,
    )
    return pixels


def _face_from_view(face: Face, object_from_world: Matrix, view: View) -> Matrix:
    """(3, 3): pixel point (column, row, 1) of the view to (u, v, 1) of the face up to a positive factor.

    Pixel centres of the face are whole numbers.
    """
    if face.parallel is not None:
        shear = Shear(face.axis, face.sign, face.parallel)
        tangents = shear.plane_from_pixel(object_from_world, view)
    else:
        direction = object_from_world[:3, :3] @ view.direction_from_pixel
        tangents = direction[list(STANDARD_AXES[face.axis])]
        tangents[2] *= face.sign
    (t_i, t_j), pitch = face.origin, face.pitch
    pixel_from_tangents = np.array(
        [[1 / pitch, 0, -t_i / pitch - 0.5], [0, 1 / pitch, -t_j / pitch - 0.5], [0, 0, 1]]
    )
    return pixel_from_tangents @ tangents


def _borders(face: Face, count: int, object_from_world: Matrix, view: View) -> NDArray[np.float64]:
    """(m, 3): the face shows pixel points p with b·p ≥ 0; a single face shows all rays it holds.

    Of several each shows the rays whose largest component is its own.
    """
    if count == 1:
        return np.empty((0, 3))
    direction = object_from_world[:3, :3] @ view.direction_from_pixel
    i, j, k = STANDARD_AXES[face.axis]
    along = face.sign * direction[k]
    return np.array([along - direction[i], along + direction[i], along - direction[j], along + direction[j]])
