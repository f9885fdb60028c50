"""The process of a command: streams that it inherits closed, signals that end it, memory that it gives back.

A closed standard stream leaves its number to the next file that is opened, and whatever a library prints would go there. So
the null device takes its place first. Signals that ask a command to end become an exception, so that it cleans up. Large arrays
that are freed go back to the system.
"""

from __future__ import annotations

import atexit
import contextlib
import errno
import gc
import io
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import Any, NoReturn, TextIO, cast

COLLECTED, USUAL = 100_000, gc.get_threshold()  # objects made between garbage collections
LARGE = 8 << 20  # bytes of an array that is given back; asking the system anew costs time, so smaller ones are kept
MMAP_THRESHOLD = -3  # M_MMAP_THRESHOLD of glibc's mallopt
ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))  # Windows has no SIGHUP


class Ended(BaseException):
    """A signal asks the process to end.

    Args:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@contextlib.contextmanager
def ending_by_exception() -> Iterator[None]:
    """Let signals that end the process raise `Ended`; ignored ones, as under ``nohup``, stay ignored."""
    if threading.current_thread() is not threading.main_thread():  # Python handles signals there alone
        yield
        return
    handled = [number for number in ENDING if signal.getsignal(number) == signal.SIG_DFL]
    for number in handled:
        signal.signal(number, _raise)
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)


def collect_seldom() -> None:
    """Look for objects in cycles seldom: a short command makes them by imports, hardly by its work."""
    gc.set_threshold(COLLECTED)
    atexit.register(gc.freeze)  # what the process takes along when it ends need not be looked through


def give_back_memory() -> None:
    """For a command that works long: look for cycles often, as compiling makes large ones, and give back large arrays.

    glibc keeps freed arrays of up to 32 MB for later. Linux with glibc alone; elsewhere that stays.
    ``MALLOC_MMAP_THRESHOLD_`` in the environment stands.
    """
    gc.set_threshold(*USUAL)
    if not sys.platform.startswith("linux") or "MALLOC_MMAP_THRESHOLD_" in os.environ:
        return
    import ctypes

    with contextlib.suppress(OSError, AttributeError):  # another C library
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, LARGE)


def replace_closed_streams() -> None:
    """Put something in the place of closed standard streams: empty input, output that reports an error, silent errors."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # it takes the lowest free number, which is this one
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115 - lives as long as the process
    if sys.stdout is None:
        sys.stdout = cast(TextIO, ClosedOutput())
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - lives as long as the process


class ClosedOutput(io.TextIOBase):
    """Standard output that is closed: whatever is written to it is an error."""

    @property
    def buffer(self) -> Any:
        """For bytes, the same."""
        return self

    def write(self, text: Any, /) -> int:
        """Raise `OSError`, if there is anything to write."""
        if not text:
            return 0
        raise OSError(errno.EBADF, "standard output is closed")


def _raise(number: int, frame: FrameType | None) -> NoReturn:
    signal.signal(number, signal.SIG_DFL)  # asked again, it ends at once
    raise Ended(number)
