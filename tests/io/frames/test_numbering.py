"""Natural order: numbers by value, and total."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gvpipe.io.frames.numbering import natural_key


@given(st.lists(st.integers(0, 10**6), unique=True), st.text("ab_-", max_size=3))
def test_natural_order_is_numeric_order(numbers: list[int], prefix: str) -> None:
    assert sorted((f"{prefix}{n}.obj" for n in numbers), key=natural_key) == [f"{prefix}{n}.obj" for n in sorted(numbers)]


@given(st.lists(st.text("aB1023_. ", max_size=6), max_size=8, unique=True))
def test_natural_order_is_total(texts: list[str]) -> None:
    backwards = texts[::-1]
    assert sorted(texts, key=natural_key) == sorted(backwards, key=natural_key)
