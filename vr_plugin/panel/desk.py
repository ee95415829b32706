"""All that the panel's controls change, without the controls: each is a call that a program can make, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import persp_sw as psw

from .shape_edit import ShapeEdit
from .tf_edit import TransferEdit

if TYPE_CHECKING:
    from ..preview.choices import Choices
    from ..preview.pictures import PreviewPictures


class Desk:
    """A preview under edit.

    Parameters
    ----------
    choices
        The preview's; what is edited here is `Choices.edits`, and keys may change them meanwhile.
    pictures
        For the scene's own regions, and presets' transfer functions.

    Attributes
    ----------
    edit, shapes
        The transfer function under the user's hand: one of values, and one of values and gradient magnitudes.
        Each has a history of its own; the one that is shown is `editor`.
    """

    def __init__(self, choices: Choices, pictures: PreviewPictures):
        self.choices, self._pictures = choices, pictures
        self.volume: psw.Volume = pictures.renderer.volume
        self._lighting = psw.Lighting()  # what light comes back to
        low, high = map(float, self.volume.value_range)
        half = float(psw.largest_magnitude(self.volume)) / 2  # what hardly a volume reaches
        shown, named = self.transfer, [name for name in choices.presets if name is not None]
        plane = shown if self.is_2d else _first_shapes(low, high, half)
        if self.is_2d:
            ramp = psw.window_level((low + high) / 2, (high - low) or 1.0)
            shown = pictures.transfer_of(named[0]) if named else ramp
        self.edit = TransferEdit(shown, (low, high))
        self.shapes = ShapeEdit(plane, (low, high, half))

    # --- the transfer function -----------------------------------------------------------------------------

    @property
    def transfer(self) -> psw.TransferFunction | psw.TransferFunction2D:
        """As it is shown."""
        return self.choices.edits.transfer or self._pictures.transfer_of(self.choices.preset)

    @property
    def is_2d(self) -> bool:
        """Whether what is shown depends on gradient magnitudes, too."""
        return isinstance(self.transfer, psw.TransferFunction2D)

    @property
    def editor(self) -> TransferEdit | ShapeEdit:
        """Of what is shown."""
        return self.shapes if self.is_2d else self.edit

    def show_2d(self, plane: bool) -> None:
        """Show the function of values and gradient magnitudes, or that of values alone, as it was left."""
        transfer = self.shapes.transfer if plane else self.edit.transfer
        self.choices.edits = replace(self.choices.edits, transfer=transfer)

    def take_over(self) -> None:
        """Let the editor know what keys have changed: another preset is a step that can be undone."""
        if self.editor.transfer is not self.transfer:
            dragged = "window" if self.choices.window else None  # level and width: a drag is one step
            self.editor.apply(self.transfer, dragged)

    def hand_over(self) -> None:
        """Show what the editor has."""
        if self.editor.transfer is not self.transfer:
            self.choices.edits = replace(self.choices.edits, transfer=self.editor.transfer)

    @property
    def preset(self) -> str:
        """The name of the preset that is shown unchanged; "edited", or "the scene's own"."""
        for name in self.choices.presets:
            if self._pictures.is_known(name) and self.transfer is self._pictures.transfer_of(name):
                return self.called(name)
        return "edited"

    @staticmethod
    def called(preset: str | None) -> str:
        """A preset for people."""
        return "the scene's own" if preset is None else preset

    def choose_preset(self, name: str | None) -> None:
        """A preset's transfer function, as a step that can be undone."""
        transfer = self._pictures.transfer_of(name)
        self.choices.edits = replace(self.choices.edits, transfer=transfer)
        self.take_over()

    @property
    def target_hz(self) -> float:
        """The frame rate that quality follows; 0: none."""
        asked = self.choices.edits.target_hz
        return self._pictures.target_hz if asked is None else asked

    # --- light ---------------------------------------------------------------------------------------------

    @property
    def look(self) -> psw.Look:
        """How it is lit."""
        return self.choices.edits.look or self._pictures.scene_look

    def set_look(self, look: psw.Look) -> None:
        """Light it otherwise; the same look is no edit."""
        if look != self.look:
            self.choices.edits = replace(self.choices.edits, look=look)

    def reset_look(self) -> None:
        """The scene's own."""
        self.choices.edits = replace(self.choices.edits, look=None)

    def shade(self, lit: bool) -> None:
        """Light it as it was lit last, or at first by a headlight; or not at all."""
        if lit == (self.look.lighting is not None):
            return
        if not lit:
            self._lighting = self.look.lighting
        self.set_look(replace(self.look, lighting=self._lighting if lit else None))

    def set_lighting(self, **changes: Any) -> None:
        """Other fields of the `Lighting`, which must be on."""
        self.set_look(replace(self.look, lighting=replace(self.look.lighting, **changes)))

    def set_light(self, number: int, light: psw.Light | None) -> None:
        """Another light in the place of one; None removes it; the number after the last adds one."""
        lights = list(self.look.lighting.lights)
        lights[number : number + 1] = [] if light is None else [light]
        self.set_lighting(lights=tuple(lights))

    def modulate(self, modulation: psw.Modulation | None) -> None:
        """Show more of boundaries, or all as the transfer function has it."""
        self.set_look(replace(self.look, modulation=modulation))

    # --- regions -------------------------------------------------------------------------------------------

    @property
    def regions(self) -> psw.Regions:
        """Which part is shown."""
        return self.choices.edits.regions or self._pictures.scene_regions

    def set_regions(self, regions: psw.Regions) -> None:
        """Show another part; the same one is no edit."""
        if regions != self.regions:
            self.choices.edits = replace(self.choices.edits, regions=regions)

    def reset_regions(self) -> None:
        """The scene's own."""
        self.choices.edits = replace(self.choices.edits, regions=None)

    @property
    def crop(self) -> tuple[float, ...]:
        """x0, x1, y0, y1, z0, z1 in voxel index: the whole box where nothing is cropped."""
        if self.regions.crop is not None:
            return self.regions.crop
        return tuple(end for count in self.volume.size for end in (0.0, count - 1.0))

    def set_crop(self, side: int, value: float) -> None:
        """One of the crop box's six sides, voxel index; no farther than the opposite side and the volume."""
        crop, axis = list(self.crop), side // 2
        low = crop[side - 1] if side % 2 else 0.0
        high = self.volume.size[axis] - 1.0 if side % 2 else crop[side + 1]
        crop[side] = float(np.clip(value, low, max(low, high)))
        self.set_regions(replace(self.regions, crop=crop))

    def add_clip(self, normal: Sequence[float]) -> int:
        """A plane through the middle of the volume that hides what is against its normal; its number."""
        normal = np.asarray(normal, np.float64) / np.linalg.norm(normal)
        plane = (*normal.tolist(), -float(normal @ self.volume.centre))
        self.set_regions(replace(self.regions, clip=(*self.regions.clip, plane)))
        return len(self.regions.clip) - 1

    def set_clip(self, number: int, plane: Sequence[float]) -> None:
        """Another plane (nx, ny, nz, d) in the place of a clip plane."""
        clip = list(self.regions.clip)
        clip[number] = tuple(plane)
        self.set_regions(replace(self.regions, clip=tuple(clip)))

    def remove_clip(self, number: int) -> None:
        """One clip plane less."""
        clip = [plane for n, plane in enumerate(self.regions.clip) if n != number]
        self.set_regions(replace(self.regions, clip=tuple(clip)))


def _first_shapes(low: float, high: float, top: float) -> psw.TransferFunction2D:
    """What a first 2D function shows: boundaries of the brighter values, and no inside."""
    colour = (0.9, 0.55, 0.25)
    across, up = (high - low) or 1.0, top or 1.0
    box = psw.Box((low + 0.25 * across, low + 1.05 * across), (0.08 * up, 0.6 * up), colour, 0.3)
    return psw.TransferFunction2D([box])
