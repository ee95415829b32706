"""What the preview's keys switch: stereo, quality, preset, texts. Actions are named as in `keys.BINDINGS`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import persp_sw as psw

from ..rig import STEREO_MODES
from ..stereo import Stereo, without_quad_buffers
from .edits import Edits

QUALITY_STEP = 2**0.5
QUALITIES = (0.1, 8.0)
SEPARATION_STEP = 1.2
SEPARATIONS = (0.002, 0.2)
# Of the distance to the pivot: what is infinitely far is then 1/30 of it beyond the screen plane, which most
# people can fuse.
SEPARATION = 1 / 30
MESSAGE_SECONDS = 4.0


class Choices:
    """The user's choices, and the actions that change them.

    Parameters
    ----------
    presets, preset
        Names that the preset keys go through; the one to start with, or None for a transfer function of the
        scene's own, which then is one more.
    quality, stereo
        To start with.
    follows
        Whether there is a frame rate that quality can follow: then it does so, unless it is held.
    held
        Whether it is held from the start.

    Attributes
    ----------
    drawn_quality
        Of the last picture; who draws says so.
    stereo, separation, quality, preset, overlay, help, volume_outside, message
        As in `Wanted`; `stereo` as chosen, whether the screen can show it or not.
    panel
        Whether the panel is shown, where there is a window.
    edits
        What has been edited; replaced by another whenever something is.
    quad_buffers
        Whether the screen can show quad-buffered stereo; where not, mono is wanted instead.
    screenshots, sessions
        How often a picture, and a session file, has been asked for.
    """

    def __init__(
        self,
        presets: Sequence[str | None] = (),
        preset: str | None = None,
        quality: float = 1.0,
        stereo: str = "mono",
        *,
        follows: bool = False,
        held: bool = False,
    ):
        self._presets = list(dict.fromkeys([preset, *presets]))
        self.preset, self.drawn_quality = preset, quality
        self._fixed, self._free = quality, None if follows else quality
        self.quality = quality if held else self._free
        self.stereo, self.separation = Stereo(stereo), SEPARATION
        self.overlay, self.help, self.volume_outside = True, False, True
        self.panel, self.edits = False, Edits()
        self.quad_buffers = False
        self.screenshots = self.sessions = 0
        self._window: tuple[tuple[float, float], psw.TransferFunction] | None = None
        self.message, self._message_seconds = "", 0.0

    @property
    def presets(self) -> list[str | None]:
        """The names that preset keys go through; None: the scene's own transfer function."""
        return list(self._presets)

    @property
    def window(self) -> tuple[float, float] | None:
        """Level and width of a grey ramp in place of the preset; None: another function is shown."""
        if self._window is None or self.edits.transfer is not self._window[1]:
            return None
        return self._window[0]

    @window.setter
    def window(self, level_and_width: tuple[float, float]) -> None:
        self._window = level_and_width, psw.window_level(*level_and_width)
        self.edits = replace(self.edits, transfer=self._window[1])

    @property
    def possible_stereo(self) -> Stereo:
        """What the screen can show of the stereo mode."""
        if self.stereo.mode != "quad" or self.quad_buffers:
            return self.stereo
        return replace(self.stereo, mode=without_quad_buffers("quad"))

    def say(self, text: str) -> None:
        """Show the user a line for a few seconds."""
        self.message, self._message_seconds = text, MESSAGE_SECONDS

    def say_missing_quad_buffers(self) -> str:
        """Say so where quad-buffered stereo is wanted and the screen has none; "" where all is well."""
        if self.possible_stereo is self.stereo:
            return ""
        self.say("no quad-buffered stereo on this screen: mono is shown instead")
        return self.message

    def advance(self, seconds: float) -> bool:
        """Let time pass; whether something ran out."""
        if not self.message:
            return False
        self._message_seconds -= seconds
        if self._message_seconds > 0:
            return False
        self.message = ""
        return True

    def toggle_help(self) -> None:
        """Show or hide the keys."""
        self.help = not self.help

    def toggle_overlay(self) -> None:
        """Show or hide the figures."""
        self.overlay = not self.overlay

    def toggle_panel(self) -> None:
        """Show or hide the panel."""
        self.panel = not self.panel

    def screenshot(self) -> None:
        """Ask for a picture on disk."""
        self.screenshots += 1

    def save_session(self) -> None:
        """Ask for a session file."""
        self.sessions += 1

    def set_stereo(self, mode: str) -> None:
        """Choose one of `STEREO_MODES`; swapped eyes stay so."""
        self.stereo = Stereo(mode, self.stereo.swapped)
        self.say_missing_quad_buffers()

    def next_stereo(self) -> None:
        """The stereo mode that follows."""
        self.set_stereo(self.stereo.next_mode(STEREO_MODES).mode)

    def toggle_mono(self) -> None:
        """Mono, or back to stereo."""
        self.stereo = self.stereo.flatten()

    def swap_eyes(self) -> None:
        """Exchange the eyes."""
        self.stereo = self.stereo.swap()

    def eyes_apart(self) -> None:
        """More depth."""
        self.separation = min(self.separation * SEPARATION_STEP, SEPARATIONS[1])

    def eyes_together(self) -> None:
        """Less depth."""
        self.separation = max(self.separation / SEPARATION_STEP, SEPARATIONS[0])

    def hold_quality(self, quality: float | None) -> None:
        """Pictures of this quality and no others; None: it follows the frame rate, if it can."""
        self.quality = self._free if quality is None else float(min(max(quality, QUALITIES[0]), QUALITIES[1]))

    def follow_rate(self, target_hz: float) -> None:
        """Quality follows that frame rate from now on; 0: it is what it was at first."""
        self.edits = replace(self.edits, target_hz=target_hz)
        self._free = None if target_hz else self._fixed
        self.release_quality()

    def better(self) -> None:
        """Finer pictures than the last, and no others."""
        self._hold(QUALITY_STEP)

    def faster(self) -> None:
        """Coarser pictures than the last, and no others."""
        self._hold(1 / QUALITY_STEP)

    def release_quality(self) -> None:
        """Quality follows the frame rate again; where there is none, it is what it was at first."""
        self.quality = self._free

    def _hold(self, factor: float) -> None:
        now = self.drawn_quality if self.quality is None else self.quality
        self.hold_quality(now * factor)

    def _step_preset(self, step: int) -> None:
        place = self._presets.index(self.preset) + step
        self.preset = self._presets[place % len(self._presets)]
        self.edits = replace(self.edits, transfer=None)

    def next_preset(self) -> None:
        """The transfer function that follows."""
        self._step_preset(1)

    def previous_preset(self) -> None:
        """The transfer function before."""
        self._step_preset(-1)

    def toggle_volume(self) -> None:
        """Show or hide the volume itself in the view from outside."""
        self.volume_outside = not self.volume_outside
