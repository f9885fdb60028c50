"""Range coding of integer arrays.

What: signed integers, grouped by context, become bytes; each context has its own frequency table.
Why: the coders that constriction offers are exact where their models are, so all models here are tables of integers,
sent with the data; no probability is ever computed from a formula.

A value ``x`` is folded to ``u = 2x`` (x >= 0) or ``-2x - 1`` (x < 0). ``u < 16`` is its own token; above that, the token
tells the bit length of ``u`` and its second highest bit, and the bits below follow raw::

    block   = [varint] context count C, C tables, [varint] word count W, [W x u32] range-coded tokens, raw bits
    table   = [varint] token count N (0: the context is empty), N x [varint] frequency (0..4096)
    raw     = the low bits of all values with token >= 16, in order of token, then of position; most significant
              bit first, padded with zero bits to a byte

Tokens are coded context after context, each context's in order of position.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Int64, Integers
from gvpipe.container.cursor import Cursor, varint

DIRECT = 16  # values of u that are tokens of their own
TABLE_TOTAL = 4096  # frequencies are scaled to about this total
MAX_BITS = 40  # bit length of the largest u
MAX_TOKENS = DIRECT + 2 * (MAX_BITS - 4)
MAX_CONTEXTS = 1 << 16


def encode_integers(values: Integers, contexts: Integers | None = None) -> bytes:
    """Range code ``values`` (any shape, read in C order).

    Args:
        values: signed integers, magnitude below 2**39.
        contexts: same shape, 0..65535; which table each value uses; None is one table for all. The decoder must know it.
    """
    import constriction

    tokens, extra, n_extra = tokenise(np.asarray(values, np.int64).ravel())
    groups = _groups(contexts, tokens.size)
    encoder = constriction.stream.queue.RangeEncoder()
    head = [varint(len(groups))]
    for group in groups:
        counts = np.bincount(tokens[group])
        table = np.where(counts > 0, np.maximum(1, counts * TABLE_TOTAL // max(1, len(group))), 0)
        head.append(varint(len(table)) + b"".join(varint(int(f)) for f in table))
        if len(table) > 1:
            encoder.encode(tokens[group].astype(np.int32), model(table))
    words = encoder.get_compressed().astype("<u4")
    return b"".join([*head, varint(len(words)), words.tobytes(), _pack_bits(tokens, extra, n_extra)])


def decode_integers(data: bytes, count: int, contexts: Integers | None = None, name: str = "integers") -> Int64:
    """Mirror of `encode_integers`: ``count`` integers, flat.

    Args:
        data: one whole block.
        count: how many values; the caller has checked it against its own limits.
        contexts: as given to the encoder, flat or not.
        name: the section, for messages.

    Raises:
        CorruptFile: the block is not what the encoder writes for that count.
    """
    import constriction

    cursor = Cursor(data, name)
    groups = _groups(contexts, count)
    if cursor.varint(MAX_CONTEXTS, "the context count") != len(groups):
        raise cursor.corrupt("its context count does not fit its content")
    tables = []
    for group in groups:
        size = cursor.varint(MAX_TOKENS, "a table's token count")
        tables.append(np.array([cursor.varint(TABLE_TOTAL, "a frequency") for _ in range(size)], np.int64))
        if len(group) and not tables[-1].any():
            raise cursor.corrupt("a frequency table is empty")
    words = cursor.array("<u4", cursor.varint(cursor.left, "the word count"))
    decoder = constriction.stream.queue.RangeDecoder(words.astype(np.uint32))
    tokens = np.zeros(count, np.int64)
    try:
        for group, table in zip(groups, tables, strict=True):
            if len(table) > 1 and len(group):
                tokens[group] = decoder.decode(model(table), len(group))
    except (ValueError, AssertionError, RuntimeError) as exc:
        raise cursor.corrupt("its range-coded data do not decode") from exc
    return _untokenise(tokens, cursor)


def _groups(contexts: Integers | None, count: int) -> list[NDArray[np.intp]]:
    """Positions of each context's values, in order."""
    if contexts is None:
        return [np.arange(count)]
    flat = np.asarray(contexts).ravel()
    if flat.size != count:
        raise ValueError(f"{flat.size} contexts for {count} values")
    order = np.argsort(flat, kind="stable")
    ends = np.cumsum(np.bincount(flat))
    return np.split(order, ends[:-1]) if count else []


def model(table: Int64) -> Any:
    """The library's model of a table of frequencies, two at least."""
    import constriction

    # integer / integer is one correctly rounded operation: the same on every machine
    return constriction.stream.model.Categorical(table.astype(np.float64) / float(table.sum()), perfect=False)


def tokenise(values: Int64) -> tuple[Int64, Int64, Int64]:
    """Tokens of ``values (n,)``, the low bits that they leave out, and how many these are.

    Raises:
        ValueError: a value is too large.
    """
    u = np.where(values >= 0, 2 * values, -2 * values - 1)
    if u.size and int(u.max()) >= 1 << MAX_BITS:
        raise ValueError(f"a value of {int(np.abs(values).max())} does not fit the entropy coder ({MAX_BITS - 1} bits)")
    bits = np.frexp(u.astype(np.float64))[1].astype(np.int64)  # exact: u < 2**53
    n_extra = np.where(u < DIRECT, 0, bits - 2)
    second = (u >> n_extra) & 1
    tokens = np.where(u < DIRECT, u, DIRECT + 2 * (bits - 5) + second)
    return tokens, u & ((1 << n_extra) - 1), n_extra


def _untokenise(tokens: Int64, cursor: Cursor) -> Int64:
    bits = (tokens - DIRECT) // 2 + 5
    n_extra = np.where(tokens < DIRECT, 0, bits - 2)
    total = int(n_extra.sum())
    packed = cursor.take((total + 7) // 8)
    cursor.end()
    u = np.where(tokens < DIRECT, tokens, (2 + (tokens & 1)) << n_extra)
    large = np.flatnonzero(tokens >= DIRECT)
    large = large[np.argsort(tokens[large].astype(np.uint8), kind="stable")]
    width = n_extra[large]
    start = np.cumsum(width) - width
    raw = np.frombuffer(packed + bytes(8), np.uint8)
    eight = raw[(start >> 3)[:, None] + np.arange(8)].view(">u8")[:, 0].astype(np.uint64)  # from each value's first byte on
    bits_left = (64 - (start & 7) - width).astype(np.uint64)
    u[large] |= (eight >> bits_left).astype(np.int64) & ((1 << width) - 1)
    return np.where(u & 1, -((u + 1) >> 1), u >> 1)


def _pack_bits(tokens: Int64, extra: Int64, n_extra: Int64) -> bytes:
    planes = []
    for token in np.unique(tokens[tokens >= DIRECT]):
        where = np.flatnonzero(tokens == token)
        shifts = np.arange(int(n_extra[where[0]]) - 1, -1, -1)
        planes.append(((extra[where, None] >> shifts) & 1).astype(np.uint8).ravel())
    return np.packbits(np.concatenate(planes)).tobytes() if planes else b""
