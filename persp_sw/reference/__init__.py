"""The float64 ray caster that judges everything else.

It shares no kernel and no factorization with what it judges, and has no sampling distance: along a ray the
interpolated scalar is a cubic polynomial inside each cell, so every ray is cut where it crosses a voxel plane
and where the scalar crosses a control point of the transfer function. On each piece that remains extinction
and colour are smooth, and Gauss's rule, halved until nothing changes, converges fast; a step of the transfer
function falls between pieces and cannot be missed, however thin the shell it lights. Where gradients count,
for lights, modulation or a two-dimensional function, a caster of its own cuts rays where they bend, too.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._jit import max_threads, set_threads
from ..errors import SettingsError
from ..geometry.regions import Regions
from ..geometry.view import View
from ..optics.look import Look
from ..optics.transfer import TransferFunction
from ..optics.transfer2d import TransferFunction2D
from ..volume.grid import Volume
from ._gradients import gradients
from ._lit import caster
from ._plain import MAX_HALVINGS, cast_band, pieces_of
from ._rays import CHANGE, DEPTH, STATES, Rays, Shown, planes_of, rays_of

__all__ = ["MAX_HALVINGS", "Convergence", "gradients", "render", "render_with_report"]

_PIXELS_A_BAND = 8192  # between two calls of `progress`


@dataclass(frozen=True)
class Convergence:
    """How far a reference picture had settled.

    Attributes
    ----------
    tolerance
        What was asked for.
    worst_change
        Largest sum, over all pieces of one ray, of the change that the last halving made to the pixel's RGBA.
        The rule is of sixth order, so the error left is usually far below it.
    unconverged
        Pixels whose sum still exceeds the tolerance.
    """

    tolerance: float
    worst_change: float
    unconverged: int


def render(
    volume: Volume,
    transfer: TransferFunction | TransferFunction2D,
    view: View,
    *,
    regions: Regions | None = None,
    look: Look | None = None,
    tolerance: float = 1e-5,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> NDArray[np.float64]:
    """The converged picture of a volume: emission and absorption along the ray of every pixel centre.

    Parameters
    ----------
    volume
        Any voxel type and any affine pose. Nothing lies outside the box of voxel centres; a cell (8 voxels)
        with a NaN corner is transparent; a volume one voxel thick along an axis gives an empty picture.
    transfer
        Scalars are interpolated trilinearly, then classified, with a 2D function by the length of their
        gradient too. Opacities without a unit hold over the volume's smallest spacing.
    view
        The eye may stand anywhere, inside the volume too; its near distance is measured along the ray.
    regions
        Crop, clip planes and slabs; None: the whole volume. What is cut away casts no shadow; gradients are
        the whole volume's.
    look
        Lights and modulation; None: neither.
    tolerance
        Largest change of a pixel's RGBA that one more halving of all its pieces may make, 1e-12 … 0.1.
    threads
        1 … the processor's cores; None: all. The picture does not depend on it.
    progress
        Called as progress(rows done, rows, "reference") between bands of rows, where Ctrl-C works too.

    Returns
    -------
    (height, width, 4) float64, linear, premultiplied, row 0 on top, without background.

    Warns
    -----
    RuntimeWarning
        Some pixels have not converged; `render_with_report` tells how many without warning.

    Raises
    ------
    SettingsError
        Tolerance or threads out of range.

    Accuracy
    --------
    Each pixel within about `tolerance`, usually 1e-3 of it; never better than about 1e-12. A ray stops at
    transmittance 1e-9. Takes 4 bytes a voxel besides the volume.

    Lit, modulated and 2D pictures: rays are cut where the gradient bends, too. What else the gradient decides
    has no closed form: a highlight or a window of magnitudes that a ray passes within an eighth of a cell may
    be missed. A shadow is a ray of its own for every place, settled to a 32nd of the tolerance; a sharp edge
    of one, on something seen through, may cost a 70th of a cell's light. Such pictures take minutes where
    much is seen through: keep them small.

    Source: Max, *Optical models for direct volume rendering*, 1995, section 4; the rule on a piece is the
    three-stage Gauss method, Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, II.7.
    """
    image, convergence = render_with_report(
        volume,
        transfer,
        view,
        regions=regions,
        look=look,
        tolerance=tolerance,
        threads=threads,
        progress=progress,
    )
    if convergence.unconverged:
        warnings.warn(
            f"{convergence.unconverged} pixels of the reference picture have not converged to {tolerance:g}; "
            f"the worst still changed by {convergence.worst_change:.1g}",
            RuntimeWarning,
            stacklevel=2,
        )
    return image


def render_with_report(
    volume: Volume,
    transfer: TransferFunction | TransferFunction2D,
    view: View,
    *,
    regions: Regions | None = None,
    look: Look | None = None,
    tolerance: float = 1e-5,
    threads: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> tuple[NDArray[np.float64], Convergence]:
    """As `render`, and how far the picture had settled."""
    if not 1e-12 <= tolerance <= 0.1:
        raise SettingsError(f"tolerance lies between 1e-12 and 0.1; given {tolerance!r}")
    if threads is not None and not 1 <= threads <= max_threads():
        raise SettingsError(f"threads lies between 1 and {max_threads()}; given {threads!r}")
    regions = regions or Regions()
    width, height = view.size
    states = np.zeros((height, width, STATES))
    if min(volume.size) > 1:
        set_threads(threads or max_threads())
        _cast_in_bands(volume, transfer, look or Look(), view, regions, tolerance, states, progress)
    change = states[..., CHANGE]
    report = Convergence(tolerance, float(change.max()), int(np.count_nonzero(change > tolerance)))
    image = states[..., :4].copy()
    image[..., 3] = -np.expm1(-states[..., DEPTH])
    return image, report


def _cast_in_bands(volume, transfer, look, view, regions, tolerance, states, progress) -> None:
    height, width, _ = states.shape
    transfer = transfer.with_unit(min(volume.spacing))
    data = volume.data.astype(np.float32, copy=False)  # exact for all voxel types, and one kernel for all
    shown = Shown(*planes_of(regions, volume), regions.crop_flags)
    rays = rays_of(view, volume)
    if look.is_plain and isinstance(transfer, TransferFunction):
        table, unit = pieces_of(transfer), transfer.opacity_unit

        def cast(part: Rays, into: NDArray[np.float64]) -> None:
            cast_band(data, part, shown, table, unit, float(tolerance), into)
    else:
        cast = caster(volume, data, transfer, look, shown, float(tolerance))
    rows = max(1, _PIXELS_A_BAND // width)
    for first in range(0, height, rows):
        last = min(first + rows, height)
        cast(rays.part(first * width, last * width), states[first:last].reshape(-1, STATES))
        if progress is not None:
            progress(last, height, "reference")
