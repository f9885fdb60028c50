"""Adaptive coding of numbers: each by binary decisions, whose probabilities are mixed from what several contexts have learnt.

What: a number is its bit length, one decision for each step up, then the bits below the highest, then its sign. A context is an
integer that both sides know. Its hash and the decision's place choose a slot; slots may be shared by chance. Why: a short list
whose numbers depend on more things at once than one table can have contexts for, such as what followed the same numbers before.

Nothing is sent but decisions (`gvpipe.entropy.decision_kernels`). Hashes are products modulo 2**32, which JavaScript has, too.
"""

from __future__ import annotations

import numpy as np

from gvpipe.entropy.decision_kernels import RANGE, Mixing, code_decision, code_plain, new_mixing
from gvpipe.foundation.arrays import Int64, UInt8, UInt32
from gvpipe.runtime.compiled import compiled, inlined

MAX_LENGTH = 40  # bits of a magnitude
MODELLED = 3  # bits below the highest that contexts predict; lower ones are alike
SLOT_BITS = 16
SIGN = 63
NODES = 64  # from here on: places of bits; below, of lengths and the sign
FACTOR = 0x9E3779B1  # 2**32 over the golden ratio, odd
MIXERS = 4  # of a group: length 0, other lengths, bits, sign


def new_number_mixing(n_contexts: int, n_groups: int) -> Mixing:
    """Memory in which nothing is learnt, for numbers of so many contexts and groups of mixers."""
    return new_mixing(n_contexts, 1 << SLOT_BITS, MIXERS * n_groups)


@inlined
def mix_hash(value: int, other: int) -> int:
    """A hash below 2**32 of one, and of any integer of a magnitude below 2**31."""
    mixed = ((int(value) ^ (int(other) & RANGE)) * FACTOR) & RANGE  # 64 bits may wrap round: the lower 32 stay
    return mixed ^ (mixed >> 15)


@compiled
def code_number(
    mixing: Mixing, contexts: Int64, group: int, state: Int64, data: UInt8, decoding: bool, signed: bool, number: int
) -> int:
    """Code ``number``, or decode it and return it; ``1 << MAX_LENGTH`` stands for one that is too large.

    Args:
        mixing: of `new_number_mixing`.
        contexts: ``(K,)`` 0..2**32 - 1; context k has slots of its own.
        group: of mixers.
        state, data, decoding: as of `code_decision`.
        signed: whether there are negative numbers.
        number: magnitude below ``2**MAX_LENGTH``.
    """
    slots = np.empty(len(contexts), np.uint32)
    magnitude = abs(number)
    length = 0
    while True:
        bit = 1 if magnitude >> length else 0
        find_slots(contexts, length, slots)
        if not code_decision(mixing, slots, MIXERS * group + min(length, 1), state, data, decoding, bit):
            break
        length += 1
        if length >= MAX_LENGTH:
            return 1 << MAX_LENGTH
    if length == 0:
        return 0
    value = 1
    for place in range(length - 2, -1, -1):
        bit = (magnitude >> place) & 1
        if length - 2 - place < MODELLED:
            find_slots(contexts, (length << 4 | value) + NODES, slots)
            bit = code_decision(mixing, slots, MIXERS * group + 2, state, data, decoding, bit)
        else:
            bit = code_plain(state, data, decoding, bit)
        value = value << 1 | bit
    if signed:
        find_slots(contexts, SIGN, slots)
        if code_decision(mixing, slots, MIXERS * group + 3, state, data, decoding, 1 if number < 0 else 0):
            value = -value
    return value


@compiled
def find_slots(contexts: Int64, node: int, slots: UInt32) -> None:
    """Fill ``slots (K,)``: those of the contexts for a decision's place."""
    for k in range(len(contexts)):
        slots[k] = mix_hash(contexts[k], node) >> (32 - SLOT_BITS)
