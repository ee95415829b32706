"""Other renderers as contestants, each in a process of its own.

So each has its own number of OpenGL threads (Mesa reads it once, at the start), its memory is not ours, and
where it crashes the benchmark goes on. A process that waits for its turn uses no processor.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import signal
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MissingPackageError, PerspSWError
from ..geometry.view import View
from .cases import Stage

# Name -> arguments of `vtk_scene.VtkScene`.
KINDS: dict[str, dict[str, Any]] = {
    "vtk-fixed": {"mapper": "fixed"},
    "vtk-fixed-2px": {"mapper": "fixed", "pixel_step": 2.0},
    "vtk-gpu": {"mapper": "gpu"},
}
GROUPS = {"vtk": ("vtk-fixed", "vtk-gpu")}


class PeerError(PerspSWError):
    """A peer that cannot show a scene, or has died of it."""


def peers_named(names: Sequence[str], threads: Sequence[int]) -> list[PeerProcess]:
    """A peer for each name, or group of names, and number of threads.

    Raises
    ------
    MissingPackageError
        VTK is not installed.
    """
    kinds = [kind for name in names for kind in GROUPS.get(name, (name,))]
    if kinds and importlib.util.find_spec("vtkmodules") is None:
        raise MissingPackageError("--peer vtk needs the package vtk: pip install 'persp-sw[bench]'")
    return [PeerProcess(kind, count) for kind in dict.fromkeys(kinds) for count in threads]


class PeerProcess:
    """A `bench.Peer` behind a pipe; the process starts with the first scene."""

    def __init__(self, name: str, threads: int):
        self.name, self.threads = name, threads
        self._process: Any = None
        self._pipe: Any = None

    def open(self, stage: Stage) -> None:
        """Hand over the scene; PeerError where VTK fails."""
        if self._process is None:
            context = multiprocessing.get_context("spawn")  # a fork would share numba's threads
            self._pipe, other = context.Pipe()
            arguments = (other, KINDS[self.name], self.threads)
            self._process = context.Process(target=_serve, args=arguments, daemon=True)
            self._process.start()
            other.close()
        self._ask("open", stage)

    def prepare(self, view: View) -> None:
        """A frame that is not timed: whatever VTK sets up late, it sets up now."""
        self._ask("draw", view)

    def draw(self, view: View) -> dict[str, float]:
        """One frame, without reading it back; timed in the peer's process."""
        return {"ms": self._ask("draw", view)}

    def picture(self, view: View) -> NDArray[np.float64]:
        """(h, w, 4), premultiplied, row 0 on top."""
        return self._ask("picture", view)

    def close(self) -> None:
        """End the process; `open` starts another."""
        if self._process is not None:
            self._pipe.close()
            self._process.terminate()
            self._process.join()
            self._process = None

    def _ask(self, what: str, argument: Any) -> Any:
        try:
            self._pipe.send((what, argument))
            good, answer = self._pipe.recv()
        except (EOFError, OSError):
            self.close()
            raise PeerError(f"{self.name} died; is there a working OpenGL (Mesa's EGL will do)?") from None
        if not good:
            raise PeerError(f"{self.name}: {answer}")
        return answer


def _serve(pipe: Any, kind: dict[str, Any], threads: int) -> None:
    """The peer's process: answer until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the benchmark decides what Ctrl-C means
    os.environ["LP_NUM_THREADS"] = str(threads)
    os.environ.pop("DISPLAY", None)  # off screen, never a window
    scene: Any = None
    with suppress(EOFError, OSError):
        while True:
            what, argument = pipe.recv()
            try:
                if what == "open":
                    from .vtk_scene import VtkScene

                    scene = None  # its window goes before the next one comes
                    scene = VtkScene(argument, threads=threads, **kind)
                    answer = None
                else:
                    answer = getattr(scene, what)(argument)
                pipe.send((True, answer))
            except Exception as error:
                pipe.send((False, f"{type(error).__name__}: {error}"))
