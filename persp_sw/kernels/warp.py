"""The software warp: faces of an eye image to the pixels of a view."""

import numpy as np

from .._jit import kernel, parallel_kernel, prange

_F = np.float32

# Columns of `faces`, one row for each face.
AXIS_I, AXIS_J, AXIS_K, SIGN, ORIGIN_I, ORIGIN_J, PITCH, WIDTH, HEIGHT, OFFSET = range(10)
FACE_COLUMNS = 10


@kernel
def _owner(x, y, z, face_of):
    """The face that shows direction (x, y, z): −1 if none does."""
    axis = 0
    largest = abs(x)
    along = x
    if abs(y) > largest:
        axis, largest, along = 1, abs(y), y
    if abs(z) > largest:
        axis, along = 2, z
    return face_of[2 * axis + (1 if along > 0.0 else 0)]


@parallel_kernel
def warp(matrix, faces, face_of, pixels, window, out):
    """Look every pixel's ray up in the face that owns it, bilinearly; nothing outside the faces.

    Parameters
    ----------
    matrix
        float64 (3, 3): object-space direction of the ray through pixel point (column, row, 1).
    faces
        float64 (n, FACE_COLUMNS): object axes that are standard i, j and k; direction along k; tangents of
        the image's corner; pitch; width, height and first pixel of the face in `pixels`.
    face_of
        int64 (6,): face for the rays whose largest component is along −x, +x, −y, +y, −z, +z; −1: none.
    pixels
        float32 (total, 4): the faces' pixels, row by row.
    window
        int64 [first column, end column, first row, end row]: outside it, all is transparent.
    out
        float32 (height, width, 4), overwritten.
    """
    for row in prange(out.shape[0]):
        if row < window[2] or row >= window[3]:
            out[row] = _F(0.0)
            continue
        out[row, : window[0]] = _F(0.0)
        out[row, window[1] :] = _F(0.0)
        y = row + 0.5
        for column in range(window[0], window[1]):
            x = column + 0.5
            dx = matrix[0, 0] * x + matrix[0, 1] * y + matrix[0, 2]
            dy = matrix[1, 0] * x + matrix[1, 1] * y + matrix[1, 2]
            dz = matrix[2, 0] * x + matrix[2, 1] * y + matrix[2, 2]
            for channel in range(4):
                out[row, column, channel] = _F(0.0)
            number = _owner(dx, dy, dz, face_of)
            if number < 0:
                continue
            face = faces[number]
            axis_i, axis_j, axis_k = face[AXIS_I], face[AXIS_J], face[AXIS_K]
            along = face[SIGN] * (dx if axis_k == 0 else dy if axis_k == 1 else dz)
            if along <= 0.0:
                continue
            across_i = dx if axis_i == 0 else dy if axis_i == 1 else dz
            across_j = dx if axis_j == 0 else dy if axis_j == 1 else dz
            u = (across_i / along - face[ORIGIN_I]) / face[PITCH] - 0.5
            v = (across_j / along - face[ORIGIN_J]) / face[PITCH] - 0.5
            width, height = np.int64(face[WIDTH]), np.int64(face[HEIGHT])
            if not (u >= 0.0 and v >= 0.0 and u <= width - 1 and v <= height - 1):
                continue
            left, top = min(np.int64(u), width - 2), min(np.int64(v), height - 2)
            fu, fv = _F(u - left), _F(v - top)
            at = np.uint64(np.int64(face[OFFSET]) + top * width + left)
            below = at + np.uint64(width)
            for channel in range(4):
                a = pixels[at, channel]
                a += fu * (pixels[at + np.uint64(1), channel] - a)
                b = pixels[below, channel]
                b += fu * (pixels[below + np.uint64(1), channel] - b)
                out[row, column, channel] = a + fv * (b - a)
