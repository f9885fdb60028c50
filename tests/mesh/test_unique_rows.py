"""Rows of integers: those that a list lacks."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gvpipe.mesh.unique_rows import left_out, sort_rows

ROWS = st.lists(st.tuples(*[st.integers(0, 3)] * 3), max_size=30)


def table(rows: list[tuple[int, ...]]) -> np.ndarray:
    return np.array(rows, np.int64).reshape(-1, 3)


@given(ROWS)
def test_rows_left_out_complete_those_returned(rows: list[tuple[int, ...]]) -> None:
    """Whatever part is returned, it and what is left out are the rows, each as often, in the order of `sort_rows`."""
    returned = rows[: len(rows) // 2]
    lacking = left_out(table(rows), table(returned[::-1]))
    assert Counter(map(tuple, lacking.tolist())) == Counter(rows) - Counter(returned)
    assert np.array_equal(sort_rows(lacking), np.arange(len(lacking)))


@pytest.mark.parametrize("returned", [[(0, 1, 3)], [(0, 1, 2), (0, 1, 2)]])
def test_rows_that_were_not_given_are_refused(returned: list[tuple[int, ...]]) -> None:
    with pytest.raises(ValueError, match="1 rows are returned that were not given"):
        left_out(table([(0, 1, 2), (2, 1, 0)]), table(returned))
