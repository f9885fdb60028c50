"""Range coding of integers that come in blocks, each coded in the light of the blocks before it.

What: one range-coded stream and one set of frequency tables for a sequence of blocks; a block's contexts may depend on anything
decoded before, so the reader asks block by block and may stop early.
Why: `gvpipe.entropy.integers` needs all contexts before the first value. Values are folded to tokens as there; a token's low
bits go through the range coder too, right after their block, so that a prefix decodes without the rest::

    stream = [varint] context count C, C tables, then 32-bit words to the end
    table  = [varint] kind: 0 the context is empty; 1 two bytes follow, zero and ratio (`gvpipe.entropy.parametric_tables`);
             N + 1: N x [varint] frequency (0..4096); whichever is shorter with what it codes
    block  = tokens, context after context, each context's in order; then low bits in order, at most 16 at a time

All models are tables of integers.
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy import parametric_tables
from gvpipe.entropy.open_stream import open_stream
from gvpipe.entropy.tokens import CHUNK, MAX_BITS, MAX_TOKENS, TABLE_TOTAL, check_sizes
from gvpipe.foundation.arrays import Int64, Integers, UInt8, UInt32, UInt64
from gvpipe.foundation.elementary import log2

PARAMETRIC = 1  # kind of a table that two numbers describe


class BlockEncoder:
    """Collects blocks; tables and bytes are made when all are there.

    Examples:
        >>> coder = BlockEncoder(2)
        >>> coder.add(np.array([0, 1, -1]), np.array([0, 0, 1]))
        >>> BlockDecoder(coder.finish(), 2, "example").take(np.array([0, 0, 1])).tolist()
        [0, 1, -1]
    """

    def __init__(self, n_contexts: int) -> None:
        self._n_contexts = n_contexts
        self._blocks: list[tuple[list[tuple[int, UInt8]], Int64, UInt8]] = []
        self._counts = np.zeros((n_contexts, MAX_TOKENS), np.int64)

    def add(self, values: Integers, contexts: Integers) -> None:
        """Append a block of ``values (n,)``, magnitude below 2**39, in ``contexts (n,)``, 0..C-1."""
        from gvpipe.entropy.block_kernels import sort_tokens

        check_sizes(values)
        tokens, ends, low, n_low = sort_tokens(values.astype(np.int64), contexts.astype(np.int64), self._counts)
        groups = [(context, tokens[ends[context] : ends[context + 1]]) for context in np.flatnonzero(np.diff(ends)).tolist()]
        self._blocks.append((groups, low, n_low))

    def finish(self) -> bytes:
        """Return the stream of all blocks."""
        from gvpipe.entropy.range_decoder import edges_of
        from gvpipe.entropy.range_encoder import RangeEncoder

        head, edges = [varint(self._n_contexts)], []
        for counts in self._counts:
            described, table = _describe(counts)
            head.append(described)
            edges.append(edges_of(table) if len(table) > 1 else None)  # None: nothing to code
        coder = RangeEncoder()
        for groups, low, n_low in self._blocks:
            for context, tokens in groups:
                own = edges[context]
                if own is not None:
                    coder.encode(tokens, own)
            for shift in range(0, MAX_BITS, CHUNK):
                more = n_low > shift
                if not more.any():
                    break
                sizes = 1 << np.minimum(n_low[more].astype(np.int64) - shift, CHUNK)
                pieces = (low[more] >> shift) & (sizes - 1)
                coder.encode_uniform(pieces, sizes)
        return b"".join([*head, coder.finish().astype("<u4").tobytes()])


class BlockDecoder:
    """Mirror of `BlockEncoder`, as compiled loops: most blocks are small.

    Args:
        data: the stream.
        n_contexts: C.
        name: of the section, for messages.

    Attributes:
        stream: what kernels need (`gvpipe.entropy.block_kernels`).

    Raises:
        CorruptFile: the stream's tables are not what the encoder writes.
    """

    def __init__(self, data: bytes, n_contexts: int, name: str) -> None:
        self._cursor = Cursor(data, name)
        if self._cursor.varint(n_contexts, "the context count") != n_contexts:
            raise self._cursor.corrupt("its context count does not fit its content")
        tables = [self._table() for _ in range(n_contexts)]
        self.stream = open_stream(self._cursor, tables)

    def take(self, contexts: Integers) -> Int64:
        """Return the next block's values, ``(n,)``, for its ``contexts (n,)``; raises `CorruptFile` if they do not decode."""
        from gvpipe.entropy.block_kernels import take_block

        values, status = take_block(self.stream, contexts.astype(np.int64))
        self.check(status)
        return values

    def check(self, status: int) -> None:
        """Raise `CorruptFile` if a kernel's status is an error."""
        check_status(self._cursor, status)

    def _table(self) -> Int64:
        """The next context's frequencies; none if it is empty."""
        kind = self._cursor.varint(MAX_TOKENS + 1, "a table's kind")
        if kind == PARAMETRIC:
            zero, ratio = self._cursor.take(2)
            if ratio >= len(parametric_tables.RATIOS):
                raise self._cursor.corrupt(f"a table has ratio {ratio}")
            return parametric_tables.table(zero, ratio)
        frequencies = self._cursor.varints(kind - 1, TABLE_TOTAL, "a frequency")
        if frequencies and not frequencies[-1]:
            raise self._cursor.corrupt("a frequency table ends in zero")
        return np.array(frequencies, np.int64)

    def end(self) -> None:
        """Check that no word is left."""
        check_end(self._cursor, self.stream.state, self.stream.words)


def check_status(cursor: Cursor, status: int) -> None:
    """Raise `CorruptFile` if a kernel's status is an error."""
    from gvpipe.entropy.block_kernels import NO_TABLE, OUT_OF_RANGE

    if status == NO_TABLE:
        raise cursor.corrupt("a context is used that has no table")
    if status == OUT_OF_RANGE:
        raise cursor.corrupt("a value is out of range")
    if status:
        raise cursor.corrupt("its range-coded data do not decode")


def check_end(cursor: Cursor, state: UInt64, words: UInt32) -> None:
    """Raise `CorruptFile` if words are left, given a decoder's state and all of its words."""
    from gvpipe.entropy import range_decoder

    if not range_decoder.may_be_exhausted(state, words):
        raise cursor.corrupt("range-coded data are left over")


def _describe(counts: Int64) -> tuple[bytes, Int64]:
    """Choose a context's table for tokens of these counts; return its bytes and its frequencies."""
    if not counts.any():
        return varint(0), np.zeros(0, np.int64)
    size = int(np.flatnonzero(counts)[-1]) + 1
    counts = counts[:size]
    frequencies = np.where(counts > 0, np.maximum(1, counts * TABLE_TOTAL // int(counts.sum())), 0)
    described = varint(size + 1) + b"".join(varint(int(f)) for f in frequencies)
    if size < 2 or size > parametric_tables.N_TOKENS:
        return described, frequencies
    used = counts > 0
    bits = -(counts[used] * log2(frequencies[used] / frequencies.sum())).sum() + 8 * len(described)
    zero, ratio, bits_parametric = parametric_tables.best(np.pad(counts, (0, parametric_tables.N_TOKENS - size)))
    if bits_parametric + 8 * 3 < bits:
        return varint(PARAMETRIC) + bytes([zero, ratio]), parametric_tables.table(zero, ratio)
    return described, frequencies
