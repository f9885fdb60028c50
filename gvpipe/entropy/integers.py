"""Range coding of integer arrays.

What: signed integers, grouped by context, become bytes; each context has its own frequency table.
Why: a range coder is exact where its models are, so all models here are tables of integers, sent with the data; no
probability is ever computed from a formula.

A value ``x`` is folded to ``u = 2x`` (x >= 0) or ``-2x - 1`` (x < 0). ``u < 16`` is its own token; above that, the token
signals the bit length of ``u`` and its second highest bit, and the bits below follow raw::

    block   = [varint] context count C, C tables, [varint] word count W, [W x u32] range-coded tokens, raw bits
    table   = [varint] token count N (0: the context is empty), N x [varint] frequency (0..4096)
    raw     = the low bits of all values with token >= 16, in order of token, then of position; most significant
              bit first, padded with zero bits to a byte

Tokens are coded context after context, each context's in order of position.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.grouping import group_by_context
from gvpipe.entropy.tokens import DIRECT, MAX_TOKENS, TABLE_TOTAL, tokenise, untokenise
from gvpipe.foundation.arrays import Int64, Integers

MAX_CONTEXTS = 1 << 16
_EMPTY = np.zeros(0, np.intp)


def encode_integers(values: Integers, contexts: Integers | None = None) -> bytes:
    """Range code ``values`` (any shape, read in C order); returns one block of bytes.

    Examples:
        >>> decode_integers(encode_integers(np.array([3, -1, 0])), 3).tolist()
        [3, -1, 0]

    Args:
        values: signed integers, magnitude below 2**39.
        contexts: same shape, 0..65535; which table each value uses; None is one table for all. The decoder must derive it.

    Raises:
        ValueError: a value is too large.
    """
    from gvpipe.entropy.range_decoder import edges_of
    from gvpipe.entropy.range_encoder import RangeEncoder

    tokens, extra, n_extra = tokenise(np.asarray(values, np.int64).ravel())
    groups = _groups(contexts, tokens.size)
    encoder = RangeEncoder()
    head = [varint(len(groups))]
    for group in groups:
        counts = np.bincount(tokens[group])
        table = np.where(counts > 0, np.maximum(1, counts * TABLE_TOTAL // max(1, len(group))), 0)
        head.append(varint(len(table)) + b"".join(varint(int(f)) for f in table))
        if len(table) > 1:
            encoder.encode(tokens[group], edges_of(table))
    words = encoder.finish().astype("<u4")
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
    from gvpipe.entropy import range_decoder

    cursor = Cursor(data, name)
    groups = _groups(contexts, count)
    if cursor.varint(MAX_CONTEXTS, "the context count") != len(groups):
        raise cursor.corrupt("its context count does not fit its content")
    tables = []
    for group in groups:
        size = cursor.varint(MAX_TOKENS, "a table's token count")
        tables.append(np.array(cursor.varints(size, TABLE_TOTAL, "a frequency"), np.int64))
        if len(group) and not tables[-1].any():
            raise cursor.corrupt("a frequency table is empty")
    words = cursor.array("<u4", cursor.varint(cursor.left, "the word count")).astype(np.uint32)
    state, tokens = range_decoder.start(words), np.zeros(count, np.int64)
    for group, table in zip(groups, tables, strict=True):
        if len(table) > 1 and len(group):
            own = np.empty(len(group), np.int64)
            if not range_decoder.decode_symbols(state, words, range_decoder.edges_of(table), own):
                raise cursor.corrupt("its range-coded data do not decode")
            tokens[group] = own
    return untokenise(tokens, cursor)


def _groups(contexts: Integers | None, count: int) -> list[NDArray[np.intp]]:
    """Indices of each context's values, ascending, of contexts 0 up to the largest that occurs."""
    if contexts is None:
        return [np.arange(count)]
    flat = np.asarray(contexts).ravel()
    if flat.size != count:
        raise ValueError(f"{flat.size} contexts for {count} values")
    groups = dict(group_by_context(flat))
    return [groups.get(context, _EMPTY) for context in range(max(groups, default=-1) + 1)]


def _pack_bits(tokens: Int64, extra: Int64, n_extra: Int64) -> bytes:
    planes = []
    for token in np.unique(tokens[tokens >= DIRECT]):
        where = np.flatnonzero(tokens == token)
        shifts = np.arange(int(n_extra[where[0]]) - 1, -1, -1)
        planes.append(((extra[where, None] >> shifts) & 1).astype(np.uint8).ravel())
    return np.packbits(np.concatenate(planes)).tobytes() if planes else b""
