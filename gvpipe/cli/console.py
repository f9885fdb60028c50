"""What a command prints, and where: results on standard output, notes, progress and timings on standard error.

Every command has ``--json``, ``--quiet`` and ``--verbose`` and prints through an `Output` made of them. Where standard output
carries a file (``-``), results go to standard error too.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import json
import logging
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import click

from gvpipe.foundation.errors import OutputError
from gvpipe.foundation.text import escaped

if TYPE_CHECKING:
    from gvpipe.foundation.progress import Progress

COMPILER = "gvpipe.runtime.compiled"  # its logger; the module itself imports numba
VERBOSE = ("--verbose", "-v")

Command = Callable[..., None]


@dataclass(frozen=True)
class Output:
    """How much a command prints.

    Args:
        as_json: one JSON object instead of text.
        quiet: no text, notes or progress; JSON that is asked for, and errors, are printed still.
        verbose: the seconds of each stage too.
        beside: results go to standard error, since standard output carries a file.
    """

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False
    beside: bool = False

    def carrying(self, target: str) -> Output:
        """The output of a command that writes to ``target``, which may be ``-``."""
        return replace(self, beside=target == "-")

    def text(self, line: object) -> None:
        """Print a line of a result for people."""
        if not self.quiet and not self.as_json:
            _print(line, self.beside)

    def note(self, line: str) -> None:
        """Print what the user should know, one line."""
        if not self.quiet:
            click.echo(f"Note: {escaped(line)}", err=True)

    def json(self, values: dict[str, Any]) -> None:
        """Print a result as one JSON object, if that is asked for."""
        if self.as_json:
            _print(json.dumps(values, allow_nan=False), self.beside)

    @contextlib.contextmanager
    def progress(self) -> Iterator[Progress | None]:
        """A bar per stage, where standard error is a terminal; verbose: the seconds of each stage when it ends."""
        if self.verbose:
            stages = _Stages()
            with self._listening():
                yield stages
            stages.end()
        elif self.quiet or not sys.stderr.isatty():
            yield None
        else:
            with _bars() as show, self._listening():
                yield show

    @contextlib.contextmanager
    def _listening(self) -> Iterator[None]:
        """Note that kernels are being compiled, which takes long and shows no progress (`gvpipe.runtime.compiled`)."""
        if self.quiet:
            yield
            return
        logger, handler = logging.getLogger(COMPILER), _Noting()
        level = logger.level
        logger.setLevel(logging.INFO)
        logger.addHandler(handler)
        try:
            yield
        finally:
            logger.removeHandler(handler)
            logger.setLevel(level)


compress_option = click.option(
    "--compress",
    type=click.Choice(["none", "meshopt", "draco"]),
    default="none",
    show_default=True,
    help="Of a .glb: meshopt takes a third to three quarters of the bytes; draco makes the meshes smaller alone.",
)
unlimited_option = click.option(
    "--unlimited",
    is_flag=True,
    help="Let a geometry video or a USD file take whatever memory and time it asks for: you trust its source.",
)

real_time_option = click.option(
    "--real-time",
    is_flag=True,
    help="Keep a simulation's clock. [default: steps under 1/240 s or over 2 s become 25 frames a second; times are kept]",
)


def texture_options(command: Command) -> Command:
    """Give a command ``--texture`` and ``--texture-video``."""
    video = click.option("--texture-video", metavar="FILE", help="The same from a video.")
    pictures = click.option(
        "--texture", metavar="FOLDER|PATTERN", help="A picture for each frame, in place of the colours' texture."
    )
    return pictures(video(command))


volume_option = click.option(
    "--volume/--no-volume",
    default=None,
    help="Keep what lies inside of a simulation's surface: volume cells, points and their numbers. "
    "[default: encode: if that takes less than a third of the other bytes; convert: if OUTPUT can hold it]",
)
warp_option = click.option(
    "--warp", metavar="NAME[:SCALE]", help="Move vertices by a field of displacements, SCALE times as far. [default scale: 1]"
)


def output_options(command: Command) -> Command:
    """Give a command ``--json``, ``--quiet`` and ``--verbose``, and call it with ``out``, an `Output`."""
    as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
    return as_json(print_options(command))


def print_options(command: Command) -> Command:
    """The same without ``--json``, for a command that has its own."""

    @click.option("-q", "--quiet", is_flag=True, help="Print no progress, no notes and no text.")
    @click.option("-v", "--verbose", is_flag=True, help="Print the time of each stage; unexpected errors with their traceback.")
    @functools.wraps(command)
    def wrapped(*args: Any, quiet: bool, verbose: bool, as_json: bool = False, **options: Any) -> None:
        command(*args, out=Output(as_json, quiet, verbose), **options)

    return wrapped


def is_verbose(arguments: list[str]) -> bool:
    """Whether a command line asks for tracebacks; looked at before, and whether or not, it is parsed."""
    return any(argument in VERBOSE for argument in arguments)


def _print(text: object, beside: bool) -> None:
    """Print a result; raises `OutputError`, but leaves a reader that left to `gvpipe.cli.commands.main`."""
    try:
        click.echo(escaped(str(text), has_lines=True), err=beside)
    except BrokenPipeError:
        raise
    except OSError as exc:
        remedy = "free some space or print elsewhere" if exc.errno == errno.ENOSPC else "print elsewhere"
        raise OutputError(f"cannot print the result: {exc.strerror or exc}; {remedy}") from exc


class _Noting(logging.Handler):
    """Prints what a logger says as notes, while bars may be on the screen."""

    def emit(self, record: logging.LogRecord) -> None:
        # click would write behind the bars' back, and they erase that
        print(f"Note: {escaped(record.getMessage())}", file=sys.stderr)


class _Stages:
    """Progress that prints how long each stage took, and all of them."""

    def __init__(self) -> None:
        self._stage, self._since = "", time.perf_counter()
        self._started = self._since

    def end(self) -> None:
        """Print what is left."""
        self("", 1.0)
        click.echo(f"total: {time.perf_counter() - self._started:.2f} s", err=True)

    def __call__(self, stage: str, done: float) -> None:
        stage = escaped(stage)
        if stage == self._stage:
            return
        now = time.perf_counter()
        if self._stage:
            click.echo(f"{self._stage}: {now - self._since:.2f} s", err=True)
        self._stage, self._since = stage, now


@contextlib.contextmanager
def _bars() -> Iterator[Progress]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress as Bars

    with Bars(console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, Any] = {}

        def show(stage: str, done: float) -> None:
            stage = escape(escaped(stage))
            for name, task in tasks.items():
                if name != stage:
                    bars.update(task, completed=1.0)
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=done)

        yield show
