"""Range encoding inside compiled loops, mirror of `gvpipe.entropy.range_decoder`, where tables change while values are coded.

A state is ``(3,) uint64``: the lower end of the interval, its extent, and how many words are written. A carry goes back into
the words that are there.
"""

from __future__ import annotations

import numpy as np

from gvpipe.entropy.range_decoder import ONE, PRECISION, SHIFT, WORD
from gvpipe.foundation.arrays import Int64, UInt32, UInt64
from gvpipe.runtime.compiled import compiled

MOST_WORDS = 3  # of a value: a token and the low bits of 37


def start() -> UInt64:
    """The state before anything is encoded."""
    return np.array([0, (1 << 64) - 1, 0], np.uint64)


def finish(state: UInt64, words: UInt32) -> UInt32:
    """The words that a decoder needs, of a state after the last symbol; none where there was nothing to code."""
    lower, extent, n_words = (int(value) for value in state)
    if extent == (1 << 64) - 1:
        return words[:0]
    last = lower + (1 << 32) - 1 >> 32
    number = int.from_bytes(words[:n_words].astype(">u4").tobytes(), "big") << 32  # the carry goes all the way
    whole = (number + last).to_bytes(4 * (n_words + 1), "big")
    return np.frombuffer(whole, ">u4").astype(np.uint32)


@compiled
def encode_symbols(state: UInt64, words: UInt32, edges: UInt64, symbols: Int64) -> None:
    """Code ``symbols (n,)`` of a model with these edges; ``words`` has room for them."""
    for i in range(len(symbols)):
        left = edges[symbols[i]]
        _narrow(state, words, left, edges[symbols[i] + 1] - left)


@compiled
def encode_bits(state: UInt64, words: UInt32, value: int, width: int) -> None:
    """Code the low ``width`` bits, 1..16, of ``value``, all values alike."""
    share = np.uint64(PRECISION - width)
    _narrow(state, words, np.uint64(value) << share, ONE << share)


@compiled
def _narrow(state: UInt64, words: UInt32, left: np.uint64, probability: np.uint64) -> None:
    """Take the interval's share of 2**24 that begins at ``left``."""
    scale = state[1] >> SHIFT
    lower = state[0] + scale * left
    if lower < state[0]:  # it left 64 bits
        at = np.int64(state[2]) - 1
        words[at] += np.uint32(1)
        while words[at] == 0:
            at -= 1
            words[at] += np.uint32(1)
    extent = scale * probability
    if extent >> WORD == 0:
        words[np.int64(state[2])] = np.uint32(lower >> WORD)
        state[2] += ONE
        lower, extent = lower << WORD, extent << WORD
    state[0], state[1] = lower, extent
