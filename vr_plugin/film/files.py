"""Films on disk: encoded by ffmpeg, or as numbered pictures. Nothing half is ever left behind."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw
from persp_sw.errors import FileError, MissingPackageError

# What ffmpeg is told of sRGB pictures: without it players guess the matrix from the size, and colours shift.
_COLOURS = [
    "-vf", "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p",
    "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv",
]  # fmt: skip
_PALETTE = "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=sierra2_4a"
# Of the encoder's scale, where less is better: no difference to be seen beside the frames.
CRF = {".mp4": 16, ".webm": 18}
SUFFIXES = (*CRF, ".gif")
MAX_CRF = {".mp4": 51, ".webm": 63}
FRAME_NAME = "frame-{:05d}.png"


class FilmFile(Protocol):
    """Takes frames in order. As a context it is whole at the end, or, after an error, not there."""

    def __enter__(self) -> FilmFile:
        """Begin."""
        ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it, or take it away."""
        ...

    def add(self, frame: NDArray[np.uint8]) -> None:
        """The next frame, (height, width, 3) sRGB."""
        ...


def film_file(path: str | Path, size: tuple[int, int], fps: float, crf: int | None = None) -> FilmFile:
    """Where a film goes, checked before the work whose result goes there.

    Parameters
    ----------
    path
        .mp4 (H.264), .webm (VP9) or .gif; a name without suffix, or a folder that is there: PNG pictures.
    size
        Width and height of the frames, pixels. Odd ones gain a pixel that repeats the last, for .mp4 and
        .webm, which have none.
    fps
        Frames a second.
    crf
        The encoder's constant rate factor, 0 … 51 (.webm 63): less is better and larger. None: `CRF`.

    Raises
    ------
    FileError
        Another suffix, no right to write, a folder that has frames already, or a number out of range.
    MissingPackageError
        imageio-ffmpeg, which brings ffmpeg, is not there.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if not 0.1 <= fps <= 1000:
        raise FileError(f"a film has 0.1 … 1000 frames a second; given {fps:g}")
    if path.is_dir() or not suffix:
        return _Pictures(path)
    if suffix not in SUFFIXES:
        raise FileError(
            f"cannot tell the format of the film {str(path)!r}: end its name in {', '.join(SUFFIXES)}, or "
            "give a folder for PNG pictures"
        )
    if crf is not None and not 0 <= crf <= MAX_CRF.get(suffix, -1):
        limits = ", ".join(f"{limit} ({name})" for name, limit in MAX_CRF.items())
        raise FileError(f"crf lies between 0 and {limits}; .gif has none; given {crf} for {path.name}")
    if not path.parent.is_dir():
        raise FileError(f"cannot write the film {path}: there is no folder {path.parent}; make it first")
    if not os.access(path if path.exists() else path.parent, os.W_OK) or not os.access(path.parent, os.W_OK):
        raise FileError(f"cannot write the film {path}: permission denied; choose another place")
    if importlib.util.find_spec("imageio_ffmpeg") is None:
        raise MissingPackageError(
            f"writing {path.name} needs ffmpeg, which the package imageio-ffmpeg brings: pip install "
            "'persp-sw[movie]', or give a folder for PNG pictures"
        )
    return _Encoded(path, size, fps, crf)


class _Encoded:
    """A film that ffmpeg writes under another name beside it, which is renamed when it is whole."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float, crf: int | None):
        self._path, self._size, self._fps = path, size, fps
        suffix = path.suffix.lower()
        self._crf = CRF.get(suffix) if crf is None else crf
        self._pad = (0, 0) if suffix == ".gif" else (size[1] % 2, size[0] % 2)

    def __enter__(self) -> _Encoded:
        from imageio_ffmpeg import get_ffmpeg_exe

        try:
            program = get_ffmpeg_exe()
        except RuntimeError as error:
            raise MissingPackageError(
                f"imageio-ffmpeg is here, but no ffmpeg: {error}; install ffmpeg"
            ) from None
        path = self._path
        self._part = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix.lower()}")
        width, height = self._size[0] + self._pad[1], self._size[1] + self._pad[0]
        coming = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{self._fps!r}"]
        self._said = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [program, "-y", "-v", "error", *coming, "-i", "-", "-an", *self._encoding(), str(self._part)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            start_new_session=True,  # an interrupt is ours to handle
        )
        return self

    def add(self, frame: NDArray[np.uint8]) -> None:
        below, right = self._pad
        if below or right:
            frame = np.pad(frame, ((0, below), (0, right), (0, 0)), "edge")
        try:
            self._process.stdin.write(np.ascontiguousarray(frame).data)
        except OSError:
            self._close()
            raise FileError(self._complaint()) from None

    def __exit__(self, kind, error, trace) -> None:
        whole = False
        try:
            if kind is None:
                self._close()
                if self._process.returncode:
                    raise FileError(self._complaint())
                os.replace(self._part, self._path)
                whole = True
        finally:
            if not whole:
                self._process.kill()
                self._close()
                self._part.unlink(missing_ok=True)
            self._said.close()

    def _close(self) -> None:
        with contextlib.suppress(OSError):  # ffmpeg has gone: its exit code says so
            self._process.stdin.close()
        self._process.wait()

    def _complaint(self) -> str:
        self._said.seek(0)
        words = " ".join(self._said.read().decode(errors="replace").split())
        return f"cannot write the film {self._path}: ffmpeg says: {words or self._process.returncode}"

    def _encoding(self) -> list[str]:
        suffix = self._path.suffix.lower()
        if suffix == ".gif":
            return ["-filter_complex", f"[0:v]{_PALETTE}"]
        if suffix == ".webm":
            speed = ["-b:v", "0", "-row-mt", "1", "-deadline", "good", "-cpu-used", "4"]
            return ["-c:v", "libvpx-vp9", "-crf", str(self._crf), *speed, *_COLOURS]
        return ["-c:v", "libx264", "-crf", str(self._crf), *_COLOURS, "-movflags", "+faststart"]


class _Pictures:
    """A folder of PNG pictures; after an error those that are finished stay, each of them whole."""

    def __init__(self, folder: Path):
        self._folder = psw.images.output_folder(folder)
        self._count = 0
        there = next(self._folder.glob(FRAME_NAME.replace("{:05d}", "[0-9]*")), None)
        if there is not None:
            raise FileError(f"{folder} has frames already, such as {there.name}: choose an empty folder")

    def __enter__(self) -> _Pictures:
        return self

    def add(self, frame: NDArray[np.uint8]) -> None:
        path = self._folder / FRAME_NAME.format(self._count)
        part = path.with_suffix(".part")
        try:
            psw.images.write_rgb(part, frame, optimize=False)
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
        self._count += 1

    def __exit__(self, kind, error, trace) -> None:
        """Nothing: each picture is finished when it is added."""
