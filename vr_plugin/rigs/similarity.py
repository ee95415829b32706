"""Similarities, rigid motions with one scale, as people write them: shifted, axes renamed, turned, scaled."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..pose import rotation_of, turn_about

_UP = (0.0, 1.0, 0.0)
AXES = ("x", "y", "z", "-x", "-y", "-z")


def similarity(
    position: Sequence[float] = (0, 0, 0),
    axes: Sequence[str] = ("x", "y", "z"),
    turn: float = 0.0,
    scale: float = 1.0,
) -> np.ndarray:
    """(4, 4) target_from_source: axes renamed, then scaled and turned about the target's y, then shifted.

    Parameters
    ----------
    position
        Where the source's origin is, in the target.
    axes
        Which source axis the target's x, y and z are: ("x", "z", "-y") takes a source whose z is up.
    turn
        Degrees about the target's y axis, by the right hand: seen from above, to the left.
    scale
        Target units in a source unit.

    Raises
    ------
    ValueError
        Axes that are none, or name one twice.
    """
    matrix = np.eye(4)
    renamed = np.zeros((3, 3))
    for row, name in enumerate(axes):
        if name not in AXES:
            raise ValueError(f"{name!r} is no axis; there are {', '.join(AXES)}")
        renamed[row, "xyz".index(name[-1])] = -1 if name[0] == "-" else 1
    if len(axes) != 3 or abs(np.linalg.det(renamed)) < 0.5:
        raise ValueError(f"three axes, one of each of x, y and z; given {list(axes)}")
    matrix[:3, :3] = scale * (_turn(turn) @ renamed)
    matrix[:3, 3] = position
    return matrix + 0.0  # without negative zeros


def parts_of(matrix: np.ndarray) -> dict[str, object] | None:
    """What `similarity` makes exactly this matrix of, in round numbers; None where nothing does."""
    linear = matrix[:3, :3]
    scale = _round(float(np.cbrt(np.linalg.det(linear))))
    for axes in (("x", "y", "z"), ("x", "z", "-y"), ("-x", "z", "y"), ("y", "z", "x"), ("-y", "z", "-x")):
        unturned = similarity(axes=axes, scale=scale)[:3, :3]
        turned = linear @ np.linalg.inv(unturned)
        turn = _round(float(np.degrees(np.arctan2(turned[0, 2], turned[0, 0]))))
        parts = {"position": matrix[:3, 3].tolist(), "axes": list(axes), "turn": turn, "scale": scale}
        if np.array_equal(similarity(**parts), matrix):
            return parts
    return None


def flaw_of(matrix: np.ndarray) -> str | None:
    """Why a (4, 4) matrix is no similarity, to 1 part in 1000; None where it is one."""
    linear = matrix[:3, :3]
    if not np.array_equal(matrix[3], (0, 0, 0, 1)):
        return f"the last row is 0, 0, 0, 1, not {', '.join(f'{v:g}' for v in matrix[3])}: give it row by row"
    lengths = np.linalg.norm(linear, axis=0)
    if lengths.min() <= 1e-9 * lengths.max():
        return "it is singular: it flattens everything"
    scale = lengths.mean()
    if np.abs(linear.T @ linear / scale**2 - np.eye(3)).max() > 2e-3:
        return "it stretches or shears; only a turn, a shift and one scale keep distances in proportion"
    if np.linalg.det(linear) < 0:
        return "it mirrors, so left and right would change places; reverse one axis"
    return None


def _turn(degrees: float) -> np.ndarray:
    if degrees % 90 == 0:  # exact
        cosine, sine = ((1, 0), (0, 1), (-1, 0), (0, -1))[int(degrees // 90) % 4]
        return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]], np.float64)
    return rotation_of(turn_about(_UP, np.radians(degrees)))


def _round(value: float) -> float:
    return float(f"{value:.9g}") + 0.0
