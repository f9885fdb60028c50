"""A command of gvpipe in a process of its own: its time, start-up included, and its largest memory.

The process writes its memory to a file as it ends: what the system tells of an ended process may be what its parent had.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gvpipe.errors import InputError

ENTRY = """
import sys
from gvpipe.benchmark.memory import write_peak_at_exit
write_peak_at_exit(sys.argv.pop(1))
from gvpipe.cli import main
main()
"""
LAST_LINE = -1  # of standard error, which says why


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
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder, "peak")
        before, started = _children_seconds(), time.perf_counter()
        try:
            done = subprocess.run(
                [sys.executable, "-c", ENTRY, str(told), *words], capture_output=True, text=True, timeout=limit, check=False
            )
        except subprocess.TimeoutExpired:
            return None
        seconds, after = time.perf_counter() - started, _children_seconds()
        if done.returncode:
            why = (done.stderr.strip().splitlines() or [f"status {done.returncode}, as when memory runs out"])[LAST_LINE]
            raise InputError(f"gvpipe {' '.join(words)} failed: {why}")
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
