"""Kernels of `gvpipe.entropy.serial_coder`: one value, noted or read."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.block_kernels import NO_DATA, NO_TABLE, OUT_OF_RANGE, BlockStream
from gvpipe.entropy.range_decoder import decode_bits, decode_symbol
from gvpipe.entropy.range_encoder import encode_bits, encode_symbols
from gvpipe.entropy.tokens import CHUNK, DIRECT
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled


class SerialCoder(NamedTuple):
    """Encoder or decoder of values one by one.

    Args:
        stream: what a decoder reads.
        values, contexts: ``(capacity,)`` what an encoder notes.
        progress: ``(2,)`` how many values there were, and the status: 0 or an error, after which all values read are 0.
        encodes: which of both it is.
    """

    stream: BlockStream
    values: Int64
    contexts: Int64
    progress: Int64
    encodes: bool


def empty_stream() -> BlockStream:
    """The stream of an encoder, which reads nothing."""
    return BlockStream(np.zeros(3, np.uint64), np.zeros(0, np.uint32), np.zeros((0, 1), np.uint64), np.zeros(0, np.int64))


@compiled
def encode_tokens(stream: BlockStream, contexts: Int64, tokens: Int64, low: Int64, n_low: Int64) -> None:
    """Write n values: ``tokens (n,)`` in ``contexts (n,)``, each followed by the ``n_low (n,)`` bits of ``low (n,)``."""
    for i in range(len(tokens)):
        context = contexts[i]
        if stream.sizes[context] > 1:
            encode_symbols(stream.state, stream.words, stream.edges[context], tokens[i : i + 1])
        for shift in range(0, n_low[i], CHUNK):
            width = min(n_low[i] - shift, CHUNK)
            encode_bits(stream.state, stream.words, low[i] >> shift & (1 << width) - 1, width)


@compiled
def code_value(coder: SerialCoder, context: int, value: int) -> int:
    """Note ``value`` and return it, or read and return a value; 0 after an error."""
    progress = coder.progress
    if coder.encodes:
        coder.values[progress[0]], coder.contexts[progress[0]] = value, context
        progress[0] += 1
        return value
    if progress[1]:
        return 0
    progress[0] += 1
    stream = coder.stream
    if not stream.sizes[context]:
        progress[1] = NO_TABLE
        return 0
    token = 0
    if stream.sizes[context] > 1:
        token = decode_symbol(stream.state, stream.words, stream.edges[context])
        if token < 0:
            progress[1] = NO_DATA
            return 0
    u = np.int64(token)
    if token >= DIRECT:
        width = (token - DIRECT) // 2 + 3
        u = np.int64(2 + (token & 1)) << width
        for shift in range(0, width, CHUNK):
            bits = decode_bits(stream.state, stream.words, min(width - shift, CHUNK))
            if bits < 0:
                progress[1] = NO_DATA
                return 0
            u |= np.int64(bits) << shift
    return int(-((u + 1) >> 1) if u & 1 else u >> 1)


@compiled
def refuse(coder: SerialCoder) -> None:
    """Mark what was read as out of range; an earlier error stays."""
    if coder.progress[1] == 0:
        coder.progress[1] = OUT_OF_RANGE
