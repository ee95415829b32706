"""The preview's controller: keys, mouse and time go in, what is to be drawn comes out. No window, no pixels.

Events have the names and units of a window's: pixels from its upper left corner, keys by what is printed on
them ("A", "1", "F1", "TAB", "LEFT", …). So tests drive it as a hand would.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

import persp_sw as psw

from ..cameras import Camera
from ..eyes import eyes_of_head
from ..film.flight import Flight
from ..marks.marking import Marking
from ..pose import Pose, Vector
from ..rig import STEREO_MODES, Rig
from ..stereo import in_eyes_picture
from .choices import SEPARATION, Choices
from .flights import Flights
from .keys import BINDINGS, SPIN_KEYS, STEREO_KEYS, THRUST_KEYS
from .navigation import STYLES, Navigator
from .wanted import Wanted

HEAD_SPEED = 0.6  # metres a second
FAST = 4.0  # times that, and flights, while shift is held
UP_IN_ROOM = np.array([0.0, 1.0, 0.0])


@dataclass
class _Hand:
    """What the user holds down."""

    keys: set[str] = field(default_factory=set)
    button: str | None = None
    pointer: tuple[float, float] = (0.0, 0.0)
    pressed_at: tuple[float, float] | None = None
    shift: bool = False
    control: bool = False


class Preview:
    """What a preview shows, and how keys and mouse change it.

    Parameters
    ----------
    home
        The camera to start with, in the volume's world.
    up, extent
        Upwards in the world, and how large the volume is there.
    size
        Of the window, pixels.
    rig
        The room of the outside view; None: there is no such view.
    outside_home
        The outside view's camera, in the room.
    head_at
        A recorded head: its pose in the room at so many seconds of the recording. None: keys move the head.
    choices
        Of stereo, quality and preset to start with.
    flight
        One that the camera follows at the start, until a hand takes it.
    marking
        Marks to start with, and what picks; None: none, and nothing can be picked.

    Attributes
    ----------
    choices, marking
        As keys have changed them since.
    inside
        The camera in the volume's world, in hand.
    flights
        That it follows, and that are recorded.
    size
        Of the window, pixels.
    finished
        Whether the user wants to leave.
    """

    def __init__(
        self,
        home: Camera,
        *,
        up: Vector = (0.0, 0.0, 1.0),
        extent: float = 1.0,
        size: tuple[int, int] = (960, 720),
        rig: Rig | None = None,
        outside_home: Camera | None = None,
        head_at: Callable[[float], Pose] | None = None,
        choices: Choices | None = None,
        flight: Flight | None = None,
        marking: Marking | None = None,
    ):
        self.rig = rig
        self.size = size
        self.choices = choices or Choices()
        self.marking = marking or Marking()
        self.finished = False
        self.inside = self._inside = Navigator(home, up, extent)
        self.flights = Flights(flight)
        self._outside = self._head = None
        if rig is not None:
            reach = float(np.ptp(rig.corners.reshape(-1, 3), axis=0).max())
            self._outside = Navigator(outside_home or home, UP_IN_ROOM, max(reach, 1e-3))
            self._head = Navigator(Camera(rig.eyes.rest_pose, 1.0, np.pi / 2), UP_IN_ROOM, 1.0)
            self._head.style, self._head.speed = "fly", HEAD_SPEED
        self._head_at = head_at
        self._path_seconds, self._path_runs = 0.0, head_at is not None
        self._is_outside = False
        self._hand, self._now, self._changed = _Hand(), None, True
        self._wanted: Wanted | None = None
        # An action is the preview's own, one of the choices' or one of the marks'.
        self._actions: dict[str, Callable[[], None]] = {
            key: getattr(self, f"_{b.action}", None)
            or getattr(self.choices, b.action, None)
            or getattr(self.marking, b.action)
            for b in BINDINGS
            for key in b.keys
        }
        self._actions |= {
            key: partial(self.choices.set_stereo, mode)
            for key, mode in zip(STEREO_KEYS, STEREO_MODES, strict=True)
        }

    # --- events --------------------------------------------------------------------------------------------

    def key(self, name: str, down: bool, *, shift: bool = False, control: bool = False) -> None:
        """A key goes down or up; repeats of a key that is down already are ignored."""
        self._hand.shift, self._hand.control = shift, control
        if not down:
            self._hand.keys.discard(name)
        elif name not in self._hand.keys:
            self._hand.keys.add(name)
            if name in self._actions:
                self._actions[name]()
                self._changed = True
        self._hold()

    def button(self, name: str, down: bool, *, shift: bool = False, control: bool = False) -> None:
        """A mouse button ("left", "middle", "right") goes down or up where the pointer is."""
        self._hand.shift, self._hand.control = shift, control
        if down:
            self._hand.button, self._hand.pressed_at = name, self._hand.pointer
        elif self._hand.button == name and control and self._hand.pressed_at == self._hand.pointer:
            self._hand.button = None
            self._pick()
        elif self._hand.button == name:
            self._hand.button = None

    def pointer(self, x: float, y: float) -> None:
        """The pointer is at (x, y): pixels from the window's upper left corner, y downwards."""
        (was_x, was_y), self._hand.pointer = self._hand.pointer, (x, y)
        if self._hand.button is None:
            return
        right, down = (x - was_x) / self.size[1], (y - was_y) / self.size[1]
        if self._head is not None and self._is_outside and self._hand.control:
            self._head.turn(right, down)
        elif self._hand.control and not self._is_outside:
            self._turn_window(right, down)
        elif self._hand.button != "left" or self._hand.shift:
            self._camera.pan(right, down)
        else:
            self._camera.turn(right, down)

    def wheel(self, notches: float, *, shift: bool = False) -> None:
        """The wheel turns, > 0 away from the user: zooms to the pointer, with shift to the pivot."""
        x, y = self._hand.pointer
        width, height = self.size
        place = (0.0, 0.0) if shift else ((2 * x - width) / height, (height - 2 * y) / height)
        self._camera.wheel(notches, *place)
        self._changed = True

    def resize(self, width: int, height: int) -> None:
        """The window has another size, pixels; a hidden window's, 0, is kept from the pictures."""
        if width > 0 and height > 0:
            self.size = (int(width), int(height))
            self._changed = True

    def let_go(self) -> None:
        """The window has lost the keyboard: nothing is held any more."""
        self._hand.keys.clear()
        self._hand.button = None
        self._hold()

    def say(self, text: str) -> None:
        """Show the user a line for a few seconds."""
        self.choices.say(text)
        self._changed = True

    def orbit(self, azimuth: float) -> None:
        """Turn the view by an angle, radians, as a program does it and no hand: at once."""
        self._camera.turn_at_once(azimuth)
        self._changed = True

    # --- time ----------------------------------------------------------------------------------------------

    def advance(self, now: float) -> Wanted:
        """What is to be drawn at the time `now`, seconds of any clock that does not go back."""
        # A pause (a compilation, a window dragged) must not become a leap.
        seconds = 0.0 if self._now is None else float(np.clip(now - self._now, 0.0, 0.25))
        self._now = now
        hands = [hand for hand in (self._inside, self._outside, self._head) if hand is not None]
        moving = self._changed or not all(hand.at_rest for hand in hands)
        for hand in hands:
            hand.advance(seconds)
        moving |= self.flights.advance(seconds, self._inside)
        if self._path_runs:
            self._path_seconds += seconds
            moving = moving or self._is_outside
        moving |= self.choices.advance(seconds)
        self._changed = False
        self._wanted = self._want(moving)
        return self._wanted

    @property
    def wanted(self) -> Wanted:
        """What `advance` gave last, with no time passed."""
        return self._wanted or self._want(True)

    def _want(self, moving: bool) -> Wanted:
        head, c = self._head_pose(), self.choices
        return Wanted(
            camera=self._camera.camera,
            size=self.size,
            outside=self._is_outside,
            stereo=c.possible_stereo,
            separation=c.separation,
            eyes=self._inside.camera.eyes(c.separation),
            head=head,
            head_eyes=None if head is None else eyes_of_head(head, self.rig.eyes),
            quality=c.quality,
            preset=c.preset,
            edits=c.edits,
            overlay=c.overlay,
            help=c.help,
            volume_outside=c.volume_outside,
            style=self._camera.style,
            speed=self._camera.speed,
            message=c.message,
            moving=moving,
            path_runs=None if self._head_at is None else self._path_runs,
            marks=self.marking.choice,
            picked=self.marking.picked,
            window=c.window,
        )

    @property
    def is_outside(self) -> bool:
        """Whether the room is shown from outside."""
        return self._is_outside

    def _head_pose(self) -> Pose | None:
        if self._head is None:
            return None
        return self._head_at(self._path_seconds) if self._head_at else self._head.camera.pose

    @property
    def _camera(self) -> Navigator:
        """The camera that the mouse moves."""
        return self._outside if self._is_outside else self._inside

    def _hold(self) -> None:
        """Held keys become a thrust: of the camera in flight; arrows turn it, or move the head outside."""
        keys, fast = self._hand.keys, FAST if self._hand.shift else 1.0
        thrust = fast * sum((np.array(THRUST_KEYS[key]) for key in keys & THRUST_KEYS.keys()), np.zeros(3))
        spin = sum((np.array(SPIN_KEYS[key]) for key in keys & SPIN_KEYS.keys()), np.zeros(3))
        for hand in (self._inside, self._outside):
            if hand is not None:
                here = hand is self._camera
                hand.hold(
                    thrust * (here and hand.style == "fly"),
                    spin[:2] * (here and not self._is_outside) * (-1 if hand.style == "fly" else 1),
                )
        if self._head is not None:
            x, y, z = spin * self._is_outside
            self._head.hold((x, z, -y))

    # --- actions, by the names in keys.BINDINGS ------------------------------------------------------------

    def _quit(self) -> None:
        if self.choices.help:
            self.choices.toggle_help()
        else:
            self.finished = True

    def _next_mode(self) -> None:
        if self._outside is not None:
            self._is_outside = not self._is_outside

    def _reset(self) -> None:
        self._camera.reset()
        self.choices.separation = SEPARATION
        if self._is_outside:
            self._head.reset()
            self._path_seconds = 0.0

    def _fly_or_orbit(self) -> None:
        self._camera.style = STYLES[0] if self._camera.style == "fly" else "fly"

    def _turntable_or_trackball(self) -> None:
        self._camera.style = "trackball" if self._camera.style == "turntable" else "turntable"

    def _pick(self) -> None:
        if self._is_outside:
            self.say("picks are made inside: press Tab")
            return
        # Both eyes' pictures lie one over the other, or side by side: what is between the eyes is picked.
        x, y = in_eyes_picture(self.choices.possible_stereo.shown_mode, self.size, self._hand.pointer)
        camera = self._camera.camera
        view = psw.View.through_wall(camera.position, camera.wall(self.size))
        self.say(self.marking.pick(view, (x, y)))

    def _turn_window(self, rightwards: float, downwards: float) -> None:
        self.choices.window = self.marking.window_after(self.choices.window, rightwards, -downwards)
        self.say("level {}, width {}".format(*map(psw.marks.short, self.choices.window)))

    def _pause_path(self) -> None:
        if not self._is_outside:
            self.flights.switch()
        else:
            self._path_runs = self._head_at is not None and not self._path_runs

    def _record_flight(self) -> None:
        self.choices.say(self.flights.record())
