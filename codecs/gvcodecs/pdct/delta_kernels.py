"""Kernels of `delta_coding`: what both sides learn of a clip's deltas, and the decoder's loop over frames.

All numbers are integers; a probability is one division of integers, so that no rounding can part decoder and encoder.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.range_decoder import TOTAL, decode_symbols
from gvpipe.entropy.tokens import DIRECT
from gvpipe.foundation.arrays import Int64, UInt8, UInt32, UInt64
from gvpipe.runtime.compiled import compiled

MAX_BITS = 36  # bit length of the largest folded value
N_TOKENS = DIRECT + 2 * (MAX_BITS - 4)
GAIN = 32  # of a token's count, when it occurs
FULL = 1 << 16  # tokens' counts are halved from here on
SLOW_LEVELS = np.array([1, 4, 10, 20, 36, 56, 80, 112, 160, 224, 320, 512, 1024, 2048, 4096, 16384])
N_LEVELS = len(SLOW_LEVELS) + 1
N_RECENT = 5
KINDS = 2  # of coefficients: affine, DCT
N_BANDS = 16  # contexts of a clip's first frame: octaves of frequency
N_STEADY = KINDS * N_LEVELS * N_RECENT
N_CONTEXTS = N_STEADY + KINDS * N_BANDS
LARGEST = 1 << 16  # magnitudes count as this at most

UNIT = 16  # parts of a step that predictions are kept in
MEMORY = 3  # a group's sums lose 1/8 per frame
LIMIT = 1 << 18  # larger deltas count as this in the least squares, so that sums fit 64 bits

EXTRA_BITS = np.concatenate([np.zeros(DIRECT, np.int64), np.repeat(np.arange(3, MAX_BITS - 1), 2)])  # of each token
NO_DATA, NO_BITS = 1, 2  # what can be wrong


class Layout(NamedTuple):
    """What is known of the C coefficients of an axis beforehand.

    Args:
        kinds: ``(C,)`` 0 affine, 1 DCT.
        bands: ``(C,)`` octave of its frequency, 0..15.
        groups: ``(G + 1,)`` bounds of groups of coefficients, which share a weight in time.
    """

    kinds: Int64
    bands: Int64
    groups: Int64


class Learning(NamedTuple):
    """What the deltas so far have taught, and what they come to; one for a clip, alike on both sides.

    Args:
        counts: ``(contexts, tokens)``.
        slow: ``(3, C)`` running mean magnitudes of values, 64ths.
        last: ``(3, C)`` magnitudes of the last frame's values.
        products, squares: ``(G,)`` sums of the least squares for the weights.
        weights: ``(G,)`` part of the delta before that a delta repeats, sixteenths.
        delta: ``(3, C)`` the last delta, units; 0 after a clip's first, which tells nothing of motion.
        sums: ``(3, C)`` of all deltas, units.
        n_frames: ``(1,)`` so far.
    """

    counts: Int64
    slow: Int64
    last: Int64
    products: Int64
    squares: Int64
    weights: Int64
    delta: Int64
    sums: Int64
    n_frames: Int64


class DeltaStream(NamedTuple):
    """Coded deltas.

    Args:
        state: ``(3,)`` of `gvpipe.entropy.range_decoder`.
        words: ``(W,)`` range-coded data.
        raw: bytes of low bits.
        place: ``(1,)`` how many of their bits are read.
    """

    state: UInt64
    words: UInt32
    raw: UInt8
    place: Int64


@compiled
def start_learning(layout: Layout) -> Learning:
    """The state before a clip's first frame."""
    n, n_groups = len(layout.kinds), len(layout.groups) - 1
    return Learning(
        np.ones((N_CONTEXTS, N_TOKENS), np.int64),
        np.zeros((3, n), np.int64),
        np.zeros((3, n), np.int64),
        np.zeros(n_groups, np.int64),
        np.zeros(n_groups, np.int64),
        np.zeros(n_groups, np.int64),
        np.zeros((3, n), np.int64),
        np.zeros((3, n), np.int64),
        np.zeros(1, np.int64),
    )


@compiled
def find_contexts(layout: Layout, learning: Learning, axis: int, values: Int64, contexts: Int64) -> None:
    """Fill the contexts of an axis in ``contexts (3, C)``; ``values (3, C)`` holds this frame's axes before it."""
    slow, last, own = learning.slow, learning.last, contexts[axis]
    n = len(own)
    for i in range(n):
        if learning.n_frames[0] == 0:
            own[i] = N_STEADY + layout.kinds[i] * N_BANDS + layout.bands[i]
            continue
        near = 2 * slow[axis, i] + slow[0, i] + slow[1, i] + slow[2, i]
        recent = 2 * last[axis, i]
        if i > 0:
            near += slow[axis, i - 1]
            recent += last[axis, i - 1]
        if i + 1 < n:
            near += slow[axis, i + 1]
            recent += last[axis, i + 1]
        for before in range(axis):
            recent += 2 * abs(values[before, i])
        level = 0
        while level < N_LEVELS - 1 and SLOW_LEVELS[level] <= near >> 1:
            level += 1
        recent_level = int(recent > 0) + int(recent > 1) + int(recent > 3) + int(recent > 7)
        own[i] = (layout.kinds[i] * N_LEVELS + level) * N_RECENT + recent_level


@compiled
def predict_delta(layout: Layout, learning: Learning) -> Int64:
    """The next delta's prediction ``(3, C)``, units."""
    result = np.zeros_like(learning.delta)
    for group in range(len(layout.groups) - 1):
        weight = learning.weights[group]
        for axis in range(3):
            for i in range(layout.groups[group], layout.groups[group + 1]):
                result[axis, i] = (weight * learning.delta[axis, i]) >> 4
    return result


@compiled
def learn_frame(layout: Layout, learning: Learning, contexts: Int64, values: Int64) -> None:
    """Take in a frame's ``values (3, C)`` and their ``contexts (3, C)``."""
    _learn_counts(learning.counts, contexts, values)
    is_first = learning.n_frames[0] == 0
    slow, last = learning.slow, learning.last
    for axis in range(3):
        for i in range(values.shape[1]):
            magnitude = min(abs(values[axis, i]), LARGEST)
            slow[axis, i] += 16 * magnitude if is_first else (64 * magnitude - slow[axis, i]) >> 3
            last[axis, i] = magnitude
    _learn_motion(layout, learning, values)
    learning.n_frames[0] += 1


@compiled
def decode_deltas(layout: Layout, learning: Learning, stream: DeltaStream, sums: Int64) -> int:
    """Decode the next frames of a clip: the sums of their deltas ``sums (n, 3, C)``, units. Returns 0 or an error."""
    n = sums.shape[2]
    for frame in range(len(sums)):
        values, contexts = np.zeros((3, n), np.int64), np.zeros((3, n), np.int64)
        for axis in range(3):
            find_contexts(layout, learning, axis, values, contexts)
            status = _take_axis(learning.counts, stream, contexts[axis], values[axis])
            if status:
                return status
        learn_frame(layout, learning, contexts, values)
        for axis in range(3):
            for i in range(n):
                sums[frame, axis, i] = learning.sums[axis, i]
    return 0


@compiled
def _learn_counts(counts: Int64, contexts: Int64, values: Int64) -> None:
    for axis in range(3):
        for i in range(values.shape[1]):
            counts[contexts[axis, i], _token(values[axis, i])] += GAIN
    for context in range(len(counts)):
        own = counts[context]
        while own.sum() > FULL:
            for token in range(len(own)):
                own[token] = (own[token] + 1) >> 1


@compiled
def _learn_motion(layout: Layout, learning: Learning, values: Int64) -> None:
    """Add the delta to the sums, and learn how much of the one before it repeats."""
    predicted, delta, sums = predict_delta(layout, learning), learning.delta, learning.sums
    is_first = learning.n_frames[0] == 0
    for group in range(len(layout.groups) - 1):
        product, square = np.int64(0), np.int64(0)
        for axis in range(3):
            for i in range(layout.groups[group], layout.groups[group + 1]):
                now = predicted[axis, i] + UNIT * values[axis, i]
                sums[axis, i] += now
                if is_first:
                    continue
                before = min(max(delta[axis, i], -LIMIT), LIMIT)
                product += min(max(now, -LIMIT), LIMIT) * before
                square += before * before
                delta[axis, i] = now
        if is_first:
            continue
        learning.products[group] += product - (learning.products[group] >> MEMORY)
        learning.squares[group] += square - (learning.squares[group] >> MEMORY)
        weight = 16 * (learning.products[group] >> 4) // max(learning.squares[group] >> 4, 1)
        learning.weights[group] = min(max(weight, 0), 16)


@compiled
def _take_axis(counts: Int64, stream: DeltaStream, contexts: Int64, values: Int64) -> int:
    """Fill ``values (C,)``: tokens context by context, then low bits in order of position."""
    n = len(contexts)
    ends = np.zeros(N_CONTEXTS + 1, np.int64)
    for i in range(n):
        ends[contexts[i] + 1] += 1
    for context in range(N_CONTEXTS):
        ends[context + 1] += ends[context]
    edges, tokens = np.zeros(N_TOKENS + 1, np.uint64), np.empty(n, np.int64)  # context after context
    for context in range(N_CONTEXTS):
        start, end = ends[context], ends[context + 1]
        if start < end:
            _find_edges(counts[context], edges)
            if not decode_symbols(stream.state, stream.words, edges, tokens[start:end]):
                return NO_DATA
    for i in range(n):
        u = tokens[ends[contexts[i]]]
        ends[contexts[i]] += 1
        if u >= DIRECT:
            width = (u - DIRECT) // 2 + 3
            u = 2 + (u & 1)
            for _ in range(width):
                byte = stream.place[0] >> 3
                if byte >= len(stream.raw):
                    return NO_BITS
                u = 2 * u + ((stream.raw[byte] >> (7 - (stream.place[0] & 7))) & 1)
                stream.place[0] += 1
        values[i] = -((u + 1) >> 1) if u & 1 else u >> 1
    return 0


@compiled
def _find_edges(counts: Int64, edges: UInt64) -> None:
    """Fill ``edges (tokens + 1,)`` of ``counts``, as `gvpipe.entropy.range_decoder.edges_of`."""
    n, total = len(counts), float(counts.sum())
    sum_of_weights = 0.0
    for token in range(n):
        sum_of_weights += counts[token] / total
    scale = (TOTAL - n) / sum_of_weights
    before = 0.0
    for token in range(n):
        edges[token] = np.uint64(np.int64(before * scale) + token)
        before += counts[token] / total
    edges[n] = np.uint64(TOTAL)


@compiled
def _token(value: int) -> int:
    """The token of a value (`gvpipe.entropy.tokens`)."""
    u = 2 * value if value >= 0 else -2 * value - 1
    if u < DIRECT:
        return u
    bits = 0
    while u >> bits:
        bits += 1
    return DIRECT + 2 * (bits - 5) + ((u >> (bits - 2)) & 1)
