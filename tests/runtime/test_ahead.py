"""Work ahead of its caller: the same results in the same order, on threads that end with it."""

from __future__ import annotations

import gc
import threading
import time

import pytest

from gvpipe.runtime.ahead import MANY, halves, run_ahead


def test_results_come_in_order_from_other_threads() -> None:
    def square(n: int) -> tuple[int, bool]:
        time.sleep(0.02 if n % 2 == 0 else 0)  # later ones are done before
        return n * n, threading.current_thread() is threading.main_thread()

    assert list(run_ahead(square, range(7))) == [(n * n, False) for n in range(7)]
    assert list(run_ahead(square, [3])) == [(9, True)]
    assert list(run_ahead(square, [1, 2], 0)) == [(1, True), (4, True)]
    assert list(run_ahead(square, [])) == []


def test_many_items_are_halved() -> None:
    assert halves(0) == [slice(0, 0)] and halves(MANY - 1) == [slice(0, MANY - 1)]
    first, second = halves(MANY + 1)
    assert first == slice(0, MANY // 2) and second == slice(MANY // 2, MANY + 1)


def test_no_more_is_begun_than_asked_for() -> None:
    begun: list[int] = []

    def begin(n: int) -> int:
        begun.append(n)
        time.sleep(0.05)
        return n

    results = run_ahead(begin, range(100), 2)
    assert next(results) == 0
    time.sleep(0.1)
    assert max(begun) <= 2  # the one returned, and two ahead


def test_one_thread_begins_an_item_when_the_one_before_is_done() -> None:
    begun: list[int] = []

    def begin(n: int) -> int:
        begun.append(n)
        time.sleep(0.01)
        assert begun[-1] == n
        if n == 3:
            raise ValueError("three")
        return n

    results = run_ahead(begin, range(9), 9, n_threads=1)
    time.sleep(0.2)
    assert begun == [0, 1, 2, 3]  # nobody had to ask, and nothing is begun after an error
    with pytest.raises(ValueError, match="three"):
        list(results)


@pytest.mark.parametrize("taken", [0, 1])
def test_what_is_dropped_begins_nothing_further(taken: int) -> None:
    ended: list[int] = []

    def end(n: int) -> int:
        time.sleep(0.05)
        ended.append(n)
        return n

    before = threading.active_count()
    results = run_ahead(end, range(100), 2)
    for _ in range(taken):
        next(results)
    del results
    deadline = time.monotonic() + 5
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == before
    assert len(ended) <= 2 + taken


def test_the_garbage_collector_waits_for_no_thread() -> None:
    """It runs in the middle of anything, `threading`'s own functions among them, whose locks an ending thread needs."""
    going_on = threading.Event()

    class Owner:
        """Holds results in a circle, as an error's traceback does."""

        def __init__(self) -> None:
            self.me, self.results = self, run_ahead(lambda n: going_on.wait(60), range(9), 2)

    def collect() -> None:
        Owner()
        gc.collect()

    collector = threading.Thread(target=collect, daemon=True)
    collector.start()
    collector.join(10)
    has_returned = not collector.is_alive()
    going_on.set()
    assert has_returned


def test_an_error_comes_in_the_place_of_its_result() -> None:
    def fail(n: int) -> int:
        if n >= 2:
            raise ValueError(f"number {n}")
        return n

    results = run_ahead(fail, range(9), 2)
    assert [next(results), next(results)] == [0, 1]
    with pytest.raises(ValueError, match="number 2"):
        next(results)
    assert list(results) == []
