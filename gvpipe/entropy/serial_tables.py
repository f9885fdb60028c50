"""Frequency tables of a serial stream as few bytes: most of its contexts are small, and many are empty.

    tables = ceil(C / 8) bytes: bit c % 8 of byte c // 8 is set if context c is used; a table for each context used
    table  = [varint] 0, [8 bits] zero, [8 bits] ratio (`gvpipe.entropy.parametric_tables`)
           | [varint] N tokens, frequencies of tokens 0..N-1: [varint] frequency (0..4096);
             a frequency of 0 is followed by the [varint] number of further zeros

A table's total is chosen with its bytes in mind: a context of 30 values needs no frequencies of 12 bits.
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy import parametric_tables
from gvpipe.entropy.tokens import MAX_TOKENS, TABLE_TOTAL
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.elementary import log2

TOTALS = (64, 256, 1024, TABLE_TOTAL)  # that are tried, beside the counts themselves


def write_tables(counts: Int64) -> tuple[bytes, list[Int64]]:
    """Return the bytes of the tables for ``counts (C, MAX_TOKENS)``, and each one's frequencies, none for empty contexts."""
    is_used = np.asarray(counts.any(axis=1))
    described = [_describe(own) if used else (b"", np.zeros(0, np.int64)) for own, used in zip(counts, is_used, strict=True)]
    mask = np.packbits(is_used, bitorder="little").tobytes()
    return mask + b"".join(head for head, _ in described), [table for _, table in described]


def read_tables(cursor: Cursor, n_contexts: int) -> list[Int64]:
    """Mirror of `write_tables`: the frequencies of each context; raises `CorruptFile`."""
    mask = np.unpackbits(cursor.array("u1", (n_contexts + 7) // 8), bitorder="little")
    if mask[n_contexts:].any():
        raise cursor.corrupt("a context is used that does not exist")
    return [_read_table(cursor) if used else np.zeros(0, np.int64) for used in mask[:n_contexts]]


def bits_of(counts: Int64, table: Int64) -> float:
    """Bits that tokens of these ``counts (n,)`` take under frequencies ``table (n,)``."""
    used = counts > 0
    return float(-(counts[used] * log2(table[used] / max(1, int(table.sum())))).sum())


def _describe(counts: Int64) -> tuple[bytes, Int64]:
    """The cheapest table for tokens of these counts: its bytes and its frequencies."""
    size = int(np.flatnonzero(counts)[-1]) + 1
    counts, total = counts[:size], int(counts.sum())
    choices = []
    for scaled in sorted({min(total, TABLE_TOTAL), *(t for t in TOTALS if t < total)}):
        table = np.where(counts > 0, np.maximum(1, counts * scaled // total), 0)
        choices.append((_pack(table), table, bits_of(counts, table)))
    if 1 < size <= parametric_tables.N_TOKENS:
        padded = np.pad(counts, (0, parametric_tables.N_TOKENS - size))
        zero, ratio, bits = parametric_tables.best(padded)
        choices.append((varint(0) + bytes([zero, ratio]), parametric_tables.table(zero, ratio), bits))
    head, table, _ = min(choices, key=lambda choice: 8 * len(choice[0]) + choice[2])
    return head, table


def _pack(table: Int64) -> bytes:
    parts, zeros = [varint(len(table))], 0
    for frequency in table.tolist():
        if not frequency:
            zeros += 1
            continue
        if zeros:
            parts.append(varint(0) + varint(zeros - 1))
            zeros = 0
        parts.append(varint(frequency))
    return b"".join(parts)


def _read_table(cursor: Cursor) -> Int64:
    size = cursor.varint(MAX_TOKENS, "a table's number of tokens")
    if size == 0:
        zero, ratio = cursor.take(2)
        if ratio >= len(parametric_tables.RATIOS):
            raise cursor.corrupt(f"a table has ratio {ratio}")
        return parametric_tables.table(zero, ratio)
    frequencies: list[int] = []
    while len(frequencies) < size:
        frequencies.append(cursor.varint(TABLE_TOTAL, "a frequency"))
        if not frequencies[-1]:
            frequencies += [0] * cursor.varint(size - len(frequencies), "the number of zeros")
    if not frequencies[-1]:
        raise cursor.corrupt("a frequency table ends in zero")
    return np.array(frequencies, np.int64)
