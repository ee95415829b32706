"""What eyes see of marks through the volume of a renderer, whoever draws them."""

from __future__ import annotations

import persp_sw as psw


class ShownMarks:
    """What the pictures of a renderer show of a choice of marks.

    Parameters
    ----------
    renderer
        Of the pictures; its transfer function and regions may change.
    palette
        Colours of marks.
    """

    def __init__(self, renderer: psw.Renderer, palette: psw.marks.Palette):
        self.renderer, self.palette = renderer, palette
        self._probe: psw.Probe | None = None

    @property
    def probe(self) -> psw.Probe:
        """Of what the renderer shows now."""
        probe, shown = self._probe, self.renderer
        if probe is None or (probe.transfer, probe.regions, probe.look) != (
            shown.transfer,
            shown.regions,
            shown.look,
        ):
            # Steps of a voxel, not half: marks err by a few steps of the screen, in half the time.
            self._probe = psw.Probe.of(self.renderer, step=min(self.renderer.volume.spacing))
        return self._probe

    def seen(
        self, choice: psw.marks.MarkChoice, view: psw.View, more: psw.marks.Marks | None = None
    ) -> psw.marks.Veiled | None:
        """What of the choice stands in the world, and `more`, as a view shows it; None for nothing."""
        if not choice and more is None:
            return None
        marks = choice.in_world(self.renderer.volume, self.palette)
        return psw.marks.veil(marks if more is None else marks + more, view, self.probe)
