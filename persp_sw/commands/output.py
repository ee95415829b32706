"""What all commands print: tables for people, one JSON object for programs, progress if someone watches."""

from __future__ import annotations

import errno
import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from ..errors import FileError

if TYPE_CHECKING:
    from rich.console import Console  # takes 30 ms, which a picture need not wait for

ProgressCall = Callable[[int, int, str], None]


def print_json(values: dict[str, Any]) -> None:
    """One object on stdout; numbers that JSON cannot hold (NaN, infinity) become null."""
    click.echo(json.dumps(plain(values), ensure_ascii=False, allow_nan=False))


def console() -> Console:
    """Where tables go: stdout, in colour where it is a terminal."""
    from rich.console import Console

    class OurConsole(Console):
        """rich's, but a reader that has left is the program's to handle, not a reason to exit here."""

        def on_broken_pipe(self) -> None:
            raise BrokenPipeError(errno.EPIPE, "the reader has left")

    return OurConsole(highlight=False, soft_wrap=not sys.stdout.isatty())


@contextmanager
def progress_bars() -> Iterator[ProgressCall]:
    """A callable (done, total, what) that draws a bar for each `what`; silent where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield lambda done, total, what: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, Any] = {}

        def show(done: int, total: int, what: str) -> None:
            if what not in tasks:
                tasks[what] = bars.add_task(what, total=total)
            bars.update(tasks[what], completed=done, total=total)

        yield show


def print_facts(rows: Mapping[str, str]) -> None:
    """A line for each: its name in colour, then what is to be said."""
    width = max(map(len, rows), default=0)
    for name, text in rows.items():
        click.echo(click.style(f"{name:<{width}}", fg="cyan") + "  " + text)


def try_to_write(path: Path) -> None:
    """Find out, before what takes long, whether a file can be written.

    Its folder is made; the file stays as it is, and if there is none, there is none afterwards.

    Raises
    ------
    FileError
        It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            path.open("x").close()
        except FileExistsError:
            path.open("a").close()
        else:
            path.unlink()
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror}; choose another file with -o") from None


def byte_size(count: float) -> str:
    """A number of bytes for people: 812 B, 3.1 MB."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000 or unit == "GB":
            return f"{count:.0f} B" if unit == "B" else f"{count:.1f} {unit}"
        count /= 1000
    raise AssertionError


def numbers(values: Any, digits: int = 6) -> str:
    """1 × 2 × 3, each with at most `digits` significant digits."""
    return " × ".join(f"{value:.{digits}g}" for value in values)


def plain(value: Any) -> Any:
    """What JSON can hold: arrays become lists, numbers that are not finite null, anything else its text."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | type(None)) else str(value)
