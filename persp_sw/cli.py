"""The program `persp-sw`: finds its commands, and turns every failure into one line and an exit code.

A command's module is imported when that command runs, so that `--help` is instant. Other packages add
commands by an entry point of the group `persp_sw.commands` that leads to a `click.Command`.
"""

from __future__ import annotations

import importlib
import logging
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from typing import Any, NoReturn

import click

from . import __version__
from .errors import PerspSWError

_OWN = {
    "info": (
        "persp_sw.commands.info:info",
        "Tell what is in a volume file, and what the run-length store makes of it.",
    ),
    "render": (
        "persp_sw.commands.render:render",
        "Write a picture, its time and, if wanted, its measured error.",
    ),
    "pick": ("persp_sw.commands.pick:pick", "Tell what is seen at a pixel: value, position, depth."),
    "demo": ("persp_sw.commands.demo:demo", "Show what it can do, on a real CT scan."),
    "bench": (
        "persp_sw.commands.bench:bench",
        "Measure time, work, memory and error, beside other renderers.",
    ),
    "chart": ("persp_sw.commands.chart:chart", "Draw time against accuracy, for all ways to sample."),
    "atlas": (
        "persp_sw.commands.atlas:atlas",
        "Measure the ways in which volume renderers fail, beside their bounds.",
    ),
    "trace": ("persp_sw.commands.trace:trace", "Tell how steady a recorded session was, and draw it."),
    "papers": (
        "persp_sw.commands.papers:papers",
        "Repeat a paper's own experiments, beside what it prints.",
    ),
    "warmup": ("persp_sw.commands.warmup:warmup", "Compile what a first picture would wait for."),
}
_GROUP = "persp_sw.commands"

EXIT_OK, EXIT_OURS, EXIT_USER, EXIT_INTERRUPTED, EXIT_PIPE = 0, 1, 2, 130, 141

_EXAMPLES = """\b
Examples:
  persp-sw demo                                  pictures of a real CT in ./persp-sw-demo
  persp-sw info head.nrrd                        size, spacing, values, memory
  persp-sw render head.nrrd -o head.png          a first look, transfer function chosen
  persp-sw render scene.json --reference --json  time and error, for programs

\b
Exit codes: 0 done, 2 something you can mend (the message says what), 1 a fault of ours.
`persp-sw COMMAND --help` explains a command."""


class Program(click.Group):
    """The group of all commands, the built-in ones and those of other packages."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands: ours in their order, then the others'."""
        return [*_OWN, *sorted(set(_others()) - set(_OWN))]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, imported now; None if there is none."""
        if cmd_name in _OWN:
            module, _, name = _OWN[cmd_name][0].partition(":")
            return getattr(importlib.import_module(module), name)
        point = _others().get(cmd_name)
        return point.load() if point else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list in `--help`, without importing ours; others are imported for their summary."""
        rows = [(name, help_) for name, (_, help_) in _OWN.items()]
        for name in self.list_commands(ctx)[len(_OWN) :]:
            try:
                command = self.get_command(ctx, name)
                rows.append((name, command.get_short_help_str(100) if command else ""))
            except Exception as error:  # one broken add-on must not take --help away
                rows.append((name, f"(cannot be loaded: {error})"))
        with formatter.section("Commands"):
            formatter.write_dl(rows)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; where whoever read our output has left, stop and say no more."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
            return result
        except BrokenPipeError:
            sys.stdout = open(os.devnull, "w")  # noqa: SIM115  what is still buffered goes there
            raise click.exceptions.Exit(EXIT_PIPE) from None

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: Any,
    ) -> Any:
        """Run; in standalone mode leave the process with an exit code and never show a traceback unasked."""
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, False, **extra)
        _log_to_stderr()
        try:
            code = super().main(args, prog_name or "persp-sw", complete_var, False, **extra)
            sys.exit(code if isinstance(code, int) else EXIT_OK)
        except (KeyboardInterrupt, click.Abort):
            _fail("interrupted", EXIT_INTERRUPTED)
        except click.ClickException as error:
            context = getattr(error, "ctx", None)
            if context is not None:
                click.echo(f"{context.get_usage()}\nTry '{context.command_path} --help'.\n", err=True)
            _fail(error.format_message(), EXIT_USER)
        except PerspSWError as error:
            _fail(str(error), EXIT_USER)
        except MemoryError as error:
            _fail(
                f"not enough memory: {error or 'no more to be had'}; ask for less (size, quality)", EXIT_USER
            )
        except Exception as error:
            _fail_ours(error)


def _others() -> dict[str, Any]:
    from importlib.metadata import entry_points  # takes 25 ms, which our own commands need not wait for

    return {point.name: point for point in entry_points(group=_GROUP)}


def _fail(message: str, code: int) -> NoReturn:
    if os.environ.get("PERSP_SW_DEBUG"):
        traceback.print_exc()
    click.echo(click.style("error: ", fg="red", bold=True) + message, err=True)
    sys.exit(code)


def _fail_ours(error: Exception) -> NoReturn:
    what = " ".join(f"{type(error).__name__}: {error}".split())
    advice = (
        "" if os.environ.get("PERSP_SW_DEBUG") else " (set PERSP_SW_DEBUG=1 for the traceback, and report it)"
    )
    _fail(f"this is a fault of the program: {what}{advice}", EXIT_OURS)


class _ToStderr(logging.Handler):
    """Log records as lines `warning: …` on whatever stderr is at the time."""

    def emit(self, record: logging.LogRecord) -> None:
        colour = "yellow" if record.levelno >= logging.WARNING else None
        click.echo(click.style(record.levelname.lower() + ": ", fg=colour) + record.getMessage(), err=True)


def _log_to_stderr() -> None:
    log = logging.getLogger("persp_sw")
    if not any(isinstance(handler, _ToStderr) for handler in log.handlers):
        log.addHandler(_ToStderr())
    if not sys.warnoptions:  # as a sentence, not as a line of our source
        warnings.showwarning = lambda message, *_, **__: log.warning("%s", message)


@click.group(
    cls=Program,
    invoke_without_command=True,
    epilog=_EXAMPLES,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="persp-sw")
@click.pass_context
def main(ctx: click.Context) -> None:
    """Perspective shear-warp volume rendering, with its measured error."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())
