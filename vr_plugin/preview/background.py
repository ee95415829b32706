"""Eye images made in a thread while the window's loop goes on: of edits, and better ones at rest."""

from __future__ import annotations

from typing import NamedTuple

import persp_sw as psw

from ..worker import Worker
from .pictures import Composited, PreviewPictures
from .wanted import Wanted

# Longer than any encoding: two threads must not work with one renderer.
_ENCODING_SECONDS = 600.0


class Finished(NamedTuple):
    """Eye images, and what they are of."""

    wanted: Wanted
    done: Composited


class Background:
    """One thread at a time, which edits or refines; whoever composites by himself gives it up first."""

    def __init__(self, pictures: PreviewPictures):
        self._pictures = pictures
        self._refiner: Worker[Wanted, Finished] | None = None
        self._editor: Worker[Wanted, Finished] | None = None
        self._asked_for: tuple[object, ...] = ()  # of the editor, `Wanted.eye_images`

    def edited(self, wanted: Wanted, patience_s: float = 0.0) -> Finished | None:
        """The newest finished edit; `wanted` is begun as soon as the one under way is finished.

        `patience_s`: how long it may be waited for.
        """
        if self._editor is None:
            self.give_up()
            self._editor, self._asked_for = Worker(self._edit, "editing"), ()
        if self._asked_for != wanted.eye_images:
            self._asked_for = wanted.eye_images
            self._editor.ask(wanted)
        self._editor.wait(patience_s)
        return self._editor.newest()

    @property
    def is_refining(self) -> bool:
        """Whether a better picture is being made."""
        return self._refiner is not None and self._refiner.is_busy

    def refined(self) -> Finished | None:
        """The newest better picture."""
        return None if self._refiner is None else self._refiner.newest()

    def refine(self, wanted: Wanted) -> None:
        """Have a better picture made."""
        if self._refiner is None:
            self.give_up()
            self._refiner = Worker(self._better, "refinement")
        self._refiner.ask(wanted)

    @property
    def is_idle(self) -> bool:
        """Whether there is no thread."""
        return self._refiner is None and self._editor is None

    def wait(self, timeout: float | None = None) -> bool:
        """Until nothing is under way, at most so many seconds; whether nothing is."""
        return all(worker is None or worker.wait(timeout) for worker in (self._refiner, self._editor))

    def give_up(self) -> None:
        """At once, for compositing often looks whether it is cancelled; encoding is waited for."""
        workers = self._refiner, self._editor
        self._refiner = self._editor = None
        for worker in workers:
            if worker is not None:
                worker.close(_ENCODING_SECONDS)

    def _edit(self, wanted: Wanted, cancel: psw.Cancel) -> Finished:
        return Finished(wanted, self._pictures.composite(wanted, cancel))

    def _better(self, wanted: Wanted, cancel: psw.Cancel) -> Finished:
        return Finished(wanted, self._pictures.composite(wanted, cancel, resting=True))
