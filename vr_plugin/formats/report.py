"""What a reader of a foreign file has to say: problems with their place and remedy, and notes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ..rig import RigError

if TYPE_CHECKING:
    from collections.abc import Iterator

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,3})?")
# No wall is larger, in whatever unit; beyond it squares lose their meaning.
_LARGEST = 1e7
# Enough to mend a file by; a file with more is of another kind.
_MOST_PROBLEMS = 50
# As much of a file's own text as a message repeats.
_QUOTED = 60


class Broken(Exception):
    """One wall, or one value, cannot be read; its problem is in the report."""


class Report:
    """Collects problems, which stop the reading, and notes, which do not.

    Parameters
    ----------
    skip_broken
        Leave out what is broken, with a note, instead of stopping.
    """

    def __init__(self, skip_broken: bool = False):
        self.skip_broken = skip_broken
        self.problems: list[str] = []
        self._notes: dict[str, None] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, assumed or looks odd; each once, in the order of finding."""
        return tuple(self._notes)

    def note(self, text: str) -> None:
        """Say something that does not stop the reading; the second time it is not repeated."""
        self._notes.setdefault(text)

    def problem(self, where: str, text: str) -> None:
        """Record what is wrong at a place of a file: the value given and the remedy belong into the text."""
        if f"{where}: {text}" not in self.problems:
            self.problems.append(f"{where}: {text}")

    def broken(self, where: str, text: str) -> Broken:
        """Record a problem; raise what this returns to give up the wall it belongs to."""
        self.problem(where, text)
        return Broken(text)

    @contextmanager
    def part(self, what: str) -> Iterator[None]:
        """A wall or another part that may be broken: what is in the block is then left out."""
        before = len(self.problems)
        try:
            yield
        except Broken:
            if self.skip_broken:
                self.note(f"left out {what}: {'; '.join(self.problems[before:])}")
                del self.problems[before:]

    def stop_if_broken(self) -> None:
        """Raise RigError with all problems, if there are any."""
        if not self.problems:
            return
        shown = self.problems[:_MOST_PROBLEMS]
        if len(self.problems) > len(shown):
            shown = [*shown, f"… and {len(self.problems) - len(shown)} more"]
        raise RigError("\n".join(shown) + "\nMend the file, or leave out what is broken with --skip-broken")

    def number(self, where: str, name: str, text: str) -> float:
        """A finite number from a file's text; Broken if it is none."""
        text = text.strip()
        if not _NUMBER.fullmatch(text):
            raise self.broken(where, f"{name} is a number; given {quoted(text)}{_hint(text)}")
        value = float(text)
        if not abs(value) <= _LARGEST:
            raise self.broken(where, f"{name} is at most {_LARGEST:g} in size; given {quoted(text)}")
        return value

    def numbers(self, where: str, name: str, text: str | Sequence[str], count: int) -> tuple[float, ...]:
        """So many numbers, divided by white space or each a text of its own."""
        parts = text.split() if isinstance(text, str) else list(text)
        if len(parts) != count:
            raise self.broken(where, f"{name} is {count} numbers; given {quoted(' '.join(parts))}")
        return tuple(self.number(where, f"{name}[{i}]", part) for i, part in enumerate(parts))

    def whole(self, where: str, name: str, text: str) -> int:
        """A whole number."""
        value = self.number(where, name, text)
        if value != int(value):
            raise self.broken(where, f"{name} is a whole number; given {quoted(text)}")
        return int(value)


def quoted(text: str) -> str:
    """A file's own text in a message: one line, not long, nothing that moves a terminal's cursor."""
    text = printable(text)
    return f"'{text if len(text) <= _QUOTED else text[: _QUOTED - 1] + '…'}'"


def printable(text: str) -> str:
    """A file's text as one line that can be shown and written."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def _hint(text: str) -> str:
    """What may have been meant; nothing is changed in silence."""
    for wrong, name in (("/", "a slash"), (",", "a comma"), ("O", "a letter O"), ("o", "a letter o")):
        guess = text.replace(wrong, "0" if wrong in "Oo" else ".")
        if wrong in text and _NUMBER.fullmatch(guess):
            return f" ({name} in it; {guess}?)"
    return ""
