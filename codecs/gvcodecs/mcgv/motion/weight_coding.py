"""Skinning weights as bytes: most points take what their causal neighbours suggest, the others differ from it.

Points are visited in the codec's order. A point's causal neighbours give a list of clusters, heaviest first (`weight_kernels`).
A point takes what the list suggests, or has clusters of its own. These are their ranks in the list, and weights less those that
the list expects::

    section = [varint] length, [integers] own clusters of each point (0: what its list suggests), in the context of min(causal
              neighbours, 3); [varint] length, [integers] gaps between ranks, in the context of their number, 0..3;
              [integers] weights less the expected ones, all of a point's but the last, in the context of their number
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights
from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.foundation.elementary import exp2, log2

if TYPE_CHECKING:  # kernels import numba, which takes 0.3 s
    from gvcodecs.mcgv.motion.weight_kernels import WeightNumbers

SECTION = "weights"
COUNT_CONTEXTS = 4
MAX_GAP = 31  # gaps with prices of their own; larger ones have the last price


def encode_weights(weights: Weights, causal: CausalNeighbours) -> bytes:
    """Return the section ``weights``; clusters of each point are in the order of their ranks."""
    numbers = _describe(weights, causal)
    column, own, changed = _used(numbers.counts)
    first = encode_integers(numbers.counts, _count_contexts(causal))
    second = encode_integers(numbers.gaps[own], column[own])
    third = encode_integers(numbers.changes[changed], column[changed])
    return varint(len(first)) + first + varint(len(second)) + second + third


def decode_weights(data: bytes, causal: CausalNeighbours, n_clusters: int) -> Weights:
    """Mirror of `encode_weights`.

    Raises:
        CorruptFile: a point's clusters or weights are out of range.
    """
    from gvcodecs.mcgv.motion.weight_kernels import WeightNumbers, restore

    cursor = Cursor(data, SECTION)
    n_points = len(causal.starts) - 1
    counts = decode_integers(cursor.take(cursor.varint(cursor.left, "a length")), n_points, _count_contexts(causal), SECTION)
    if ((counts < 0) | (counts > INFLUENCES)).any():
        raise cursor.corrupt("a point follows more than four clusters")
    column, own, changed = _used(counts[counts > 0])  # few points have numbers
    second = cursor.take(cursor.varint(cursor.left, "a length"))
    gaps = decode_integers(second, int(own.sum()), column[own], SECTION)
    changes = decode_integers(cursor.rest(), int(changed.sum()), column[changed], SECTION)
    if ((gaps < 0) | (gaps >= n_clusters)).any() or (np.abs(changes) >= TOTAL).any():
        raise cursor.corrupt("a rank or a weight is out of range")
    weights, wrong = restore(causal, n_clusters, WeightNumbers(counts, gaps, changes))
    if wrong >= 0:
        raise cursor.corrupt(f"the weights of point {wrong} make no sense")
    return weights


class Prices(NamedTuple):
    """Bits of the section's numbers, for choosing weights; kernels take them as they are.

    Args:
        counts: ``(5,)`` by how many clusters a point has of its own; 0: what its list suggests.
        gaps: ``(4, 32)`` by column and gap.
        changes: ``(4, 64)`` by column and magnitude.
    """

    counts: Float64
    gaps: Float64
    changes: Float64


def guess_prices() -> Prices:
    """Prices before anything is coded."""
    gap = 1 + 2 * log2(1 + np.arange(MAX_GAP + 1.0))
    change = 2 + 1.5 * log2(1 + np.arange(float(TOTAL)))
    return Prices(np.array([0.5, 3, 3, 3, 3]), np.tile(gap, (INFLUENCES, 1)), np.tile(change, (INFLUENCES, 1)))


def learn_prices(causal: CausalNeighbours, weights: Weights) -> Prices:
    """Prices by how often numbers occur."""
    numbers, guess = _describe(weights, causal), guess_prices()
    _, own, changed = _used(numbers.counts)
    gap, change = [], []
    for j in range(INFLUENCES):
        gap.append(_bits(np.minimum(numbers.gaps[own[:, j], j], MAX_GAP), guess.gaps[j]))
        magnitudes = np.abs(numbers.changes[changed[:, j], j])
        change.append(_bits(magnitudes, guess.changes[j]) + (np.arange(TOTAL) > 0))  # the sign is a bit
    return Prices(_bits(numbers.counts, guess.counts), np.array(gap), np.array(change))


def _bits(values: Int64, guessed: Float64) -> Float64:
    """Bits of each value, by how often it occurs in ``values`` and by how many ``guessed (n,)``."""
    prior = np.array([exp2(-bits) for bits in guessed])
    frequencies = np.bincount(values, minlength=len(prior)) + 8 * prior / prior.sum()
    return np.asarray(-log2(frequencies / frequencies.sum()))


def _describe(weights: Weights, causal: CausalNeighbours) -> WeightNumbers:
    from gvcodecs.mcgv.motion.weight_kernels import describe

    return describe(causal, weights)


def _used(counts: Int64) -> tuple[Int64, Bool, Bool]:
    """For ``counts (P,)`` the column of each number, and which gaps and which changes are coded: ``(P, 4)`` each."""
    column = np.broadcast_to(np.arange(INFLUENCES), (len(counts), INFLUENCES))
    return column, column < counts[:, None], column < counts[:, None] - 1


def _count_contexts(causal: CausalNeighbours) -> Int64:
    return np.asarray(np.minimum(np.diff(causal.starts), COUNT_CONTEXTS - 1))
