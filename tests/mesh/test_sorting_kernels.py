"""Sorting in kernels gives what numpy's stable sort gives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gvpipe.mesh.sorting_kernels import RUN, sort_numbers, sort_order


@given(st.lists(st.integers(-3, 3) | st.integers(-(2**31), 2**31 - 1), max_size=200))
def test_any_numbers(numbers: list[int]) -> None:
    keys = np.array(numbers, np.int64)
    assert np.array_equal(sort_order(keys), np.argsort(keys, kind="stable"))
    short = keys.astype(np.int32)
    sort_numbers(short)
    assert np.array_equal(short, np.sort(keys))


@pytest.mark.parametrize("n", [0, 1, RUN - 1, RUN, RUN + 1, 2 * RUN, 4 * RUN + 1, 10_000])
@pytest.mark.parametrize("kind", ["rising", "falling", "alike", "random"])
def test_lengths_about_those_of_runs(n: int, kind: str) -> None:
    rising = np.arange(n, dtype=np.int64)
    keys = {"rising": rising, "falling": rising[::-1].copy(), "alike": 0 * rising}.get(kind)
    keys = np.random.default_rng(n).integers(0, 50, n) if keys is None else keys
    assert np.array_equal(sort_order(keys), np.argsort(keys, kind="stable"))
