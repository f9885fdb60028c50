"""What the tables of a video's ``moov`` box may say, checked before FFmpeg believes them.

Runs make tables short: 12 bytes can claim 2**32 samples, edits can show them again and again, and samples may overlap. So here
no sample is empty, samples take no more bytes than the file has, and there is one track of few edits. The tables are looked for
anywhere in the box, because FFmpeg does not mind where they are.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from gvpipe.foundation.errors import CorruptFile, corrupt

MAX_EDITS = 4  # encoders of other tools write one or two
HEAD = struct.Struct(">I")  # entries, after version and flags
SIZES = struct.Struct(">II")  # size of every sample or 0, samples
ENTRY_BYTES = {b"stts": 8, b"ctts": 8, b"stsc": 12, b"stco": 4, b"co64": 8, b"stss": 4, b"elst": 12, b"sbgp": 8, b"keys": 8}
BEFORE_COUNT = {b"sbgp": 8}  # bytes before the number of entries, where they are not 4: its type of group
RUNS = (b"stts", b"ctts")  # of samples: [32 bits] how many, and what they have in common
UNUSED = (b"cmov", b"stz2", b"mvex", b"moof")  # compressed headers, packed sizes, fragments


def check_tables(moov: bytes, n_bytes: int) -> None:
    """Raise `CorruptFile` unless the tables in a ``moov`` box fit a file of ``n_bytes``."""
    for kind in UNUSED:
        if kind in moov:
            raise _wrong(kind, "such boxes are not used")
    if moov.count(b"trak") > 1 or moov.count(b"stsz") > 1:
        raise _wrong(b"trak", "there is more than one track")
    n_samples = 0
    for table in _find(moov, b"stsz", 4):
        n_samples = max(n_samples, _count_samples(table, n_bytes))
    for kind, size in ENTRY_BYTES.items():
        for table in _find(moov, kind, BEFORE_COUNT.get(kind, 4)):
            _check_entries(kind, table, size, n_samples)


def check_no_samples(moov: bytes) -> None:
    """Raise `CorruptFile` unless the tables in the ``moov`` box of a video in fragments are empty.

    It holds one extension box, and a few edits at most.
    """
    for kind in (*UNUSED, b"sbgp"):
        if kind in moov and kind != b"mvex":
            raise _wrong(kind, "such boxes are not used")
    for kind in (b"trak", b"stsz", b"mvex", b"trex"):
        if moov.count(kind) != 1:
            raise _wrong(kind, "there is not one of it")
    for table in _find(moov, b"stsz", 4):
        if _count_samples(table, 0):
            raise _wrong(b"stsz", "pictures are in fragments alone")
    for kind, size in ENTRY_BYTES.items():
        for table in _find(moov, kind, BEFORE_COUNT.get(kind, 4)):
            _check_entries(kind, table, size, 0)


def _count_samples(table: bytes, n_bytes: int) -> int:
    if len(table) < SIZES.size:
        raise _wrong(b"stsz", "it is cut short")
    size, count = SIZES.unpack_from(table)
    total = size * count
    if not size:
        if 4 * count > len(table) - SIZES.size:
            raise _wrong(b"stsz", f"{count} samples are announced")
        sizes = np.frombuffer(table, ">u4", count, SIZES.size)
        total = int(sizes.sum(dtype=np.uint64))
        if count and not sizes.all():
            raise _wrong(b"stsz", "a sample is empty")
    if total > n_bytes:
        raise _wrong(b"stsz", f"{count} samples of {total} bytes are announced")
    return int(count)


def _check_entries(kind: bytes, table: bytes, size: int, n_samples: int) -> None:
    if len(table) < HEAD.size:
        raise _wrong(kind, "it is cut short")
    (count,) = HEAD.unpack_from(table)
    if size * count > len(table) - HEAD.size or (kind == b"elst" and count > MAX_EDITS):
        raise _wrong(kind, f"{count} entries are announced")
    if kind in RUNS:
        lengths = np.frombuffer(table, ">u4", 2 * count, HEAD.size)[::2]
        if int(lengths.sum(dtype=np.uint64)) > n_samples:
            raise _wrong(kind, f"runs of {lengths.sum(dtype=np.uint64)} samples are announced, there are {n_samples}")


def _find(moov: bytes, kind: bytes, skipped: int) -> Iterator[bytes]:
    """What follows each box head of a kind, after version and flags, to the end of all."""
    at = moov.find(kind)
    while at >= 0:
        yield moov[at + len(kind) + skipped :]
        at = moov.find(kind, at + 1)


def _wrong(kind: bytes, what: str) -> CorruptFile:
    return corrupt(f"table {kind.decode('ascii')!r} of its video does not hold: {what}")
