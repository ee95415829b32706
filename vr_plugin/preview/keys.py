"""What the preview's keys mean: the one table that the controller obeys and the help shows."""

from __future__ import annotations

from typing import NamedTuple

from ..rig import STEREO_MODES
from ..stereo import MODES

# Rightwards, upwards, backwards.
THRUST_KEYS = {
    "W": (0, 0, -1), "S": (0, 0, 1), "A": (-1, 0, 0), "D": (1, 0, 0), "E": (0, 1, 0), "Q": (0, -1, 0),
}  # fmt: skip
# Rightwards, upwards, and the third direction of a head: forwards is up on the keyboard.
SPIN_KEYS = {
    "RIGHT": (1, 0, 0), "LEFT": (-1, 0, 0), "UP": (0, 1, 0), "DOWN": (0, -1, 0),
    "PAGE_UP": (0, 0, 1), "PAGE_DOWN": (0, 0, -1),
}  # fmt: skip


class Binding(NamedTuple):
    """Keys and what they do.

    Attributes
    ----------
    keys
        Their names, any of which will do.
    shown
        How the help calls them.
    text
        What the help says they do.
    action
        The name of the controller's action. Without keys it is none: what is held, the mouse, and the stereo
        modes, a key for each.
    """

    keys: tuple[str, ...]
    shown: str
    text: str
    action: str = ""


STEREO_KEYS = tuple(str(number) for number in range(1, len(STEREO_MODES) + 1))

BINDINGS = (
    Binding((), "left drag", "orbit; in flight, look around"),
    Binding((), "middle or shift drag", "pan"),
    Binding((), "wheel", "zoom to the pointer, with shift to the pivot; in flight, speed"),
    Binding((), "arrows", "orbit; outside, move the head (page up, down: height)"),
    Binding((), "ctrl drag", "outside: turn the head"),
    Binding(("F",), "F", "fly or orbit", "fly_or_orbit"),
    Binding((), "W A S D Q E", "in flight: move; with shift, faster"),
    Binding(("T",), "T", "turntable or trackball", "turntable_or_trackball"),
    Binding(("R",), "R", "reset the view", "reset"),
    Binding(("TAB",), "Tab", "the room from outside, and back", "next_mode"),
    Binding(("V",), "V", "outside: show the volume itself", "toggle_volume"),
    Binding(("SPACE",), "space", "recorded flight, outside recorded head: on, off", "pause_path"),
    Binding((), "1 2 3 4", ", ".join(MODES[mode] for mode in STEREO_MODES[:4])),
    Binding((), "5 6 7 8", ", ".join(MODES[mode] for mode in STEREO_MODES[4:])),
    Binding(("N",), "N", "next stereo mode", "next_stereo"),
    Binding(("M",), "M", "mono, and back", "toggle_mono"),
    Binding(("X",), "X", "swap the eyes", "swap_eyes"),
    Binding(("]",), "]", "eyes farther apart", "eyes_apart"),
    Binding(("[",), "[", "eyes nearer together", "eyes_together"),
    Binding(("+", "=", "KP_ADD"), "+", "finer pictures, held so", "better"),
    Binding(("-", "KP_SUBTRACT"), "−", "coarser, faster pictures, held so", "faster"),
    Binding(("0",), "0", "quality follows the frame rate again", "release_quality"),
    Binding((".",), ".", "next preset", "next_preset"),
    Binding((",",), ",", "preset before", "previous_preset"),
    Binding((), "ctrl drag", "window (rightwards: wider) and level (upwards: higher)"),
    Binding(("I",), "I or ctrl click", "pick: cursor, value, place; again: distance", "pick"),
    Binding(("C",), "C", "cursor, with planes, off", "next_cursor"),
    Binding(("B",), "B", "bounding box", "toggle_box"),
    Binding(("Y",), "Y", "axes and a patient's letters", "toggle_axes"),
    Binding(("U",), "U", "scale bar", "toggle_scale_bar"),
    Binding(("L",), "L", "colour legend", "toggle_legend"),
    Binding(("P",), "P", "write this picture as PNG", "screenshot"),
    Binding(("F5",), "F5", "save the session: scene, view, look", "save_session"),
    Binding(("F9",), "F9", "record the camera's flight, end it", "record_flight"),
    Binding(("O",), "O", "figures on, off", "toggle_overlay"),
    Binding(("F2",), "F2", "the panel: transfer function, clipping, …", "toggle_panel"),
    Binding(("H", "F1"), "H or F1", "this help", "toggle_help"),
    Binding(("ESCAPE",), "Esc", "leave the help, then the program", "quit"),
)

KEYS = frozenset(THRUST_KEYS) | frozenset(SPIN_KEYS) | frozenset(STEREO_KEYS)
KEYS |= {key for binding in BINDINGS for key in binding.keys}
