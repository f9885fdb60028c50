"""What is said of compiling, once in a process, to whoever listens to this module's logger. The command line does."""

from __future__ import annotations

import functools
import logging

from gvpipe.runtime.code_folder import why_none

LOGGER = logging.getLogger("gvpipe.runtime.compiled")
ONCE = "compiling kernels, once after installation; the first commands take half a minute longer, on slow machines a minute"
EVERY_TIME = (
    "compiling kernels in every run, since no safe folder takes machine code ({}); set NUMBA_CACHE_DIR to one of your own"
)
DAMAGED = "a file of machine code does not load (%s: %s); its kernel is compiled anew, and takes its place"


def announce_compiling() -> None:
    """Compiling all kernels of an encode takes up to a minute."""
    _announce(ONCE)


def announce_no_folder() -> None:
    """What is compiled cannot be kept."""
    _announce(EVERY_TIME.format(why_none()))


def announce_damaged(exc: Exception) -> None:
    """A file that was found is of no use."""
    _announce_damaged(type(exc).__name__, " ".join(str(exc).split())[:200])


@functools.cache
def _announce_damaged(kind: str, reason: str) -> None:
    LOGGER.info(DAMAGED, kind, reason)


@functools.cache
def _announce(message: str) -> None:
    LOGGER.info(message)
