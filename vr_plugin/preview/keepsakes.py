"""What a user takes along from a preview: pictures, sessions and flights, as files in one folder."""

from __future__ import annotations

from pathlib import Path

import persp_sw as psw

from ..film.flight_file import save_flight
from .controller import Preview
from .pictures import Composited, PreviewPictures
from .run import Screenshots
from .screenshot import screenshot
from .session_file import save_session
from .wanted import Wanted


class Keepsakes(Screenshots):
    """Writes what the user asks for, each under the next number that is free.

    Parameters
    ----------
    scene
        What sessions are saved of.
    size, samples, suffix
        Of pictures: width and height in pixels, samples along each edge of a pixel, and ".png", ".npy" or
        ".exr". Size None: pictures as large as the window, of the eye images that it shows.
    """

    def __init__(
        self,
        preview: Preview,
        pictures: PreviewPictures,
        folder: Path,
        name: str,
        scene: psw.Scene,
        *,
        size: tuple[int, int] | None = None,
        samples: int = 1,
        suffix: str = ".png",
    ):
        super().__init__(preview, pictures, folder, name)
        self._scene, self._size, self._samples, self._suffix = scene, size, samples, suffix
        self._sessions = self._flights = 0

    def asked(self) -> bool:
        """Whether a picture is to be rendered anew, for which nothing else may composite."""
        return self._size is not None and self._preview.choices.screenshots != self._done

    def write_if_asked(self, wanted: Wanted, done: Composited) -> None:
        """Write what has been asked for since the last time; and say so."""
        if self.asked():
            self._done = self._preview.choices.screenshots
            self._keep(lambda: self._large_picture(wanted))
        super().write_if_asked(wanted, done)
        if self._preview.choices.sessions != self._sessions:
            self._sessions = self._preview.choices.sessions
            self._keep(
                lambda: save_session(self._folder, self._name, self._scene, self._preview, self._pictures)
            )
        self._write_flights()

    def finish(self) -> None:
        """The preview is over: a flight that is being recorded ends here, and is written, too."""
        if self._preview.flights.is_recording:
            self._preview.flights.record()
        self._write_flights()

    def _write_flights(self) -> None:
        while self._flights < len(self._preview.flights.flown):
            flight = self._preview.flights.flown[self._flights]
            self._flights += 1
            self._keep(lambda flight=flight: save_flight(self._free("flight", ".csv"), flight))

    def _large_picture(self, wanted: Wanted) -> Path:
        path = self._free("view", self._suffix)
        return screenshot(self._pictures, wanted, path, self._size, self._samples)
