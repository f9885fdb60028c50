"""What does work elsewhere: the protocol, and what becomes of a task."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

Work = Callable[[Any], Any]
Prepare = Callable[[bytes], Work]
"""A function of a module, which makes of data the function that does tasks; called once by each worker and `Executor.run`."""

ATTEMPTS = 3  # times that a task is given to a worker, if workers die of it


class WorkerDied(Exception):
    """A task's workers ended without an answer; its text says how, in a few words."""


@dataclass(frozen=True)
class Outcome:
    """What became of a task.

    Args:
        index: of the task.
        value: what the work returned.
        error: what it raised instead, or `WorkerDied`.
    """

    index: int
    value: Any = None
    error: Exception | None = None


class Executor(Protocol):
    """Workers that do tasks, a bounded number of them at a time."""

    def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Do tasks by ``prepare(data)``; yield what became of each, as they end."""
        ...
