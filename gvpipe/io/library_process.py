"""A process of its own for a library that damaged files can crash: the reader runs there, and frames come from there.

A request is a name and arguments, an answer ``(state, result)``; both are pickles. The state is ``done``, ``refused`` with an
error's text, or ``changed`` with the text and the frame of a `TopologyChange`. The process ends with its input.

`limit_memory` lets the system refuse the process more memory than follows from the size of what it reads. The library then
raises an error or dies, which is one line either way. Linux alone has such a limit.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gvpipe.errors import InputError, TopologyChange, printable
from gvpipe.forks import ForkLock, renew_after_fork
from gvpipe.io.damage import LONGEST, unreadable

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # numpy loads 10 to 20 ms earlier, and has no large products here
DONE, REFUSED, CHANGED = "done", "refused", "changed"
LEAST_MEMORY, MEMORY_PER_BYTE = 1 << 30, 200  # bytes that the process may take in any case, and for each byte that it reads
MOST_LISTED = 10_000  # entries of folders that are looked at
MOST_RUNNING = 16  # processes at a time: of more files, those that were asked longest ago wait until they are asked again


class LibraryProcess:
    """A process that reads one file; in a forked child, and after it had to make room for others, there is a new one.

    Args:
        path: of the file; of several, which one process may read, that of the next request.
        module: that runs there; it calls `serve`.
        kind: of the file, for messages, such as ``"FBX"``.
        died: what a message says where the process dies.
    """

    def __init__(self, path: Path, module: str, kind: str, died: str) -> None:
        self.path, self._module, self._kind, self._died = path, module, kind, died
        self._lock = ForkLock()
        self._prepared: list[tuple[str, tuple[Any, ...]]] = []
        self._process: subprocess.Popen[bytes] | None = None
        self._finalizer: Any = None
        self._asked = 0.0  # when that was last
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Leave the process to the parent."""
        if self._finalizer is not None:
            self._finalizer.detach()
        self._process = self._finalizer = None

    def prepare(self, name: str, *arguments: Any) -> Any:
        """As `ask`; a new process is asked the same first."""
        result = self.ask(name, *arguments)
        self._prepared.append((name, arguments))
        return result

    def ask(self, name: str, *arguments: Any) -> Any:
        """What the process answers.

        Raises:
            InputError: it refuses the file, or it dies.
            TopologyChange: as the reader there raised it.
        """
        with self._lock:
            self._asked = time.monotonic()
            if self._process is None:
                _make_room()
                self._start()
                for prepared in self._prepared:
                    self._exchange(*prepared)
            return self._exchange(name, arguments)

    def _start(self) -> None:
        self._process = start_process(self._module, self.path.absolute())
        self._finalizer = weakref.finalize(self, _end, self._process)
        with _running_lock:
            _running.add(self)

    def rest(self) -> None:
        """End the process, unless it is at work; the next request starts another."""
        if self._lock.try_acquire():
            try:
                if self._finalizer is not None:
                    self._finalizer()
                self._process = self._finalizer = None
            finally:
                self._lock.release()

    @property
    def asked(self) -> float | None:
        """When it was last asked, seconds of `time.monotonic`; None without a process."""
        return None if self._process is None else self._asked

    def _exchange(self, name: str, arguments: tuple[Any, ...]) -> Any:
        process = self._process
        assert process is not None and process.stdin is not None and process.stdout is not None  # they are pipes
        with contextlib.suppress(OSError):  # it has died, which the answer says
            pickle.dump((name, arguments), process.stdin, protocol=5)
            process.stdin.flush()
        try:
            state, result = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError) as exc:
            raise unreadable(self.path, self._kind, self._died) from exc
        if state == CHANGED:
            raise TopologyChange(*result)
        if state == REFUSED:
            said = str(result).removeprefix(f"{self.path.absolute()}: ")
            if printable(str(self.path)) in said:
                raise InputError(said)
            raise unreadable(self.path, self._kind, said)
        return result


_running: weakref.WeakSet[LibraryProcess] = weakref.WeakSet()
_running_lock = ForkLock()


def _make_room() -> None:
    """End processes that were asked longest ago, until another one may start."""
    with _running_lock:
        busy = [(each.asked, each) for each in _running]
    alive = sorted(((asked, each) for asked, each in busy if asked is not None), key=lambda pair: pair[0])
    for _, each in alive[: max(0, len(alive) + 1 - MOST_RUNNING)]:
        each.rest()


def start_process(module: str, path: Path) -> subprocess.Popen[bytes]:
    """A new Python that runs a module, with a path as its argument and pipes for requests and answers."""
    return subprocess.Popen(
        [sys.executable, "-m", module, os.fspath(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **ONE_THREAD},
    )


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    process.wait()


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
