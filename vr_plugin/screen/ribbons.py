"""Lines as ribbons of triangles, equally wide near and far. Plain numpy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def clipped(clip_from_space: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(..., 4) clip positions of points (..., 3)."""
    return points @ clip_from_space[:, :3].T + clip_from_space[:, 3]


# Of a segment's two triangles: which end, which side.
CORNERS = ((0, -1), (1, -1), (1, 1), (0, -1), (1, 1), (0, 1))


def ribbons(
    clip_from_space: np.ndarray,
    segments: np.ndarray,
    viewport: Sequence[int],
    half: float | np.ndarray,
    cap: float = 1.0,
) -> np.ndarray:
    """(6 n, 6): two triangles for each segment before the near plane: clip position, pixels off its line.

    `cap`: how far they go beyond their ends, as a share of half their width.
    """
    ends = clipped(clip_from_space, segments)
    before = ends[..., 2] + ends[..., 3]  # 0 on the near plane
    ends, before = ends[(before > 0).any(1)], before[(before > 0).any(1)]
    if not len(ends):
        return np.empty((0, 6))
    change = before[:, 1] - before[:, 0]
    part = np.clip(-before[:, 0] / np.where(change == 0, 1, change), 0, 1)[:, None]
    cut = ends[:, 0] + part * (ends[:, 1] - ends[:, 0])
    for end in (0, 1):
        ends[:, end] = np.where(before[:, [end]] < 0, cut, ends[:, end])
    pixels = np.asarray(viewport, np.float64) / 2
    w = np.maximum(ends[..., 3:], np.finfo(np.float64).tiny)
    on_screen = ends[..., :2] / w * pixels
    along = on_screen[:, 1] - on_screen[:, 0]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(length > 1e-9, along / np.maximum(length, 1e-9), [1.0, 0.0])
    across = np.stack([-along[:, 1], along[:, 0]], -1)
    reach = half + 1  # a pixel for the smooth edge
    vertices = []
    for end, side in CORNERS:
        corner = on_screen[:, end] + side * reach * across + (2 * end - 1) * cap * half * along
        xy = corner / pixels * w[:, end]
        off = np.broadcast_to(side * reach, (len(xy), 1))
        vertices.append(np.concatenate([xy, ends[:, end, 2:], off, np.zeros_like(off)], 1))
    return np.stack(vertices, 1).reshape(-1, 6)
