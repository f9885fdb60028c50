"""What runs in a process of `gvpipe.io.library.process`: it answers requests, with limits of memory and time.

`limit_memory` lets the system refuse the process more memory than follows from the size of what it reads. The library then
raises an error or dies, which is one line either way. Linux alone has such a limit. `limited_time` has the system end the
process when the library takes too long.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from gvpipe.foundation.budget import SECONDS_PER_BYTE
from gvpipe.foundation.errors import InputError, TopologyChange
from gvpipe.io.damage import LONGEST

DONE, REFUSED, CHANGED = "done", "refused", "changed"  # states of an answer
LEAST_MEMORY, MEMORY_PER_BYTE = 1 << 30, 200  # bytes that the process may take in any case, and for each byte that it reads
LEAST_SECONDS = 5.0  # of the processor, to open a file; the time for each byte is that of geometry videos
TOO_LONG = -getattr(signal, "SIGXCPU", 0)  # status of a process that took more
MOST_LISTED = 10_000  # entries of folders that are looked at


def limit_memory(n_bytes: int) -> None:
    """Let this process take max(`LEAST_MEMORY`, `MEMORY_PER_BYTE` x n_bytes) beside what it has; mapped files do not count."""
    if sys.platform != "linux":  # others do not keep to such limits
        return
    import resource

    with open("/proc/self/status") as status:
        now = next((int(line.split()[1]) << 10 for line in status if line.startswith("VmData:")), 0)
    limits = [now + max(LEAST_MEMORY, MEMORY_PER_BYTE * n_bytes), *resource.getrlimit(resource.RLIMIT_DATA)]
    least = min(each for each in limits if each != resource.RLIM_INFINITY)
    resource.setrlimit(resource.RLIMIT_DATA, (least, limits[-1]))


@contextlib.contextmanager
def limited_time(n_bytes: int) -> Iterator[None]:
    """End the process when what runs inside takes max(`LEAST_SECONDS`, `SECONDS_PER_BYTE` x n_bytes) of the processor."""
    if sys.platform == "win32":  # it has no such limit
        yield
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    limits = [math.ceil(time.process_time() + max(LEAST_SECONDS, SECONDS_PER_BYTE * n_bytes)), soft, hard]
    resource.setrlimit(resource.RLIMIT_CPU, (min(each for each in limits if each != resource.RLIM_INFINITY), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))


def bytes_below(folder: Path, suffixes: tuple[str, ...]) -> int:
    """Bytes of all files of some extensions in a folder and below, where a file's references lie; links are not followed."""
    total = listed = 0
    for place, folders, names in os.walk(folder):
        listed += len(folders) + len(names)
        if listed > MOST_LISTED:
            break
        for name in names:
            if name.lower().endswith(suffixes):
                with contextlib.suppress(OSError):  # it has gone, or may not be looked at
                    total += os.stat(os.path.join(place, name)).st_size
    return total


def serve(answer: Callable[[str, tuple[Any, ...]], Any]) -> None:
    """Answer requests until the input ends, then end the process without taking anything down, which may crash."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing but answers may reach them
    while True:
        try:
            name, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            break
        pickle.dump(_state_of(answer, name, arguments), answers, protocol=5)
        answers.flush()
    os._exit(0)


def _state_of(answer: Callable[[str, tuple[Any, ...]], Any], name: str, arguments: tuple[Any, ...]) -> tuple[str, Any]:
    try:
        return DONE, answer(name, arguments)
    except TopologyChange as exc:
        return CHANGED, (str(exc), exc.frame)
    except InputError as exc:
        return REFUSED, str(exc)
    except Exception as exc:  # whatever it is, the other process turns it into one line
        return REFUSED, " ".join(str(exc).split())[:LONGEST] or type(exc).__name__
