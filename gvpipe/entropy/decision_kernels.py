"""Adaptive coding of binary decisions: mixed predictions, then a binary range coder. Kernels, for loops that are compiled.

What: each decision has K contexts. Each context has learnt a probability of a 1; a small network with a logistic output mixes
the K, learns from the decision, and so do the contexts. One body codes and decodes. Why: values of a field depend on more
things at once (place, time, component) than one table can have contexts for, and a short field cannot pay for tables. Nothing
is sent but decisions.

All is integers, below 2**53 in magnitude, so that any machine and JavaScript repeat it.

The range coder is carry-propagating, with a range of 32 bits and bytes out; a decision's 1 takes ``(range >> 16) * p`` from the
lower end.

Sources: M. Mahoney, "Adaptive Weighing of Context Models for Lossless Data Compression", 2005 (mixing); G. N. N. Martin,
"Range encoding", 1979.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.logistic_tables import LIMIT, squash_table, stretch_table
from gvpipe.foundation.arrays import Int64, Integers, UInt8, UInt32
from gvpipe.runtime.compiled import compiled, inlined

ONE_BITS = 22  # of a context's probability
SEEN_BITS = 8  # of how often a slot was used
TOP = 1 << 24  # range below which a byte leaves
RANGE = (1 << 32) - 1
AHEAD = 3  # bytes that a decoder has asked for beyond the last one of a stream, at its end
LOW, EXTENT, PLACE = 0, 1, 2  # of a coder's state; in a decoder LOW is the code's distance from the lower end
RATE_BITS = 18  # a mixer's learning: error times logit, shifted by so much
RATE = 5


class Mixing(NamedTuple):
    """What K contexts and their mixer have learnt.

    Args:
        chances: ``(K, S)`` uint32: above `SEEN_BITS`, the probability of a 1 in each slot of each context, in ``2**-ONE_BITS``;
            below, how often the slot was used, up to a limit.
        weights: ``(M, I + 1)`` of the mixers, one chosen per decision; 65536 is one. The last one is a bias'.
        inputs: ``(I + 1,)`` memory: logits of the K contexts, those of others if there are, and a bias.
        rates: share of an error that a slot takes, by how often it was used, in 1 / 65536.
        squash, stretch: of `gvpipe.entropy.logistic_tables`.
    """

    chances: UInt32
    weights: Int64
    inputs: Int64
    rates: Int64
    squash: Int64
    stretch: Int64


def new_mixing(n_contexts: int, n_slots: int, n_mixers: int, limit: int = 250, n_others: int = 0) -> Mixing:
    """Memory in which nothing is learnt, for K contexts and ``n_others`` inputs besides.

    ``limit`` (1..255): a slot's last uses that count, about.
    """
    n_inputs = n_contexts + n_others
    weights = np.full((n_mixers, n_inputs + 1), 65536 * 4 // (3 * n_inputs), np.int64)
    weights[:, -1] = 0
    rates = np.array([2 * 65536 // (2 * n + 3) for n in range(limit + 1)], np.int64)
    return Mixing(
        np.full((n_contexts, n_slots), 1 << (ONE_BITS - 1 + SEEN_BITS), np.uint32),
        weights,
        np.zeros(n_inputs + 1, np.int64),
        rates,
        squash_table(),
        stretch_table(),
    )


@compiled
def start_encoder() -> Int64:
    """The state of an encoder that has coded nothing."""
    return np.array([0, RANGE, 0], np.int64)


@compiled
def start_decoder(data: UInt8) -> Int64:
    """The state of a decoder at the start of ``data``; bytes behind its end count as 0."""
    state = np.array([0, RANGE, 4], np.int64)
    for i in range(4):
        state[LOW] = state[LOW] << 8 | (np.int64(data[i]) if i < len(data) else 0)
    return state


@inlined
def put(state: Int64, out: UInt8, chance: int, bit: int) -> None:
    """Encode a decision whose 1 has probability ``chance / 65536``, 1..65535; ``out`` has room for four more bytes."""
    bound = (state[EXTENT] >> 16) * chance
    if bit:
        state[EXTENT] = bound
    else:
        state[LOW] += bound
        state[EXTENT] -= bound
    if state[LOW] >> 32:  # carry into the bytes that have left
        state[LOW] &= RANGE
        i = state[PLACE] - 1
        while out[i] == 255:
            out[i] = 0
            i -= 1
        out[i] += np.uint8(1)
    while state[EXTENT] < TOP:
        out[state[PLACE]] = np.uint8(state[LOW] >> 24)
        state[PLACE] += 1
        state[LOW] = (state[LOW] << 8) & RANGE
        state[EXTENT] <<= 8


@compiled
def finish(state: Int64, out: UInt8) -> int:
    """Write what tells the last decisions apart; return how many bytes ``out`` has."""
    low = state[LOW] + TOP - 1 & ~(TOP - 1)  # the extent is at least TOP, so this lies within
    if low >> 32:
        i = state[PLACE] - 1
        while out[i] == 255:
            out[i] = 0
            i -= 1
        out[i] += np.uint8(1)
    out[state[PLACE]] = np.uint8((low >> 24) & 255)
    return int(state[PLACE] + 1)


@inlined
def take(state: Int64, data: UInt8, chance: int) -> int:
    """Decode a decision: mirror of `put`."""
    bound = (state[EXTENT] >> 16) * chance
    bit = 1 if state[LOW] < bound else 0
    if bit:
        state[EXTENT] = bound
    else:
        state[LOW] -= bound
        state[EXTENT] -= bound
    while state[EXTENT] < TOP:
        place = state[PLACE]
        state[LOW] = state[LOW] << 8 | (np.int64(data[place]) if place < len(data) else 0)
        state[PLACE] += 1
        state[EXTENT] <<= 8
    return bit


@compiled
def code_plain(state: Int64, data: UInt8, decoding: bool, bit: int) -> int:
    """Code or decode a decision whose outcomes are alike."""
    if decoding:
        return take(state, data, 32768)
    put(state, data, 32768, bit)
    return bit


@inlined
def code_decision(mixing: Mixing, slots: Integers, mixer: int, state: Int64, data: UInt8, decoding: bool, bit: int) -> int:
    """Code ``bit``, or decode it; then learn from it.

    Args:
        mixing: what was learnt; changes.
        slots: ``(K,)`` the slot of each context.
        mixer: 0..M-1.
        state, data: of the range coder.
        decoding: whether ``bit`` is unknown.
        bit: 0 or 1.
    """
    read_slots(mixing, slots)
    bit = code_inputs(mixing, mixer, (RATE, RATE_BITS), state, data, decoding, bit)
    learn_slots(mixing, slots, bit)
    return bit


@inlined
def read_slots(mixing: Mixing, slots: Integers) -> None:
    """Set the first K inputs: the logits of the slots' probabilities."""
    for k in range(len(slots)):
        mixing.inputs[k] = mixing.stretch[mixing.chances[k, slots[k]] >> (ONE_BITS + SEEN_BITS - 12)]


@inlined
def code_inputs(mixing: Mixing, mixer: int, rate: tuple[int, int], state: Int64, data: UInt8, decoding: bool, bit: int) -> int:
    """Code or decode a decision by the inputs alone; the mixer learns, by ``rate``: a factor, and bits to shift by."""
    inputs, weights = mixing.inputs, mixing.weights
    n = len(inputs) - 1
    total = 0
    inputs[n] = 256
    for k in range(n + 1):
        total += inputs[k] * weights[mixer, k]
    logit = min(max(total >> 16, -LIMIT), LIMIT)
    chance = mixing.squash[logit + LIMIT]
    if decoding:
        bit = take(state, data, chance)
    else:
        put(state, data, chance, bit)
    error = ((bit << 16) - bit) - chance
    for k in range(n + 1):
        weights[mixer, k] += (inputs[k] * error * rate[0]) >> rate[1]
    return bit


@inlined
def learn_slots(mixing: Mixing, slots: Integers, bit: int) -> None:
    """Move the slots' probabilities towards ``bit``."""
    for k in range(len(slots)):
        known = np.int64(mixing.chances[k, slots[k]])
        chance, used = known >> SEEN_BITS, known & ((1 << SEEN_BITS) - 1)
        chance += (((bit << ONE_BITS) - bit - chance) * mixing.rates[used]) >> 16
        mixing.chances[k, slots[k]] = chance << SEEN_BITS | min(used + 1, len(mixing.rates) - 1)
