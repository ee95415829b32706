"""What hands do with marks: toggles, picks, distances, window and level."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import persp_sw as psw

# A drag over the picture's height makes a window so many times wider, and shifts it by so many of its widths.
_WIDER_PER_HEIGHT = 8.0
_LEVELS_PER_HEIGHT = 1.0
_NARROWEST = 1e-6  # of the volume's values


class Marking:
    """The marks that are shown, and what changes them.

    Parameters
    ----------
    choice
        To start with.
    volume
        That is marked. None: nothing can be picked or windowed.
    probe
        Asked for what picks, of what is shown now, at every pick.
    transfer
        Asked for the transfer function that is shown now, whose window a first drag starts from.

    Attributes
    ----------
    choice
        As it is now.
    picked
        What was picked last, and how far from the pick before, for people; "" before the first.
    """

    def __init__(
        self,
        choice: psw.marks.MarkChoice | None = None,
        volume: psw.Volume | None = None,
        probe: Callable[[], psw.Probe] | None = None,
        transfer: Callable[[], psw.TransferFunction] | None = None,
    ):
        self.choice = choice or psw.marks.MarkChoice()
        self.picked = ""
        self._volume, self._probe, self._transfer = volume, probe, transfer
        self._point = self.choice.cursor

    def toggle_box(self) -> None:
        """Show or hide the bounding box."""
        self.choice = replace(self.choice, box=not self.choice.box)

    def toggle_axes(self) -> None:
        """Show or hide the axes and a patient's letters."""
        self.choice = replace(self.choice, axes=not self.choice.axes)

    def toggle_scale_bar(self) -> None:
        """Show or hide the scale bar."""
        self.choice = replace(self.choice, scale_bar=not self.choice.scale_bar)

    def toggle_legend(self) -> None:
        """Show or hide the colour legend."""
        self.choice = replace(self.choice, legend=not self.choice.legend)

    def next_cursor(self) -> None:
        """A cursor where it was last, or in the volume's middle; with planes; none, and no distance."""
        if self.choice.cursor is None:
            if self._point is None and self._volume is not None:
                self._point = tuple(self._volume.centre.tolist())
            self.choice = replace(self.choice, cursor=self._point, planes=False)
        elif not self.choice.planes:
            self.choice = replace(self.choice, planes=True)
        else:
            self.choice = replace(self.choice, cursor=None, planes=False, ruler=None)
            self.picked = ""

    def pick(self, view: psw.View, pixel: tuple[float, float]) -> str:
        """Set the cursor to what is seen at a pixel, and a ruler from the pick before; says what it is."""
        return self.take(self._probe().pick(view, pixel) if self._probe is not None else None)

    def take(self, pick: psw.Pick | None) -> str:
        """As `pick`, of what a ray has met."""
        if pick is None:
            return "nothing is solid enough here to be picked"
        before = self._point if self.picked and self.choice.cursor is not None else None
        self._point = at = tuple(pick.position_world.tolist())
        self.choice = replace(self.choice, cursor=at, ruler=None if before is None else (before, at))
        marks, unit = psw.marks, psw.marks.unit_of(self._volume)
        said = [
            f"value {marks.short(pick.value)}",
            f"at {marks.position_text(self._volume, at)}",
            f"depth {marks.length_text(pick.distance, unit)}",
        ]
        if before is not None:
            distance = sum((a - b) ** 2 for a, b in zip(at, before, strict=True)) ** 0.5
            said.append(f"distance {marks.length_text(distance, unit)}")
        self.picked = ", ".join(said)
        return self.picked

    def window_after(
        self, window: tuple[float, float] | None, rightwards: float, upwards: float
    ) -> tuple[float, float]:
        """Level and width after a drag, in heights of the picture; None: from what is shown now."""
        low, high = (0.0, 1.0) if self._volume is None else self._volume.value_range
        extent = (high - low) or 1.0
        if window is None:
            window = (low + high) / 2, extent
            transfer = None if self._transfer is None else self._transfer()
            if isinstance(transfer, psw.TransferFunction):
                window = psw.window_of(transfer)
        level, width = window
        width = min(max(width, _NARROWEST * extent), 10 * extent)
        level = min(max(level + upwards * _LEVELS_PER_HEIGHT * width, low - extent), high + extent)
        return level, min(max(width * _WIDER_PER_HEIGHT**rightwards, _NARROWEST * extent), 10 * extent)
