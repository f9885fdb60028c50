"""Tables of a video that claim more than the file can hold."""

from __future__ import annotations

import struct

import pytest
from folders import GOLDEN

from gvpipe.container.sample_tables import check_tables
from gvpipe.foundation.errors import CorruptFile


def table(kind: bytes, *numbers: int) -> bytes:
    """A box of version 0 that holds 32-bit numbers."""
    content = bytes(4) + struct.pack(f">{len(numbers)}I", *numbers)
    return struct.pack(">I", 8 + len(content)) + kind + content


SIZES = table(b"stsz", 0, 3, 10, 20, 30)


@pytest.mark.parametrize(
    "moov",
    [
        SIZES,
        SIZES
        + table(b"stts", 1, 3, 512)
        + table(b"ctts", 2, 1, 0, 2, 512)
        + table(b"stsc", 1, 1, 3, 1)
        + table(b"stco", 1, 48),
        table(b"stsz", 7, 14),
        table(b"elst", 2, 3, 0, 1, 3, 0, 1) + SIZES,
    ],
)
def test_tables_that_fit_are_taken(moov: bytes) -> None:
    check_tables(moov, 100)


@pytest.mark.parametrize(
    ("moov", "message"),
    [
        (table(b"stsz", 1, 1 << 24), "16777216 samples of 16777216 bytes"),
        (table(b"stsz", 0, 4, 10, 20, 30), "4 samples"),
        (table(b"stsz", 0, 3, 10, 0, 30), "empty"),
        (table(b"stsz", 0, 3, 40, 40, 40), "3 samples of 120 bytes"),
        (b"stsz", "cut short"),
        (SIZES + table(b"stts", 1, 4, 512), "runs of 4 samples"),
        (SIZES + table(b"ctts", 1, 1 << 31, 512), "runs of 2147483648 samples"),
        (SIZES + table(b"stco", 9, 48), "9 entries"),
        (SIZES + table(b"elst", 5, *range(15)), "5 entries"),
        (SIZES + table(b"trak") + table(b"trak"), "more than one track"),
        (SIZES + SIZES, "more than one track"),
        (table(b"cmov"), "not used"),
        (table(b"mvex"), "not used"),
    ],
)
def test_others_are_refused(moov: bytes, message: str) -> None:
    with pytest.raises(CorruptFile, match=message):
        check_tables(moov, 100)


def test_golden_files_keep_to_it() -> None:
    for path in GOLDEN.glob("*.mp4"):
        data = path.read_bytes()
        at = data.index(b"moov") - 4
        check_tables(data[at : at + int.from_bytes(data[at : at + 4], "big")], len(data))
