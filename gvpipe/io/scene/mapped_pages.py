"""Pages of files that a library has mapped into memory, given back to the system.

USD's and Alembic's libraries map whole files and keep every page that was read. A long animation would count to the process's
memory although it is on the disk. Linux alone; elsewhere nothing happens.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Collection

DONT_NEED = 4  # Linux's MADV_DONTNEED: of pages that are only read, it forgets nothing but their place in memory
READ_ONLY = "r--"


def forget_pages(files: Collection[str]) -> int:
    """Let go of the pages of files that are mapped for reading; return how many bytes of address space those are.

    What is read again comes from the system's cache or the disk. Addresses stay as they are.
    """
    if not sys.platform.startswith("linux"):
        return 0
    wanted = {os.path.realpath(file) for file in files}
    try:
        with open("/proc/self/maps", encoding="utf-8", errors="surrogateescape") as maps:
            rows = [line.rstrip("\n").split(maxsplit=5) for line in maps]
        advise = ctypes.CDLL(None).madvise
    except (OSError, AttributeError):  # a system without /proc, or another C library
        return 0
    advise.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int]
    total = 0
    for row in rows:
        if len(row) == 6 and row[1].startswith(READ_ONLY) and row[5] in wanted:
            start, stop = (int(number, 16) for number in row[0].split("-"))
            total += stop - start if advise(start, stop - start, DONT_NEED) == 0 else 0
    return total
