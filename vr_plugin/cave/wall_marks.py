"""Marks on all walls of a rig, and what its wand picks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import persp_sw as psw

from ..frame import Picture
from ..loop import Loop
from ..marks.marking import Marking
from ..marks.shown import ShownMarks

_WORDS_BELOW = 40  # pixels, from a picked point to what is said of it


class WallMarks:
    """The marks that walls show.

    Parameters
    ----------
    loop
        Whose walls; its wand, if it has one, picks.
    choice
        To start with; of what stands in the world.
    background
        (3,) linear, behind the volume.

    Attributes
    ----------
    marking
        The marks as they are now.

    Raises
    ------
    PerspSWError
        A scale bar or a legend, which belong to a screen.
    """

    def __init__(self, loop: Loop, choice: psw.marks.MarkChoice, background: Sequence[float] = (0, 0, 0)):
        if choice.scale_bar or choice.legend:
            raise psw.PerspSWError(
                "walls show neither scale bar nor legend, which belong to a screen: leave --scale-bar and "
                "--legend out, or use `persp-sw view`"
            )
        self._loop, renderer = loop, loop.renderer
        self._shown = ShownMarks(renderer, psw.marks.Palette.over(background))
        self.marking = Marking(choice, renderer.volume)
        self._picks = 0

    def follow(self) -> None:
        """Pick where the wand points, if it has been asked to since the last time; once a frame."""
        wand = self._loop.wand
        if wand is None or wand.picks == self._picks:
            return
        self._picks = wand.picks
        ray = wand.ray_in_world
        if ray is not None:
            shown = self._loop.renderer
            probe = psw.Probe(shown.volume, shown.transfer, self._loop.regions, shown.look)
            self.marking.take(probe.first_hit(*ray))

    def seen(self, picture: Picture) -> psw.marks.Veiled | None:
        """The marks in a wall's picture for an eye; None if there are none."""
        choice, words = self.marking.choice, None
        if choice.cursor is not None and self.marking.picked:
            palette = self._shown.palette
            label = psw.marks.Label(
                np.array(choice.cursor),
                self.marking.picked.replace(", ", "\n"),
                palette.ink,
                palette.halo,
                (0, _WORDS_BELOW),
                veiled=False,
            )
            words = psw.marks.Marks(labels=[label])
        return self._shown.seen(choice, picture.view, words)
