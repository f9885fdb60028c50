"""Range encoding, mirror of `gvpipe.entropy.range_decoder`: kernels for compiled loops, and `RangeEncoder` for arrays.

A state is ``(3,) uint64``: the lower end of the interval, its extent, and how many words are written. A carry goes back into
the words that are there.
"""

from __future__ import annotations

import numpy as np

from gvpipe.entropy.range_decoder import ONE, PRECISION, SHIFT, TOTAL, WORD
from gvpipe.foundation.arrays import Int64, Integers, UInt32, UInt64
from gvpipe.runtime.compiled import compiled

MOST_WORDS = 4  # of a value: a token and the low bits of 40


class RangeEncoder:
    """Collects symbols, array by array.

    Examples:
        >>> coder = RangeEncoder()
        >>> coder.encode(np.array([0, 0, 1, 0]), np.array([0, 1 << 23, 1 << 24], np.uint64))
        >>> coder.finish().tolist()
        [536870912]
    """

    def __init__(self) -> None:
        self._state = start()
        self._words = np.zeros(64, np.uint32)

    def encode(self, symbols: Integers, edges: UInt64) -> None:
        """Append ``symbols (n,)`` of a model with these ``edges`` (`gvpipe.entropy.range_decoder.edges_of_weights`)."""
        encode_symbols(self._state, self._room_for(len(symbols)), edges, symbols.astype(np.int64))

    def encode_uniform(self, values: Integers, sizes: Integers) -> None:
        """Append ``values (n,)``; each is one of ``sizes (n,)``, 1..2**24, values all alike, from 0 on."""
        encode_uniform(self._state, self._room_for(len(values)), values.astype(np.int64), sizes.astype(np.int64))

    def finish(self) -> UInt32:
        """Return the words that a decoder needs."""
        return finish(self._state, self._words)

    def _room_for(self, n: int) -> UInt32:
        """The words, with room for those of n symbols more: one each at most."""
        needed = int(self._state[2]) + n
        if needed > len(self._words):
            self._words = np.concatenate([self._words, np.zeros(max(n, len(self._words)), np.uint32)])
        return self._words


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
def encode_uniform(state: UInt64, words: UInt32, values: Int64, sizes: Int64) -> None:
    """Code ``values (n,)``, each one of ``sizes (n,)``, 1..2**24, values all alike; ``words`` has room for them."""
    for i in range(len(values)):
        share = np.uint64(TOTAL // sizes[i])
        left = np.uint64(values[i]) * share
        _narrow(state, words, left, share if values[i] < sizes[i] - 1 else np.uint64(TOTAL) - left)


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
