"""Rows of eight numbers in kernels: each number as numpy has it."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.arrays import Float64
from gvpipe.compiled import compiled
from gvpipe.lanes import LANES, load, same, store


@compiled
def combine(a: Float64, b: Float64, at: int, results: Float64) -> None:
    """Sums, differences, products, quotients, and three times the first numbers less one."""
    one, two = load(a, at), load(b, at)
    store(results, 0, one + two)
    store(results, LANES, one - two)
    store(results, 2 * LANES, one * two)
    store(results, 3 * LANES, one / two)
    store(results, 4 * LANES, same(3.0) * one - same(1.0))


@pytest.mark.parametrize("at", [0, 1, 3, 8])  # rows may begin anywhere
def test_each_lane_is_worked_out_as_numpy_does(at: int) -> None:
    rng = np.random.default_rng(at)
    a, b, results = rng.normal(size=20), rng.normal(size=20) * 1e6, np.zeros(5 * LANES + 1)
    combine(a, b, at, results)
    one, two = a[at : at + LANES], b[at : at + LANES]
    expected = np.concatenate([one + two, one - two, one * two, one / two, 3 * one - 1, [0]])
    assert np.array_equal(results, expected)
