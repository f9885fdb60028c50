"""Work that other threads do before its results are asked for.

For parts of a file that decode alone, as segments and groups of pictures do: kernels and FFmpeg let other threads run. Each
call has threads of its own, which end with it, so nothing needs care when a process forks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

AHEAD = 2  # results that are worked out at the same time, while the last one is used


def run_ahead(function: Callable[[Item], Result], items: Sequence[Item], ahead: int = AHEAD) -> Iterator[Result]:
    """Yield ``function(item)`` for each item in turn, worked out on up to ``ahead`` other threads, from the call on.

    One item alone, or all where ``ahead`` is 0, are worked out by the caller's thread when they are asked for. Errors of
    ``function`` are raised in the place of its result; what follows is then not begun.
    """
    if len(items) < 2 or ahead < 1:
        return map(function, items)
    pool = ThreadPoolExecutor(ahead, "gvpipe-ahead")
    pending = deque(pool.submit(function, item) for item in items[:ahead])
    return _collect(pool, pending, function, items[ahead:])


def _collect(
    pool: ThreadPoolExecutor, pending: deque[Future[Result]], function: Callable[[Item], Result], rest: Sequence[Item]
) -> Iterator[Result]:
    try:
        for item in rest:
            result = pending.popleft().result()
            pending.append(pool.submit(function, item))
            yield result
        while pending:
            yield pending.popleft().result()
    finally:
        pool.shutdown(cancel_futures=True)  # waits for what has begun: it may read the caller's files
