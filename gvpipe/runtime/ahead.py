"""Work that other threads do before its results are asked for.

It suits parts of a file that decode alone, such as clips and groups of pictures: kernels and FFmpeg let other threads run.
Threads end when the iterator is used up, or soon after it is dropped; one that is half read does not go on in a forked child.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager
from itertools import islice
from threading import Event
from typing import Generic, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

MANY = 1 << 15  # items that pay for another thread
AHEAD = 2  # results that are worked out at the same time, while the last one is used


def run_ahead(
    function: Callable[[Item], Result], items: Sequence[Item], ahead: int = AHEAD, n_threads: int | None = None
) -> Iterator[Result]:
    """Yield ``function(item)`` for each item in turn, up to ``ahead`` of them worked out on other threads, from the call on.

    With one of ``n_threads``, which are as many as are ahead if not given, an item is begun when the one before it is done.
    One item alone, or all where ``ahead`` is 0, are worked out by the caller's thread when they are asked for. Errors of
    ``function`` are raised in the place of its result; nothing further is begun then.
    """
    if len(items) < 2 or ahead < 1:
        return map(function, items)
    return _Ahead(function, items, ahead, n_threads or ahead)


@contextmanager
def beside(function: Callable[[], Result], worth: bool = True) -> Iterator[Callable[[], Result]]:
    """Work ``function()`` out on another thread during a ``with`` block, which gets a function that waits for the result.

    The block asks once. Where that is not ``worth`` a thread, the function is called then. Errors are raised where the block
    asks, and nowhere else. A block that is left waits.
    """
    if not worth:
        yield function
        return
    with ThreadPoolExecutor(1, "gvpipe-beside") as pool:
        yield pool.submit(function).result


def halves(n: int, many: int = MANY) -> list[slice]:
    """Cut ``n`` items for `run_ahead`: in two where they are ``many``. It does not depend on the machine, nor do results."""
    return [slice(0, n)] if n < many else [slice(0, n // 2), slice(n // 2, n)]


class _Ahead(Generic[Item, Result]):
    """Results in turn. Once it is dropped nothing further is begun, and what has begun ends by itself.

    Nobody waits then: the garbage collector may drop it anywhere, even while `threading` holds locks that ending threads need.
    """

    def __init__(self, function: Callable[[Item], Result], items: Sequence[Item], ahead: int, n_threads: int) -> None:
        self._function, self._rest = function, iter(items)
        self._pool = ThreadPoolExecutor(n_threads, "gvpipe-ahead")
        if n_threads == 1:
            self._function = _until_one_fails(function)
        self._pending: deque[Future[Result]] = deque()
        self._begin(ahead)

    def __iter__(self) -> Iterator[Result]:
        return self

    def __next__(self) -> Result:
        if not self._pending:
            self._end()
            raise StopIteration
        try:
            result = self._pending.popleft().result()
        except BaseException:
            self._end()
            raise
        self._begin(1)
        return result

    def __del__(self) -> None:
        self._end(wait=False)

    def _begin(self, n: int) -> None:
        self._pending.extend(self._pool.submit(self._function, item) for item in islice(self._rest, n))

    def _end(self, wait: bool = True) -> None:
        self._pending.clear()
        self._pool.shutdown(wait, cancel_futures=True)


def _until_one_fails(function: Callable[[Item], Result]) -> Callable[[Item], Result]:
    """As ``function``, for items one after the other; those after an error, which the caller finds first, are left out."""
    has_failed = Event()

    def call(item: Item) -> Result:
        if has_failed.is_set():
            raise CancelledError
        try:
            return function(item)
        except BaseException:
            has_failed.set()
            raise

    return call
