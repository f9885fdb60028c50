"""Range coding of integers one by one: the context of each may depend on all values before it.

What: values become tokens as in `gvpipe.entropy.tokens`; the low bits that a token leaves out follow it::

    stream = tables, 32-bit range-coded words to the end

Why: one compiled function can then describe a format for both directions. It calls `code_value` for every value; when encoding,
the value is noted with its context, when decoding, it is read. So encoder and decoder cannot differ.
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.entropy.block_coder import check_end, check_status
from gvpipe.entropy.open_stream import open_stream
from gvpipe.entropy.serial_tables import bits_of, read_tables, write_tables
from gvpipe.entropy.tokens import MAX_TOKENS, tokenise
from gvpipe.foundation.arrays import Int64


class SerialEncoder:
    """Notes up to ``capacity`` values in kernels, then makes the stream.

    Attributes:
        coder: what kernels need.
    """

    def __init__(self, n_contexts: int, capacity: int) -> None:
        from gvpipe.entropy.serial_kernels import SerialCoder, empty_stream

        self._n_contexts = n_contexts
        values, contexts = np.zeros(capacity, np.int64), np.zeros(capacity, np.int64)
        self.coder = SerialCoder(empty_stream(), values, contexts, np.zeros(2, np.int64), True)

    @property
    def noted(self) -> tuple[Int64, Int64]:
        """Values and contexts, ``(n,)`` each."""
        count = int(self.coder.progress[0])
        return self.coder.values[:count], self.coder.contexts[:count]

    def finish(self) -> bytes:
        """Return the stream; raises ValueError if a value is too large (2**39)."""
        return encode_serial(*self.noted, self._n_contexts)


class SerialDecoder:
    """Mirror of `SerialEncoder`.

    Args:
        data: the stream.
        n_contexts: C.
        name: of the section, for messages.

    Attributes:
        coder: what kernels need.

    Raises:
        CorruptFile: the stream's tables are not what the encoder writes.
    """

    def __init__(self, data: bytes, n_contexts: int, name: str) -> None:
        from gvpipe.entropy.serial_kernels import SerialCoder

        self._cursor = Cursor(data, name)
        tables = read_tables(self._cursor, n_contexts)
        stream = open_stream(self._cursor, tables)
        none = np.zeros(0, np.int64)
        self.coder = SerialCoder(stream, none, none.copy(), np.zeros(2, np.int64), False)

    def end(self) -> None:
        """Raise `CorruptFile` if a kernel met an error, or left words unread."""
        check_status(self._cursor, int(self.coder.progress[1]))
        check_end(self._cursor, self.coder.stream.state, self.coder.stream.words)


def encode_serial(values: Int64, contexts: Int64, n_contexts: int) -> bytes:
    """Return the stream of ``values (n,)``, magnitude below 2**39, in ``contexts (n,)``, 0..C-1.

    Examples:
        >>> len(encode_serial(np.array([0, 0, 0]), np.array([0, 0, 1]), 2))
        6
    """
    from gvpipe.entropy import range_decoder, range_encoder
    from gvpipe.entropy.block_kernels import BlockStream
    from gvpipe.entropy.serial_kernels import encode_tokens

    tokens, low, n_low = tokenise(values)
    head, tables = write_tables(_count_tokens(tokens, contexts, n_contexts))
    words = np.zeros(range_encoder.MOST_WORDS * len(values), np.uint32)
    stream = BlockStream(range_encoder.start(), words, *range_decoder.edges_of_all(tables))
    encode_tokens(stream, contexts, tokens, low, n_low)
    return head + range_encoder.finish(stream.state, words).astype("<u4").tobytes()


def estimate_bytes(values: Int64, contexts: Int64, n_contexts: int) -> float:
    """About the length of `encode_serial`'s stream, faster."""
    tokens, _, n_low = tokenise(values)
    counts = _count_tokens(tokens, contexts, n_contexts)
    head, tables = write_tables(counts)
    bits = 16 + float(n_low.sum()) + sum(bits_of(own[: len(table)], table) for own, table in zip(counts, tables, strict=True))
    return len(head) + bits / 8


def _count_tokens(tokens: Int64, contexts: Int64, n_contexts: int) -> Int64:
    """``(C, MAX_TOKENS)`` how often each token comes in each context."""
    counts = np.bincount(contexts * MAX_TOKENS + tokens, minlength=n_contexts * MAX_TOKENS)
    return counts.reshape(n_contexts, MAX_TOKENS)
