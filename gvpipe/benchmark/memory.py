"""The largest memory that this process has had."""

from __future__ import annotations

import atexit
import sys
from pathlib import Path


def peak_mb() -> float | None:
    """Peak resident memory of this process, 2**20 bytes; None where the system does not tell (Windows)."""
    try:
        lines = Path("/proc/self/status").read_text("ascii", errors="replace").splitlines()
        return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM:"))
    except (OSError, StopIteration):  # not Linux
        pass
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def write_peak_at_exit(path: str) -> None:
    """Let this process write `peak_mb` to a file as it ends; nothing where the system does not tell."""

    def write() -> None:
        peak = peak_mb()
        Path(path).write_text("" if peak is None else str(peak), "ascii")

    atexit.register(write)
