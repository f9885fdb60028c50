"""A process of its own for a library that damaged files can crash: the reader runs there, and frames come from there.

A request is a name and arguments, an answer ``(state, result)``; both are pickles. The state is ``done``, ``refused`` with an
error's text, or ``changed`` with the text and the frame of a `TopologyChange`. The process ends with its input.
What runs there is in `gvpipe.io.library.worker`. Neither module imports NumPy: both processes load it at the same time.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import time
import weakref
from pathlib import Path
from typing import Any

from gvpipe.foundation.errors import InputError, TopologyChange, printable
from gvpipe.foundation.isolation.python import Process, TimeoutExpired, start_python
from gvpipe.io.damage import unreadable
from gvpipe.io.library.worker import CHANGED, REFUSED, TOO_LONG
from gvpipe.runtime.forks import ForkLock, renew_after_fork

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # numpy loads 10 to 20 ms earlier, and has no large products here
LONGEST_END = 10.0  # seconds until a process that has closed its pipe has ended
MOST_RUNNING = 16  # processes at a time: of more files, those that were asked longest ago wait until they are asked again


class LibraryProcess:
    """A process that reads one file; in a forked child, and after it had to make room for others, there is a new one.

    Args:
        path: of the file; of several, which one process may read, that of the first.
        module: that runs there; it calls `gvpipe.io.library.worker.serve`.
        kind: of the file, for messages, such as ``"FBX"``.
        died: what a message says where the process dies.
    """

    def __init__(self, path: Path, module: str, kind: str, died: str) -> None:
        self._path, self._module, self._kind, self._died = path, module, kind, died
        self._lock = ForkLock()
        self._prepared: list[tuple[str, tuple[Any, ...]]] = []
        self._process: Process[bytes] | None = None
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

    def ask(self, name: str, *arguments: Any, path: Path | None = None) -> Any:
        """What the process answers; of a process that reads several files, ``path`` is that of this request.

        Raises:
            InputError: it refuses the file, or it dies.
            TopologyChange: as the reader there raised it.
        """
        with self._lock:
            self._asked = time.monotonic()
            self._path = path or self._path
            self._begin()
            return self._exchange(name, arguments)

    def start(self) -> None:
        """Start the process now, so that it loads its library while this one goes on."""
        with self._lock:
            self._asked = time.monotonic()
            self._begin()

    def _begin(self) -> None:
        """See to it that there is a process that is prepared."""
        if self._process is None:
            _make_room()
            self._start()
            for prepared in self._prepared:
                self._exchange(*prepared)

    def _start(self) -> None:
        self._process = start_process(self._module, self._path.absolute())
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
            raise unreadable(self._path, self._kind, self._end_of(process)) from exc
        if state == CHANGED:
            raise TopologyChange(*result)
        if state == REFUSED:
            said = str(result).removeprefix(f"{self._path.absolute()}: ")
            if printable(str(self._path)) in said:
                raise InputError(said)
            raise unreadable(self._path, self._kind, said)
        return result

    def _end_of(self, process: Process[bytes]) -> str:
        """Why it has ended."""
        with contextlib.suppress(TimeoutExpired):  # it has closed its pipe, and lives
            if TOO_LONG and process.wait(LONGEST_END) == TOO_LONG:
                return "its library took more time than its size allows; if you trust it, use --unlimited (unlimited=True)"
        return self._died


_running: weakref.WeakSet[LibraryProcess] = weakref.WeakSet()
_running_lock = ForkLock()


def _make_room() -> None:
    """End processes that were asked longest ago, until another one may start."""
    with _running_lock:
        busy = [(each.asked, each) for each in _running]
    alive = sorted(((asked, each) for asked, each in busy if asked is not None), key=lambda pair: pair[0])
    for _, each in alive[: max(0, len(alive) + 1 - MOST_RUNNING)]:
        each.rest()


def start_process(module: str, path: Path) -> Process[bytes]:
    """A new Python that runs a module, with a path as its argument and pipes for requests and answers."""
    return start_python(["-m", module, os.fspath(path)], ONE_THREAD)


def _end(process: Process[bytes]) -> None:
    process.kill()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    process.wait()
