"""Processes of this machine that do tasks, each with one BLAS thread; one that dies is replaced.

They are new Pythons, not forks: threads and compiled kernels of this process do not matter to them, and no ``__main__`` is run
again. They last as long as the pool, so that kernels are loaded once.
"""

from __future__ import annotations

import contextlib
import pickle
import queue
import signal
import threading
from collections import deque
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any, Self

from gvpipe.foundation.atomic import temporary_folder
from gvpipe.foundation.isolation.python import Process, TimeoutExpired, start_python
from gvpipe.tasks.executor import ATTEMPTS, Outcome, Prepare, WorkerDied
from gvpipe.tasks.worker import PREPARE, PROTOCOL, TASK, receive, send

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1")
TEMPORARY = ("TMPDIR", "TEMP", "TMP")  # where programs put temporary files; processes that are killed leave theirs
PATIENCE = 0.5  # seconds between looks at signals, which Windows passes on only then


class Processes:
    """A pool; a context manager, which ends them.

    Args:
        count: of processes. They start when there are tasks for them.
        attempts: times that a task is given to a process, if processes die of it.
    """

    def __init__(self, count: int, attempts: int = ATTEMPTS) -> None:
        self._count, self._attempts, self._slots = count, attempts, list[_Slot]()
        self._stack = contextlib.ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for slot in self._slots:
            slot.close()
        self._stack.close()

    def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Do tasks; see `gvpipe.tasks.executor.Executor`. Each process has one at a time."""
        if not self._slots:
            folder = self._stack.enter_context(temporary_folder())
            self._slots = [_Slot(folder) for _ in range(self._count)]
        waiting = deque(enumerate(tasks))
        ended: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
        first = pickle.dumps((PREPARE, prepare, data), PROTOCOL)
        busy = self._slots[: len(waiting)]
        given = first, waiting, ended, self._attempts
        threads = [threading.Thread(target=_serve, args=(slot, *given), daemon=True) for slot in busy]
        n_left = len(tasks)
        try:
            for thread in threads:
                thread.start()
            while n_left:
                with contextlib.suppress(queue.Empty):
                    yield ended.get(timeout=PATIENCE)
                    n_left -= 1
        finally:
            if n_left:  # nobody wants the rest
                waiting.clear()
                for slot in busy:
                    slot.close()
            for thread in threads:
                if thread.ident is not None:
                    thread.join()


class _Slot:
    """A place for one process, whose temporary files lie in a folder."""

    def __init__(self, folder: str) -> None:
        self._folder = folder
        self._process: Process[bytes] | None = None
        self._lock = threading.Lock()
        self._is_closed = False

    def ask(self, message: bytes) -> bytes:
        """What the process answers; raises `WorkerDied`."""
        self.tell(message)
        process = self._process
        try:
            if process is None or process.stdout is None:
                raise EOFError
            return receive(process.stdout)
        except (EOFError, OSError, ValueError) as exc:  # ValueError: closed meanwhile
            how = _how_it_ended(process)
            self.end()
            raise WorkerDied(how) from exc

    def tell(self, message: bytes) -> None:
        """Send a message to the process, a new one if there is none; raises `WorkerDied` once the place is closed."""
        with self._lock:
            if self._is_closed:
                raise WorkerDied("nobody wants its answer")
            process = self._process = self._process or _start(self._folder)
        with contextlib.suppress(OSError, ValueError):  # it has died, which the missing answer says
            if process.stdin is not None:
                send(process.stdin, message)

    @property
    def is_empty(self) -> bool:
        """Whether there is no process."""
        return self._process is None

    def close(self) -> None:
        """End the process for ever, in the middle of a task too."""
        with self._lock:
            self._is_closed = True
        self.end()

    def end(self) -> None:
        """End the process; the next message starts another."""
        with self._lock:
            process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()


def _serve(
    slot: _Slot, first: bytes, waiting: deque[tuple[int, Any]], ended: queue.SimpleQueue[Outcome], attempts: int
) -> None:
    """Give tasks to one process until none is left."""
    is_prepared = False
    while True:
        try:
            index, task = waiting.popleft()
        except IndexError:
            return
        outcome = Outcome(index)
        for _ in range(attempts):
            try:
                if slot.is_empty or not is_prepared:
                    slot.tell(first)
                    is_prepared = True
                outcome = _outcome(index, slot.ask(pickle.dumps((TASK, task), PROTOCOL)))
                break
            except WorkerDied as exc:
                outcome = Outcome(index, None, WorkerDied(f"{exc}, {attempts} times" if attempts > 1 else str(exc)))
            except Exception as exc:  # no process starts; the others' tasks go on
                outcome = Outcome(index, None, exc)
                break
        ended.put(outcome)


def _outcome(index: int, answer: bytes) -> Outcome:
    try:
        value, error = pickle.loads(answer)
    except Exception as exc:  # an exception that pickles, but not back
        return Outcome(index, None, exc)
    return Outcome(index, value, error)


def _start(folder: str) -> Process[bytes]:
    return start_python(["-m", "gvpipe.tasks.worker"], {**ONE_THREAD, **dict.fromkeys(TEMPORARY, folder)})


def _how_it_ended(process: Process[bytes] | None) -> str:
    """In a few words."""
    if process is None:
        return "its process was ended"
    try:
        status = process.wait(timeout=10)
    except TimeoutExpired:
        return "its process stopped answering"
    if status < 0:
        name = signal.Signals(-status).name if -status in set(signal.Signals) else f"signal {-status}"
        memory = ", as systems do that run out of memory" if name == "SIGKILL" else ""
        return f"its process was ended by {name}{memory}"
    return f"its process ended with status {status}"
