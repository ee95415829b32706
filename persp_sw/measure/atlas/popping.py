"""Whether a frame of a path stands out, and whether a seam does."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...arrays import Image
from ...geometry.faces import Face
from ...geometry.view import View
from ...volume.grid import Volume
from .case import Strip

Array = NDArray[np.floating]

_NEARBY = 6  # pixels from a seam within which neighbours are compared with those across it
_ENOUGH = 64  # pairs of pixels that make a mean


def changes(errors: Sequence[Array]) -> NDArray[np.float64]:
    """(n − 1,): how much a picture's error changes from frame to frame, rms over pixels and channels."""
    return np.array([np.sqrt(np.mean((b - a) ** 2)) for a, b in pairwise(errors)])


def popping(errors: Sequence[Array], frames: int | None = None) -> float:
    """The largest change of the error image between frames over the median: 1 if none stands out.

    frames: the median is of that many changes about each; None: of all.
    """
    change = changes(errors)
    if frames is None or frames >= len(change):
        return float((change / np.median(change)).max())
    windows = np.lib.stride_tricks.sliding_window_view(change, frames)
    first = np.clip(np.arange(len(change)) - frames // 2, 0, len(windows) - 1)
    return float((change / np.median(windows, axis=1)[first]).max())


def strips_of_pop(label: str, pictures: Sequence[Image], truths: Sequence[Array]) -> list[Strip]:
    """The two frames between which the error changes most; beside the second, that change."""
    errors = [picture - truth for picture, truth in zip(pictures, truths, strict=True)]
    at = int(np.argmax(changes(errors)))
    before, after = at, at + 1
    change = np.abs(errors[after] - errors[before])
    return [
        Strip(f"{label}: before", pictures[before], truths[before]),
        Strip(f"{label}: after, and the error's change", pictures[after], truths[after], change),
    ]


def faces_of(faces: Sequence[Face]) -> frozenset[tuple[int, int]]:
    """Which principal directions: (axis, sign)."""
    return frozenset((face.axis, face.sign) for face in faces)


def owners(view: View, volume: Volume) -> NDArray[np.intp]:
    """(h, w): number 0 … 5 of the face that owns a pixel's ray, where several faces share a view."""
    directions = view.directions() @ np.linalg.inv(volume.world_from_object[:3, :3]).T
    axis = np.abs(directions).argmax(-1)
    along = np.take_along_axis(directions, axis[..., None], -1)[..., 0]
    return 2 * axis + (along > 0)


def seam_steps(
    error: Array, owner: NDArray[np.intp], seen: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Squared steps of the error between neighbouring pixels: of two faces, and of one face's near by.

    Parameters
    ----------
    error
        (h, w, 4), picture less truth.
    owner
        (h, w), see `owners`.
    seen
        (h, w): pixels that count.
    """
    across, beside = [], []
    seam = np.zeros(owner.shape, bool)
    seam[:-1] |= owner[:-1] != owner[1:]
    seam[:, :-1] |= owner[:, :-1] != owner[:, 1:]
    near = _grown(seam, _NEARBY)
    for axis in (0, 1):
        e, o, s, n = (np.swapaxes(a, 0, axis) for a in (error, owner, seen, near))
        step = np.mean((e[1:] - e[:-1]) ** 2, axis=-1)
        both, crosses = s[1:] & s[:-1], o[1:] != o[:-1]
        across.append(step[both & crosses])
        beside.append(step[both & ~crosses & n[1:] & n[:-1]])
    return np.concatenate(across), np.concatenate(beside)


def seam_contrast(steps: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> float:
    """The error's step across seams, rms, over that beside them, of several pictures together.

    1 where a seam cannot be told from what is beside it; NaN where too little of any is in the pictures.
    """
    one, other = (np.concatenate(each) for each in zip(*steps, strict=True))
    if min(one.size, other.size) < _ENOUGH:
        return float("nan")
    return float(np.sqrt(one.mean() / other.mean()))


def _grown(mask: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    """The pixels within `by` rows and columns of those set."""
    for axis in (0, 1):
        padded = np.pad(mask, [(by, by) if n == axis else (0, 0) for n in (0, 1)])
        mask = np.any(np.lib.stride_tricks.sliding_window_view(padded, 2 * by + 1, axis), -1)
    return mask
