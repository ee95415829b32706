"""A view as another program has it, matrices and a viewport, and as we have it: an eye and a wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import persp_sw as psw
from persp_sw.errors import ViewError

# Farther than so many times the volume's size, an eye counts as at infinity: rays through the volume are then
# parallel to 1e-8.
_INFINITELY_FAR = 1e8
_SINGULAR = 1e-12
_CORNERS = ((-1, -1), (1, -1), (-1, 1))  # lower left, lower right, upper left


@dataclass(frozen=True, eq=False)
class HostView:
    """One view of a host: what an OpenGL program gives its vertex shaders, and how large the picture is.

    Parameters
    ----------
    clip_from_view
        (4, 4) projection, column vectors: `M @ p`. Perspective, however off-axis, or parallel; with any near
        and far plane, an infinite far plane too.
    view_from_host
        (4, 4) view matrix: from the space of the host's scene.
    pixels
        Width and height of the viewport.
    reversed_depth
        Whether the host's nearer depths are the greater ones. Asked in parallel views only: nothing else
        tells from which side one looks.

    Attributes
    ----------
    clip_from_host
        (4, 4), their product.

    Raises
    ------
    ViewError
        Something else than two (4, 4) matrices of finite numbers, or a transposed view matrix.
    """

    clip_from_view: np.ndarray
    view_from_host: np.ndarray
    pixels: tuple[int, int]
    reversed_depth: bool = False

    def __post_init__(self):
        for name in ("clip_from_view", "view_from_host"):
            object.__setattr__(self, name, matrix_of(getattr(self, name), name))
        view = self.view_from_host
        if np.array_equal(view[:3, 3], (0, 0, 0)) and view[3, :3].any():
            raise ViewError(
                f"view_from_host is transposed: its shift {view[3, :3].tolist()} is in the last row; "
                "matrices here multiply column vectors, so give both as matrix.T"
            )

    @property
    def clip_from_host(self) -> np.ndarray:
        """(4, 4): projection × view."""
        return self.clip_from_view @ self.view_from_host


def matrix_of(given: Sequence[Sequence[float]] | np.ndarray, name: str) -> np.ndarray:
    """A (4, 4) float64 matrix of finite numbers of its own; ViewError where it is none."""
    try:
        matrix = np.array(given, np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise ViewError(f"{name} is a (4, 4) matrix of finite numbers; given {given!r}")
    return matrix


def seen_in_world(
    view: HostView, host_from_world: np.ndarray, volume: psw.Volume, near: float = 0.0
) -> psw.View:
    """The same view in the volume's world: the same pixels show the same points.

    Parameters
    ----------
    host_from_world
        (4, 4) affine: where the volume stands in the host's scene.
    near
        World distance before the eye in which nothing is shown; an eye at infinity has none.

    Returns
    -------
    Its eye is the perspective centre, the point that all rays through the window's pixels have in common:
    the null vector of the projection's rows x, y and w. Its wall is the whole viewport, at the distance of
    the volume's middle; that changes no pixel.

    Raises
    ------
    ViewError
        Matrices that flatten space, or a viewport of no pixels.

    Accuracy: that of the matrices; float64 ones give pixels to 1e-9, float32 ones to some 1e-3, for a volume
    in the middle of the picture.

    Source: Schulze, Niemeier, Lang 2001, where the eye is M⁻¹ · (0, 0, −1, 0). Their third row is left out
    here for it may be next to singular where near and far lie far apart.
    """
    clip = view.clip_from_host @ host_from_world
    x, y, depth, w = clip
    centre, reach = volume.centre, float(np.linalg.norm(volume.extent)) or max(volume.spacing)
    at_centre = float(w[:3] @ centre + w[3])
    if not w.any():
        raise ViewError(_flat(clip))
    if np.linalg.norm(w[:3]) * reach * _INFINITELY_FAR <= abs(at_centre):
        return _from_infinity(view, np.array([x, y, depth]) / at_centre, at_centre, centre)
    linear, shift = np.array([x[:3], y[:3], w[:3]]), np.array([x[3], y[3], w[3]])
    if not abs(np.linalg.det(linear)) > _SINGULAR * np.linalg.norm(linear, axis=1).prod():
        raise ViewError(_flat(clip))
    rays = np.linalg.inv(linear)
    eye = -rays @ shift
    # rays @ (x, y, 1) leads to where w is 1: in front, where OpenGL shows things.
    distance = max(float(np.linalg.norm(centre - eye)), 1e-3 * reach) / np.linalg.norm(rays[:, 2])
    corners = (eye + distance * rays @ (*corner, 1.0) for corner in _CORNERS)
    return psw.View(psw.Eye(eye, near), psw.Wall(*corners, pixels=view.pixels))


def _from_infinity(view: HostView, affine: np.ndarray, w: float, centre: np.ndarray) -> psw.View:
    """From normalised device coordinates as an affine map (3, 4) of the world."""
    if w < 0:
        raise ViewError("this parallel projection has w < 0: OpenGL shows nothing of it; give it times −1")
    across, up, away = affine[:, :3]
    towards = np.cross(across, up)
    scale = np.linalg.norm(across) * np.linalg.norm(up)
    slope = float(away @ towards)
    if not np.linalg.norm(towards) > _SINGULAR * scale or slope == 0:
        raise ViewError(_flat(affine))
    if (slope > 0) != view.reversed_depth:
        towards = -towards
    window = affine[:2, :3]
    at_centre = window @ centre + affine[:2, 3]
    lift = np.linalg.pinv(window)
    corners = (centre + lift @ (np.array(corner) - at_centre) for corner in _CORNERS)
    return psw.View(psw.Eye.at_infinity(towards), psw.Wall(*corners, pixels=view.pixels))


def _flat(clip: np.ndarray) -> str:
    return (
        f"projection × view is singular, it flattens space: {clip.tolist()}; give the projection matrix and "
        "the view matrix that the host draws with"
    )
