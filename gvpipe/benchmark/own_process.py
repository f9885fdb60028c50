"""A command of gvpipe in a process of its own: its time, start-up included, and its largest memory.

The process writes its memory to a file as it ends: what the system tells of an ended process may be what its parent had.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gvpipe.foundation.atomic import temporary_folder
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.isolation.python import TimeoutExpired, run_python

ENTRY = """
import sys
from gvpipe.benchmark.memory import write_peak_at_exit
write_peak_at_exit(sys.argv.pop(1))
from gvpipe.cli import main
main()
"""


@dataclass(frozen=True)
class Cost:
    """What a command took.

    Args:
        seconds: from its start to its end.
        cpu_seconds: processor time, its child processes' included; None where the system does not tell.
        peak_mb: largest resident memory, 2**20 bytes; None where the system does not tell.
    """

    seconds: float
    cpu_seconds: float | None
    peak_mb: float | None


def measure_command(words: Sequence[str], limit: float | None = None) -> Cost | None:
    """Run ``gvpipe WORDS``; None if it took more than ``limit`` seconds, if one is given, and was ended.

    Raises:
        InputError: the command failed.
    """
    with temporary_folder() as folder:
        told = Path(folder, "peak")
        before, started = _children_seconds(), time.perf_counter()
        try:
            done = run_python(["-c", ENTRY, str(told), *words], limit=limit)
        except TimeoutExpired:
            return None
        seconds, after = time.perf_counter() - started, _children_seconds()
        if done.status:
            raise InputError(f"gvpipe {' '.join(words)} failed: {done.last_line}")
        peak = told.read_text()
    return Cost(seconds, None if before is None or after is None else after - before, float(peak) if peak else None)


def _children_seconds() -> float | None:
    """Processor time of the child processes that have ended, and of theirs."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
