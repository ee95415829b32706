"""Moves in time: what hands do to a camera, smooth and the same at every frame rate."""

from __future__ import annotations

import numpy as np

from ..cameras import Camera
from ..pose import Vector

STYLES = ("turntable", "trackball", "fly")
ORBIT_PER_HEIGHT = np.pi  # a drag over the picture's height goes half around
SPIN_PER_SECOND = np.radians(60)  # while an arrow key is held
ZOOM_PER_NOTCH = 1.15
SPEED_PER_NOTCH = 1.25
SPEEDS = (0.01, 20.0)  # extents of the scene a second
DISTANCES = (1e-3, 50.0)  # extents of the scene: how near to its pivot an orbit zooms, and how far away
LAG_SECONDS = 0.05  # after which 63 % of a drag have been carried out
GLIDE_SECONDS = 0.12  # after which a flight has 63 % of its speed


class Lag:
    """An amount that is carried out a little later, ever more slowly, and in the end exactly.

    Of what is left after t seconds e^(−t / LAG_SECONDS) is left, however the time is cut into frames.
    """

    def __init__(self, count: int):
        self.left = np.zeros(count)

    def add(self, *amounts: float) -> None:
        """More to be done."""
        self.left += amounts

    def advance(self, seconds: float) -> np.ndarray:
        """What is done in this time."""
        done = self.left * -np.expm1(-seconds / LAG_SECONDS)
        if np.abs(self.left).max() < 1e-5:  # of a turn, a picture or a factor: below a pixel
            done = self.left.copy()
        self.left -= done
        return done


class Glide:
    """A velocity that follows what is wanted of it with a delay of GLIDE_SECONDS.

    What it loses in starting it gains in stopping: in the end the way is speed times time held.
    """

    def __init__(self, count: int):
        self.velocity = np.zeros(count)
        self.wanted = np.zeros(count)

    def advance(self, seconds: float) -> np.ndarray:
        """The way of this time: the exact integral, however the time is cut into frames."""
        ahead = self.velocity - self.wanted
        if np.abs(ahead).max() < 1e-4 * max(np.abs(self.wanted).max(), 1e-3):
            way = self.wanted * seconds + ahead * GLIDE_SECONDS
            self.velocity = self.wanted.copy()
            return way
        fading = -np.expm1(-seconds / GLIDE_SECONDS)
        self.velocity = self.wanted + ahead * (1 - fading)
        return self.wanted * seconds + ahead * GLIDE_SECONDS * fading


class Navigator:
    """One camera in hand.

    Parameters
    ----------
    home
        Where it starts, and goes back to.
    up
        World direction that a turntable turns around and a flight keeps upwards.
    extent
        How large the scene is, world units: what speeds and limits are counted in.

    Attributes
    ----------
    camera
        As it is now.
    style
        One of `STYLES`. Assigning one that knows an up levels the camera.
    speed
        Of flights, extents a second.
    """

    def __init__(self, home: Camera, up: Vector, extent: float):
        self.home = self.camera = home
        self.up = np.asarray(up, np.float64) / np.linalg.norm(up)
        self.extent = extent
        self.speed = 0.3
        self._style = STYLES[0]
        self._stop()

    @property
    def style(self) -> str:
        """One of `STYLES`."""
        return self._style

    @style.setter
    def style(self, style: str) -> None:
        self._style = STYLES[STYLES.index(style)]
        if style != "trackball" and abs(self.camera.axes[0] @ self.up) > 1e-6:
            self.camera = self.camera.levelled(self.up)

    def turn(self, rightwards: float, downwards: float) -> None:
        """A drag that turns, in heights of the picture.

        What is seen follows the pointer: half around for a height when orbiting; in flight one looks around,
        so that one height of the pointer is what one height of the picture shows.
        """
        scale = self.camera.fovy if self.style == "fly" else ORBIT_PER_HEIGHT
        self._turn.add(-rightwards * scale, downwards * scale)

    def turn_at_once(self, azimuth: float) -> None:
        """Orbit by an angle to the right, radians, without waiting for time."""
        self.camera = self.camera.on_turntable(azimuth, 0.0, self.up)

    def pan(self, rightwards: float, downwards: float) -> None:
        """A drag that shifts, in heights of the picture: what is as deep as the pivot follows the pointer."""
        self._pan.add(2 * rightwards, -2 * downwards)

    def wheel(self, notches: float, across: float = 0.0, upwards: float = 0.0) -> None:
        """Wheel turned away from the user: nearer when orbiting, faster in flight.

        across, upwards: the place in the picture that stays, in half heights from its middle.
        """
        if self.style == "fly":
            self.speed = float(np.clip(self.speed * SPEED_PER_NOTCH**notches, *SPEEDS))
        else:
            self._zoom.add(notches)
            self._anchor = (across, upwards)

    def hold(self, thrust: Vector, spin: Vector = (0.0, 0.0)) -> None:
        """What keys are held: thrust right, up, back (1 is the speed), spin right, up."""
        self._spin.wanted = np.asarray(spin, np.float64) * SPIN_PER_SECOND
        self._thrust = np.asarray(thrust, np.float64)

    def advance(self, seconds: float) -> Camera:
        """The camera after `seconds` more."""
        self._flight.wanted = self._thrust * (self.speed * self.extent)
        turn = self._turn.advance(seconds) + self._spin.advance(seconds)
        pan, (zoom,) = self._pan.advance(seconds), self._zoom.advance(seconds)
        way = self._flight.advance(seconds)
        camera = self.camera
        if turn.any():
            if self.style == "turntable":
                camera = camera.on_turntable(*turn, self.up)
            elif self.style == "trackball":
                camera = camera.on_trackball(*turn)
            else:
                camera = camera.looking(*turn, self.up)
        if pan.any():
            camera = camera.panned(*pan)
        if way.any():
            camera = camera.moved(way)
        if zoom:
            near, far = np.array(DISTANCES) * self.extent / camera.distance
            factor = float(np.clip(ZOOM_PER_NOTCH**-zoom, min(near, 1), max(far, 1)))
            camera = camera.zoomed(factor, camera.point_at(*self._anchor))
        self.camera = camera
        return camera

    def reset(self) -> None:
        """Back home at once; everything under way ends."""
        self.camera = self.home
        self._stop()

    @property
    def at_rest(self) -> bool:
        """Whether time changes nothing."""
        moving = (self._turn.left, self._pan.left, self._zoom.left, self._thrust)
        moving += (self._spin.wanted, self._spin.velocity, self._flight.velocity)
        return not any(amount.any() for amount in moving)

    def _stop(self) -> None:
        self._turn, self._pan, self._zoom = Lag(2), Lag(2), Lag(1)
        self._flight, self._spin = Glide(3), Glide(2)
        self._thrust = np.zeros(3)
        self._anchor = (0.0, 0.0)
