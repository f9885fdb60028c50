"""A process of its own for a library that damaged files can crash: the reader runs there, and frames come from there.

A request is a name and arguments, an answer ``(state, result)``; both are pickles. The state is ``done``, ``refused`` with an
error's text, or ``changed`` with the text and the frame of a `TopologyChange`. The process ends with its input.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gvpipe.errors import InputError, TopologyChange, printable
from gvpipe.forks import ForkLock, renew_after_fork
from gvpipe.io.damage import LONGEST, unreadable

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1"}  # numpy loads 10 to 20 ms earlier, and has no large products here
DONE, REFUSED, CHANGED = "done", "refused", "changed"


class LibraryProcess:
    """A process that reads one file; in a forked child there is a new one.

    Args:
        path: of the file.
        module: that runs there; it calls `serve`.
        kind: of the file, for messages, such as ``"FBX"``.
        died: what a message says where the process dies.
    """

    def __init__(self, path: Path, module: str, kind: str, died: str) -> None:
        self._path, self._module, self._kind, self._died = path, module, kind, died
        self._lock = ForkLock()
        self._prepared: list[tuple[str, tuple[Any, ...]]] = []
        self._process: subprocess.Popen[bytes] | None = None
        self._finalizer: Any = None
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
            if self._process is None:
                self._start()
                for prepared in self._prepared:
                    self._exchange(*prepared)
            return self._exchange(name, arguments)

    def _start(self) -> None:
        self._process = start_process(self._module, self._path.absolute())
        self._finalizer = weakref.finalize(self, _end, self._process)

    def _exchange(self, name: str, arguments: tuple[Any, ...]) -> Any:
        process = self._process
        assert process is not None and process.stdin is not None and process.stdout is not None  # they are pipes
        with contextlib.suppress(OSError):  # it has died, which the answer says
            pickle.dump((name, arguments), process.stdin, protocol=5)
            process.stdin.flush()
        try:
            state, result = pickle.load(process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError) as exc:
            raise unreadable(self._path, self._kind, self._died) from exc
        if state == CHANGED:
            raise TopologyChange(*result)
        if state == REFUSED:
            said = str(result).removeprefix(f"{self._path.absolute()}: ")
            if printable(str(self._path)) in said:
                raise InputError(said)
            raise unreadable(self._path, self._kind, said)
        return result


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
