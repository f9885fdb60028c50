"""Kernels do not count references of their arguments, and leave those of others alone."""

from __future__ import annotations

import re
import sys
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from numba.core.compiler import DefaultPassBuilder

from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.borrowing import BorrowingCompiler
from gvpipe.runtime.compiled import compiled


class Pair(NamedTuple):
    one: Float64
    two: Float64


def swap_often(pair: Pair, n: int) -> float:
    """Take arrays out of a tuple, swap them, slice them, and replace one by an array of its own."""
    total = 0.0
    for i in range(n):
        pair = Pair(pair.two, pair.one)
        total += pair.one[i % len(pair.one)] + pair.two[1:][0]
        if i == n - 1:
            pair = Pair(np.ones(3), pair.two)
            total += pair.one[0]
    return total


def take_in_turns(pair: Pair, n: int) -> float:
    """Take one array, then the other."""
    total = 0.0
    for i in range(n):
        pair = Pair(pair.two, pair.one)
        total += pair.one[i % len(pair.one)]
    return total


def give_back(pair: Pair) -> Float64:
    """What returns an argument counts."""
    return pair.two[1:]


def test_loops_hold_no_counts() -> None:
    counted, borrowed = numba.njit(take_in_turns), numba.njit(pipeline_class=BorrowingCompiler)(take_in_turns)
    pair = Pair(np.arange(4.0), np.arange(5.0))
    assert counted(pair, 10) == borrowed(pair, 10)
    assert _count(counted) > 0 and _count(borrowed) == 0


def test_arguments_are_kept() -> None:
    kernel, pair = compiled(swap_often), Pair(np.arange(4.0), np.arange(5.0))
    first, references = kernel(pair, 10), [sys.getrefcount(array) for array in pair]
    assert {kernel(pair, 10) for _ in range(1000)} == {first}
    assert [sys.getrefcount(array) for array in pair] == references and pair.one.tolist() == [0, 1, 2, 3]


def test_what_is_returned_outlives_its_owner() -> None:
    kernel = compiled(give_back)
    part = kernel(Pair(np.arange(4.0), np.arange(100_000.0)))
    np.full(100_000, -1.0)
    assert part.base is not None and part[-1] == 99_999


def test_a_numba_without_the_step_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = DefaultPassBuilder.define_nopython_pipeline

    def shorter(state: object) -> object:
        steps = whole(state)
        steps.passes = [step for step in steps.passes if "lowering" not in step[0].__name__.lower()]
        return steps

    monkeypatch.setattr(DefaultPassBuilder, "define_nopython_pipeline", shorter)
    with pytest.raises(NotImplementedError, match="NativeLowering"):
        numba.njit(pipeline_class=BorrowingCompiler)(swap_often)(Pair(np.zeros(1), np.zeros(2)), 1)


def _count(kernel: Any) -> int:
    """Counts up and down in LLVM's code of a kernel, without what Python calls."""
    (text,) = kernel.inspect_llvm().values()
    functions = re.findall(r"^define ([^\n]*)\{\n(.*?)^\}", text, re.DOTALL | re.MULTILINE)
    bodies = [body for head, body in functions if "take_in_turns" in head and "cpython" not in head]
    assert bodies
    return len(re.findall(r"@NRT_(?:inc|dec)ref", "".join(bodies)))
