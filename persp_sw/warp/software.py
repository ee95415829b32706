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
from ..geometry.view import Eye, View
from ..kernels.warp import warp
from ..volume.levels import STANDARD_AXES
from .canvas import Canvas
from .moved import distance_for, layers_for, shift_of

# Components of unit vectors: two computations of one direction differ by rounding.
_SAME_DIRECTION = 1e-9


def warp_eye_image(
    eye_image: EyeImage, view: View, threads: int | None = None, out: Image | Canvas | None = None
) -> Image:
    """The picture of `view` from an eye image composited for walls that include the view's.

    The view's eye may have moved since: then the image is where `moved` places it, and its slabs, if it has
    any, are laid one over the other.

    Returns
    -------
    (height, width, 4) float32, linear, premultiplied, row 0 on top, no background: of `out`, if given. A loop
    that draws on one `Canvas` clears no more than the picture before had drawn.

    Raises
    ------
    ViewError
        `out` has another size than the view; or the rays of either eye are parallel and it is another one:
        what is infinitely far away does not move, composite anew.

    Accuracy: the look-up is bilinear; which ray a pixel looks up is exact to float64 for the eye that the
    image was composited for, whatever the pose. See `docs/rewarp.md` for one that has moved.
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
    shift = _shift(eye_image, view.eye)
    if not eye_image.faces:
        pixels[:] = 0
        canvas.written[:] = 0
        return pixels
    _jit.set_threads(threads or _jit.max_threads())
    lowest, *others = layers_for(eye_image, shift)
    _draw(lowest, view, shift, canvas)
    for layer in others:
        _draw(layer, view, shift, canvas.spare)
        canvas.lay_over(canvas.spare)
    return pixels


def _shift(image: EyeImage, eye: Eye) -> NDArray[np.float64]:
    """How far (object xyz) the eye has moved since."""
    if not (image.eye.is_at_infinity or eye.is_at_infinity):
        return shift_of(image, eye.position)
    if image.eye.w != eye.w or np.abs(image.eye.position - eye.position).max() > _SAME_DIRECTION:
        raise ViewError(
            "an eye image of parallel rays serves no other eye, nor one of an eye at a point parallel rays: "
            f"it was made for {image.eye.position.tolist()} (w = {image.eye.w:g}), the view is of "
            f"{eye.position.tolist()} (w = {eye.w:g}); composite anew"
        )
    return np.zeros(3)


def _draw(image: EyeImage, view: View, shift: NDArray[np.float64], canvas: Canvas) -> None:
    """One image without its slabs."""
    object_from_world = np.linalg.inv(image.world_from_object)
    faces = image.faces
    distance = distance_for(image, shift) if shift.any() else None
    rays = [_tangents(face, object_from_world, view, shift, distance) for face in faces]
    borders = [_borders(image, face, object_from_world, view, shift, distance) for face in faces]
    shown, inner = (np.array(planes) for planes in zip(*borders, strict=True))
    warp(
        np.array([_pixel_from_tangents(face) @ matrix for face, matrix in zip(faces, rays, strict=True)]),
        shown,
        inner,
        np.array(rays),
        image.alone,
        np.array([(*face.size, image.offset(number)) for number, face in enumerate(faces)]),
        image.pixels,
        canvas.written,
        canvas.pixels,
    )


def _pixel_from_tangents(face: Face) -> Matrix:
    """(3, 3): (t_i, t_j, 1) to (u, v, 1) of the face, whose pixel centres are whole numbers."""
    (t_i, t_j), pitch = face.origin, face.pitch
    return np.array([[1 / pitch, 0, -t_i / pitch - 0.5], [0, 1 / pitch, -t_j / pitch - 0.5], [0, 0, 1]])


def _tangents(
    face: Face, object_from_world: Matrix, view: View, shift: NDArray[np.float64], distance: float | None
) -> Matrix:
    """(3, 3): pixel point (column, row, 1) of the view to tangents (t_i, t_j, 1), up to a positive factor.

    With a distance D: those at which the image's eye sees what the view's, δ away, sees in the face's plane
    there. Its ray e + δ + λ·d meets that at λ = (D − δ_k) / d_k, so t = (δ·d_k + (D − δ_k)·d) / (D·d_k),
    where k counts along the face's sign.
    """
    if face.parallel is not None:
        shear = Shear(face.axis, face.sign, face.parallel)
        return shear.plane_from_pixel(object_from_world, view)
    axes = list(STANDARD_AXES[face.axis])
    tangents = (object_from_world[:3, :3] @ view.direction_from_pixel)[axes]
    tangents[2] *= face.sign
    if distance is None:
        return tangents
    across, along = shift[axes[:2]], face.sign * shift[axes[2]]
    tangents[:2] = np.outer(across, tangents[2]) + (distance - along) * tangents[:2]
    tangents[2] *= distance
    return tangents


def _borders(
    image: EyeImage,
    face: Face,
    object_from_world: Matrix,
    view: View,
    shift: NDArray[np.float64],
    distance: float | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m, 3) each: the face shows pixel points p with b·p ≥ 0, and alone where b·p ≥ 0 of the second, too.

    One of several shows rays with tangents up to 1 / c, see `seams`, and alone those up to c. What one shows
    alone ends where another begins: the same numbers with opposite signs. A single face shows all rays it
    holds. To an eye that has moved, faces side by side lie at different places once they are extended beyond
    their seam: all is mixed, by the tangents that each finds.
    """
    if len(image.faces) == 1:
        return np.empty((0, 3)), np.empty((0, 3))
    c = image.alone
    direction = object_from_world[:3, :3] @ view.direction_from_pixel
    i, j, k = STANDARD_AXES[face.axis]
    along = face.sign * direction[k]
    if distance is None:
        beside = np.array([direction[i], -direction[i], direction[j], -direction[j]])
        return along - c * beside, c * along - beside
    reach = distance - face.sign * shift[k]
    shown = [
        (distance - c * sign * shift[axis]) * along - c * reach * (sign * direction[axis])
        for axis in (i, j)
        for sign in (1, -1)
    ]
    return np.array(shown), np.tile([0.0, 0.0, -1.0], (4, 1))
