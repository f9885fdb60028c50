"""Locks and threads in processes that `os.fork` made, as `multiprocessing` and PyTorch's DataLoader do on Linux.

A fork copies one thread alone. A lock that another thread held stays locked in the child for ever, a pool waits for threads
that are not there, and an open file shares its position with the parent. So whoever has such things registers here, and makes
them anew in the child. What an object finds once and keeps has no lock at all (`kept`).
"""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable
from types import TracebackType
from typing import Any, Generic, Protocol, Self, TypeVar, overload

Value = TypeVar("Value")


class Forkable(Protocol):
    """What holds locks, threads or positions in files."""

    def after_fork(self) -> None:
        """Make them anew, in the child; no other thread runs there yet."""
        ...


_registered: weakref.WeakSet[Forkable] = weakref.WeakSet()


def renew_after_fork(thing: Forkable) -> None:
    """Let ``thing.after_fork()`` be called in every child process that is forked while ``thing`` is alive."""
    _registered.add(thing)


class kept(Generic[Value]):
    """A property that is found once for each object, and kept.

    `functools.cached_property` of Python 3.11 has one lock for all objects of a class, which a fork may copy locked. Here two
    threads may find the same value at the same time, and one of the two is kept.
    """

    def __init__(self, find: Callable[[Any], Value]) -> None:
        self._find, self.__doc__ = find, find.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type | None = None) -> Self: ...

    @overload
    def __get__(self, instance: object, owner: type | None = None) -> Value: ...

    def __get__(self, instance: object | None, owner: type | None = None) -> Self | Value:
        if instance is None:
            return self
        found: Value = instance.__dict__.setdefault(self._name, self._find(instance))
        return found


class ForkLock:
    """A re-entrant lock that is free in a forked child; a context manager."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        renew_after_fork(self)

    def __enter__(self) -> bool:
        return self._lock.__enter__()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._lock.__exit__(kind, error, trace)

    def try_acquire(self) -> bool:
        """Take it if no other thread has it, and say whether that was so; `release` gives it back."""
        return self._lock.acquire(blocking=False)

    def release(self) -> None:
        """Give it back."""
        self._lock.release()

    def after_fork(self) -> None:
        """Forget who held it."""
        self._lock = threading.RLock()


def _renew() -> None:
    for thing in list(_registered):
        thing.after_fork()


if hasattr(os, "register_at_fork"):  # not on Windows, which has no fork
    os.register_at_fork(after_in_child=_renew)
