"""Where a codec's segments are coded: here, one after the other, or by whoever is asked instead (`gvpipe.tasks.segments`).

A codec whose segments do not depend on each other codes them by `map_segments` and says so by a class attribute,
``maps_segments = True``. Its bytes are the same wherever they are coded.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from contextvars import ContextVar
from typing import Any, TypeVar

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Result = TypeVar("Result")
Report = Callable[[float], None]
SegmentMap = Callable[[Callable[[Any, Any], Any], Any, Sequence[Any], Report], list[Any]]


def map_segments(work: Callable[[Shared, Task], Result], shared: Shared, tasks: Sequence[Task], report: Report) -> list[Result]:
    """Return ``work(shared, task)`` of each task, in their order.

    Args:
        work: a function of a module; what it is given and returns must pickle.
        shared: what all tasks need, such as the sequence and the settings.
        tasks: one for each segment.
        report: called with the part that is done, 0..1.
    """
    return _current.get()(work, shared, tasks, report)


@contextlib.contextmanager
def segments_mapped_by(mapped: SegmentMap) -> Iterator[None]:
    """Let ``mapped`` do what `map_segments` is asked for, in this thread until the block ends."""
    token = _current.set(mapped)
    try:
        yield
    finally:
        _current.reset(token)


def _map_here(work: Callable[[Any, Any], Any], shared: Any, tasks: Sequence[Any], report: Report) -> list[Any]:
    results = []
    for number, task in enumerate(tasks):
        report(number / len(tasks))
        results.append(work(shared, task))
    return results


_current: ContextVar[SegmentMap] = ContextVar("segment_map", default=_map_here)
