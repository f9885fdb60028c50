"""Judge one case: what it raised, what it cost, what it gave."""

from __future__ import annotations

import contextlib
import os
import re
import sys
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fuzz.library_processes import library_cost
from fuzz.parts import BrokenPromise, Target
from fuzz.results import check_text
from gvpipe.foundation.budget import BYTES_PER_BYTE, SECONDS_PER_BYTE

PEAK = re.compile(rb"VmHWM:\s+(\d+) kB")
RESIDENT = re.compile(rb"VmRSS:\s+(\d+) kB")

ACCEPTED, REFUSED = "accepted", "refused"
CRASHED, BROKEN, SLOW, LARGE, HUNG = "crashed", "broken", "slow", "large", "hung"
BAD = (CRASHED, BROKEN, SLOW, LARGE, HUNG)


@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Args:
        kind: ``accepted``, ``refused``, or one of `BAD`.
        place: what findings of one cause have in common: an exception and where it was raised, or the part that was changed.
        detail: the message or the traceback.
    """

    kind: str
    place: str = ""
    detail: str = ""


def judge(target: Target, path: Path, size: int) -> Verdict:
    """Parse a file of ``size`` bytes and say what became of it."""
    with measured() as cost:
        verdict = _parse(target, path)
    if verdict.kind not in (ACCEPTED, REFUSED):
        return verdict
    allowed = max(target.memory, BYTES_PER_BYTE * size)
    if cost.memory > allowed:
        return Verdict(
            LARGE, target.name, f"{cost.memory >> 20} MB for {size} bytes; {allowed >> 20} MB are allowed ({verdict.detail})"
        )
    allowed_seconds = max(target.seconds, SECONDS_PER_BYTE * size)
    if cost.seconds > allowed_seconds:
        return Verdict(
            SLOW, target.name, f"{cost.seconds:.1f} s for {size} bytes; {allowed_seconds:.1f} s are allowed ({verdict.detail})"
        )
    return verdict


def _parse(target: Target, path: Path) -> Verdict:
    try:
        target.parse(path)
    except target.refusal as exc:
        try:
            check_text(str(exc))
            if not any(file.name in str(exc) for file in path.parent.rglob("*")):
                raise BrokenPromise(f"a message without the file's name: {exc}")
        except BrokenPromise as broken:
            return Verdict(BROKEN, f"message at {_origin(exc)}", str(broken))
        return Verdict(REFUSED, detail=str(exc))
    except BrokenPromise as exc:
        return Verdict(BROKEN, re.sub(r"[\d'\"].*", "", str(exc)), str(exc))
    except MemoryError as exc:
        return Verdict(LARGE, f"MemoryError at {_origin(exc)}", traceback.format_exc(limit=-6))
    except Exception as exc:
        return Verdict(CRASHED, f"{type(exc).__name__} at {_origin(exc)}", traceback.format_exc(limit=-12))
    return Verdict(ACCEPTED)


def _origin(exc: BaseException) -> str:
    """The last line of this project that an exception came through."""
    found = "?"
    for frame in traceback.extract_tb(exc.__traceback__):
        name = frame.filename.replace(os.sep, "/")
        for package in ("/gvpipe/", "/gvcodecs/"):
            if package in name and "site-packages" not in name:
                found = f"{name[name.rindex(package) + 1 :]}:{frame.lineno}"
    return found


@dataclass
class Cost:
    """Processor time, and bytes by which memory grew at its peak (0 where the system does not say).

    Time includes that of a library's process; memory is this process's or that one's, whichever is larger.
    """

    seconds: float = 0.0
    memory: int = 0


@contextlib.contextmanager
def measured() -> Iterator[Cost]:
    """Measure what is done inside."""
    cost = Cost()
    library_cost()
    before = _memory(reset=True)
    started = time.process_time()
    yield cost
    seconds, memory = library_cost()
    cost.seconds = time.process_time() - started + seconds
    cost.memory = max(_memory(reset=False) - before, memory)


def _memory(reset: bool) -> int:
    """Bytes that are resident now, the peak counted anew from here; or that peak."""
    if sys.platform != "linux":
        return 0
    if reset:
        with open("/proc/self/clear_refs", "wb") as file:
            file.write(b"5")
    with open("/proc/self/status", "rb") as file:
        found = (RESIDENT if reset else PEAK).search(file.read())
    return int(found[1]) << 10 if found else 0
