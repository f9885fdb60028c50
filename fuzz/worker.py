"""A process that runs cases one after the other, and says what became of them. It may be killed by a case at any time."""

from __future__ import annotations

import gc
import os
import shutil
import sys
import time
import traceback
import warnings
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import SynchronizedArray
from pathlib import Path
from typing import Any

from fuzz import limits
from fuzz.limits import BAD, CRASHED, LARGE, SLOW, Verdict, judge
from fuzz.parts import Parts, Seed, Target

WARM_SECONDS = 600  # of processor time of a sound file, whose kernels may have to be compiled
MOST_MEMORY = 4 << 30  # bytes that a worker may take beside those it starts with
WORN = 1 << 30  # bytes at which a worker is replaced
CASE, STARTED, REFUSED, ACCEPTED, BUSY = range(5)  # numbers that the session reads while a worker is busy


@dataclass(frozen=True)
class Job:
    """Cases ``first`` to ``stop`` of a target."""

    target: str
    first: int
    stop: int


@dataclass(frozen=True)
class Finding:
    """A case that went wrong; its files are in ``folder``."""

    target: str
    number: int
    seed: str
    verdict: Verdict
    folder: str


def run_worker(connection: Connection, shared: SynchronizedArray[Any], options: Any) -> None:
    """Take jobs until there is none; send each `Finding`, and ``None`` after each job."""
    from fuzz.targets import load_targets

    warnings.simplefilter("ignore")
    os.environ["GVPIPE_LOG"] = ""
    _silence()
    targets = {target.name: target for target in load_targets(options)}
    _limit_memory()
    warm: set[tuple[object, str]] = set()  # parsers, and seeds that they have read
    while (job := connection.recv()) is not None:
        target = targets[job.target]
        for seed in target.seeds:
            if (target.parse, seed.name) not in warm:
                warm.add((target.parse, seed.name))
                _progress(shared, -1, WARM_SECONDS)  # kernels are compiled and loaded, so that no case pays for it
                run_case(target, seed.parts, Path(options.folder))
        for number in range(job.first, job.stop):
            _progress(shared, number, options.longest)
            seed, verdict = _judge(target, options.seed, number, Path(options.folder))
            shared[REFUSED] += verdict.kind == limits.REFUSED
            shared[ACCEPTED] += verdict.kind == limits.ACCEPTED
            shared[BUSY] += time.time() - shared[STARTED]
            if verdict.kind in BAD:
                connection.send(Finding(target.name, number, seed.name, verdict, options.folder))
                connection.recv()  # the session has copied the files
        shared[CASE] = -1
        connection.send(None)
        if _is_worn():
            return


def _judge(target: Target, run_seed: int, number: int, folder: Path) -> tuple[Seed, Verdict]:
    try:
        seed, parts = target.case(run_seed, number)
    except Exception:
        return target.seeds[0], Verdict(CRASHED, "the harness", traceback.format_exc())
    return seed, run_case(target, parts, folder)


def memory_folder() -> str | None:
    """A folder whose files are in memory, where the system has one."""
    return "/dev/shm" if os.path.isdir("/dev/shm") else None


def run_case(target: Target, parts: Parts, folder: Path) -> Verdict:
    """Write a case's files, parse the first, and say what became of it; what costs too much is tried again."""
    try:
        files = target.join(parts)
        path = write_files(files, folder)
    except Exception:
        return Verdict(CRASHED, "the harness", traceback.format_exc())
    size = sum(map(len, files.values()))
    verdict = judge(target, path, size)
    if verdict.kind in (SLOW, LARGE):  # code that loads costs once
        gc.collect()
        verdict = judge(target, path, size)
    return verdict


def write_files(files: dict[str, bytes], folder: Path) -> Path:
    """Write files in an empty folder; return the path of the first."""
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder / next(iter(files))


def _progress(shared: SynchronizedArray[Any], number: int, longest: int) -> None:
    """Say which case begins; the system ends this process if it takes longer, in seconds of processor time."""
    shared[STARTED], shared[CASE] = time.time(), number
    if sys.platform != "win32":
        import resource

        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        resource.setrlimit(resource.RLIMIT_CPU, (int(used) + longest + 1, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def _limit_memory() -> None:
    if sys.platform == "linux":
        import resource

        with open("/proc/self/statm") as file:
            size = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + MOST_MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _is_worn() -> bool:
    if sys.platform != "linux":
        return False
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") > WORN


def _silence() -> None:
    """Libraries in C print what they dislike."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
