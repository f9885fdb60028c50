"""A process that does tasks, one after the other: ``python -m gvpipe.tasks.worker``.

A message is its length and a pickle: ``("prepare", prepare, data)``, answered by nothing, or ``("task", task)``. Answers are
``(result, error)``. The process ends with its input, even in the middle of a task: its parent has gone, or wants no more.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import struct
import sys
import threading
from typing import IO, Any

from gvpipe.tasks.executor import Work

LENGTH = struct.Struct("<Q")
PREPARE, TASK = "prepare", "task"
PROTOCOL = 5  # of pickle


def send(stream: IO[bytes], message: bytes) -> None:
    """Write a message; raises OSError if nobody reads."""
    stream.write(LENGTH.pack(len(message)))
    stream.write(message)
    stream.flush()


def receive(stream: IO[bytes]) -> bytes:
    """Read a message; raises EOFError if the stream ends."""
    head = stream.read(LENGTH.size)
    message = stream.read(LENGTH.unpack(head)[0]) if len(head) == LENGTH.size else b""
    if len(head) < LENGTH.size or len(message) < LENGTH.unpack(head)[0]:
        raise EOFError("the other process has ended")
    return message


def main() -> None:
    """Do tasks until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all; the parent ends this one
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing but answers may reach the parent
    messages: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(messages,), daemon=True).start()
    work: Work = _unprepared
    while True:
        kind, *given = pickle.loads(messages.get())
        if kind == PREPARE:
            work = _prepared(*given)
        else:
            send(answers, _answer(work, given[0]))


def _listen(messages: queue.SimpleQueue[bytes]) -> None:
    """Pass messages on; end the process when they end."""
    try:
        while True:
            messages.put(receive(sys.stdin.buffer))
    finally:
        os._exit(0)


def _prepared(prepare: Any, data: bytes) -> Work:
    """What does tasks; if it cannot be made, what says so for each."""
    try:
        work: Work = prepare(data)
    except Exception as exc:
        error = exc

        def work(task: Any) -> Any:
            raise error

    return work


def _answer(work: Work, task: Any) -> bytes:
    try:
        return pickle.dumps((work(task), None), PROTOCOL)
    except Exception as exc:
        error = exc
    try:
        return pickle.dumps((None, error), PROTOCOL)
    except Exception:  # what pickling raises is anybody's guess
        return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")), PROTOCOL)


def _unprepared(task: Any) -> Any:
    raise RuntimeError("a task came before what does it")


if __name__ == "__main__":
    main()
