"""The preview's loop: the same controller with a window, or without a screen for a number of frames."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw
from persp_sw.errors import PerspSWError

from ..record import Times
from ..screen.lettering import lay_over, squeezed, text_panel
from ..stereo import eye_size
from .controller import Preview
from .figures import Rate, figures, fitting_letter, help_text
from .pictures import Composited, PreviewPictures
from .recorder import Recorder
from .wanted import Wanted

FRAME_SECONDS = 1 / 60  # of frames without a screen: their time is counted, not measured
_log = logging.getLogger("persp_sw")


def texts(wanted: Wanted, statistics: Mapping[str, Any], rate: Rate) -> Iterator[tuple[str, int, str]]:
    """Texts over a picture, with the height of their letters and the corner of the window they stand in."""
    if wanted.help:
        text = help_text()
        yield text, fitting_letter(text, wanted.size), "upper left"
    elif wanted.overlay:
        text = figures(wanted, statistics, rate)
        yield text, fitting_letter(text, wanted.size, 13), "upper left"
    if wanted.message:
        yield wanted.message, fitting_letter(wanted.message, wanted.size), "lower left"


def lay_texts(
    wanted: Wanted, written: Sequence[tuple[str, int, str]], pictures: Mapping[str, NDArray[np.float32]]
) -> dict[str, NDArray[np.float32]]:
    """The pictures with texts over them, in all eyes at the same place: at the depth of the screen."""
    if not written:
        return dict(pictures)
    mode = "mono" if wanted.outside else wanted.stereo.shown_mode
    across, down = (
        max(n // part, 1) for n, part in zip(wanted.size, eye_size(mode, wanted.size), strict=True)
    )
    copies = {id(picture): picture.copy() for picture in pictures.values()}
    for text, letter, corner in written:
        panel = squeezed(text_panel(text, letter), across, down)
        margin = letter // 2
        for picture in copies.values():
            low = picture.shape[0] - panel.shape[0] - margin // down
            lay_over(picture, panel, margin // across, low if "lower" in corner else margin // down)
    return {name: copies[id(picture)] for name, picture in pictures.items()}


def software_frame(
    pictures: PreviewPictures, wanted: Wanted, done: Composited, rate: Rate
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """A frame as the window would show it, texts and all, without OpenGL.

    Parameters
    ----------
    done
        The eye images of what is wanted.

    Returns
    -------
    image
        (h, w, 4) float32, linear, opaque.
    statistics
        See `figures`.
    """
    drawn, warp_ms = pictures.draw(wanted, done)
    statistics = {**done.statistics, "upload_ms": 0.0, "warp_ms": warp_ms, "warp": "software"}
    written = list(texts(wanted, statistics, rate))
    return pictures.window(wanted, lay_texts(wanted, written, drawn)), statistics


class Run(NamedTuple):
    """What a preview did: figures of each frame drawn, and names of the pictures that the user asked for."""

    frames: list[dict[str, Any]]
    screenshots: list[str]


class Screenshots:
    """Pictures that the user asks for, as files: what is shown, drawn anew without texts over it.

    Attributes
    ----------
    written
        Their names, in order.
    """

    def __init__(self, preview: Preview, pictures: PreviewPictures, folder: Path, name: str):
        self._preview, self._pictures = preview, pictures
        self._folder, self._name = folder, name
        self._done = 0
        self.written: list[str] = []

    def asked(self) -> bool:
        """Whether a picture is to be rendered anew, for which nothing else may composite."""
        return False

    def write_if_asked(self, wanted: Wanted, done: Composited) -> None:
        """Write what is shown now, if a picture has been asked for since the last time; and say so."""
        if self._preview.choices.screenshots == self._done:
            return
        self._done = self._preview.choices.screenshots
        drawn, _ = self._pictures.draw(wanted, done)
        self._keep(lambda: psw.images.write(self._free("view", ".png"), self._pictures.window(wanted, drawn)))

    def _free(self, what: str, suffix: str) -> Path:
        number = 1
        while (path := self._folder / f"{self._name}-{what}-{number:03d}{suffix}").exists():
            number += 1
        return path

    def _keep(self, write: Callable[[], Path]) -> None:
        try:
            path = write()
        except PerspSWError as error:  # a full disk must not end the preview
            self._preview.say(str(error))
            _log.warning("%s", error)
            return
        self.written.append(str(path))
        self._preview.say(f"written: {path}")


def run_offscreen(
    preview: Preview,
    pictures: PreviewPictures,
    *,
    frames: int,
    folder: Path,
    name: str,
    turn: float = 0.0,
    warp: str = "auto",
    recorder: Recorder | None = None,
    keepsakes: Screenshots | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, what: None,
) -> Run:
    """Draw so many frames, a sixtieth of a second apart, and write each as NAME-0000.png, …

    Parameters
    ----------
    turn
        Radians to orbit by before each frame but the first.
    warp
        "texture" (OpenGL, without a screen), "software", or "auto": the software warp, which needs nothing.
    recorder
        Takes each frame.
    keepsakes
        Writes what the user asks for; None: pictures alone.
    """
    recorder = recorder or Recorder()
    if missing := preview.choices.say_missing_quad_buffers():
        _log.warning("%s", missing)
    shots = keepsakes or Screenshots(preview, pictures, folder, name)
    if warp == "texture":
        with psw.OffscreenContext():
            return _run_offscreen(
                preview,
                pictures,
                _TextureFrames(pictures),
                frames,
                folder,
                name,
                turn,
                recorder,
                shots,
                progress,
            )
    return _run_offscreen(
        preview, pictures, software_frame, frames, folder, name, turn, recorder, shots, progress
    )


def _run_offscreen(preview, pictures, frame_of, frames, folder, name, turn, recorder, shots, progress) -> Run:
    rate, rows = Rate(), []
    for number in range(frames):
        progress(number, frames, "frames")
        if number:
            preview.orbit(turn)
        now = number * FRAME_SECONDS
        wanted = preview.advance(now)
        start = perf_counter()
        done = pictures.composite(wanted)
        composited = perf_counter()
        image, statistics = frame_of(pictures, wanted, done, rate)
        end = perf_counter()
        seconds, upload_ms = end - start, statistics["upload_ms"]
        warp_ms = 1e3 * (end - composited) - upload_ms  # texts and all
        pictures.drawn(wanted, done, upload_ms, warp_ms)
        recorder.add(done, Times(now, now, upload_ms, warp_ms, 0.0, 1e3 * seconds), on_display=False)
        preview.choices.drawn_quality = done.statistics["quality"]
        rate.add(seconds)
        path = psw.images.write(folder / f"{name}-{number:04d}.png", image)
        rows.append({"picture": str(path), "ms": 1e3 * seconds, **statistics})
        shots.write_if_asked(wanted, done)
        if preview.finished:
            break
    progress(frames, frames, "frames")
    return Run(rows, shots.written)


class _TextureFrames:
    """Frames as `software_frame` makes them, with OpenGL, whose context is current."""

    def __init__(self, pictures: PreviewPictures):
        from ..present import EyeTarget  # OpenGL: only now there is a context that says which library it is
        from .screen import PreviewScreen

        self._screen = PreviewScreen(pictures)
        self._target = EyeTarget((1, 1), "float32")

    def __call__(
        self, pictures: PreviewPictures, wanted: Wanted, done: Composited, rate: Rate
    ) -> tuple[Any, dict[str, Any]]:
        self._target.resize(wanted.size)
        with self._target.drawing():
            statistics = self._screen.draw(wanted, done, lambda s: texts(wanted, s, rate), encode=False)
        return self._target.read(), statistics
