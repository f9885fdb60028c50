"""Every read from a section is checked; varints are LEB128."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gvpipe.container.bitstream import ENTRY
from gvpipe.container.cursor import Cursor, varint
from gvpipe.foundation.errors import CorruptFile


@settings(max_examples=120)
@given(st.lists(st.integers(0, 2**64 - 1), max_size=8))
def test_varints(values: list[int]) -> None:
    """LEB128: as long as the bits need, read back in order, no prefix accepted."""
    data = b"".join(map(varint, values))
    assert len(data) == sum(max(1, -(-value.bit_length() // 7)) for value in values)
    cursor = Cursor(data, "x")
    assert [cursor.varint(2**64 - 1) for _ in values] == values and cursor.left == 0
    cursor.end()
    at_once = Cursor(data, "x")
    assert at_once.varints(len(values), 2**64 - 1) == values and at_once.left == 0
    if values:
        with pytest.raises(CorruptFile, match="section 'x'"):
            short = Cursor(data[:-1], "x")
            for _ in values:
                short.varint(2**64 - 1)
        with pytest.raises(CorruptFile, match="section 'x'"):
            Cursor(data[:-1], "x").varints(len(values), 2**64 - 1)
    if max(values, default=0):
        with pytest.raises(CorruptFile, match=f"a length is {max(values)}, above its limit"):
            Cursor(data, "x").varints(len(values), max(values) - 1, "a length")


def test_cursor_checks_every_read() -> None:
    reads: list[Callable[[Cursor], object]] = [
        lambda c: c.take(4),
        lambda c: c.array("<u2", 2),
        lambda c: c.array("<f8", 1 << 62),
        lambda c: c.varint(0x81),
        lambda c: c.varints(2, 0x81),
        lambda c: c.varints(3, 0x82),
        lambda c: c.end(),
        lambda c: c.struct(ENTRY),
    ]
    for read in reads:
        cursor = Cursor(b"\x82\x01\x03", "x")
        with pytest.raises(CorruptFile, match="section 'x' is corrupt"):
            read(cursor)
    with pytest.raises(CorruptFile, match="longer than 10"):
        Cursor(b"\xff" * 20, "x").varint(2**80)
    for value in (-1, 2**64):
        with pytest.raises(ValueError, match="varint"):
            varint(value)
