"""The points' weights as bytes: most follow their neighbours, the others say how they differ.

Points are visited in the codec's order. A point's causal neighbours give a list of clusters, heaviest first (`weight_kernels`).
It follows what the list suggests, or clusters of its own: their ranks in the list (clusters that are not listed come
last, by number), and weights against those that the list expects::

    section = [varint] length, [integers] own clusters of each point (0: those of its list), in the context of min(causal
              neighbours, 3); [varint] length, [integers] gaps between ranks, in the context of the place, 0..3;
              [integers] weights less the expected ones, all of a point's but the last, in the context of the place
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours, causal_neighbours
from gvcodecs.mcgv.motion.skinning import INFLUENCES, TOTAL, Weights
from gvpipe.arrays import Float64, Int64
from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.integers import decode_integers, encode_integers

COUNT_CONTEXTS = 4


def encode_weights(weights: Weights, causal: CausalNeighbours) -> bytes:
    """Return the section ``weights``."""
    counts, gaps, changes = _described(weights, causal)
    slots = np.broadcast_to(np.arange(INFLUENCES), gaps.shape)
    own, changed = slots < counts[:, None], slots < counts[:, None] - 1
    first = encode_integers(counts, _count_contexts(causal))
    second = encode_integers(gaps[own], slots[own])
    third = encode_integers(changes[changed], slots[changed])
    return varint(len(first)) + first + varint(len(second)) + second + third


def decode_weights(data: bytes, neighbours: sparse.csr_array, n_clusters: int) -> Weights:
    """Mirror of `encode_weights`; raises `CorruptFile` where a point's clusters or weights make no sense."""
    from gvcodecs.mcgv.motion.weight_kernels import restore

    cursor = Cursor(data, "weights")
    causal = causal_neighbours(neighbours)
    n_points = len(causal.starts) - 1
    counts = decode_integers(cursor.take(cursor.varint(cursor.left, "a length")), n_points, _count_contexts(causal), "weights")
    if ((counts < 0) | (counts > INFLUENCES)).any():
        raise cursor.corrupt("a point follows more than four clusters")
    slots = np.broadcast_to(np.arange(INFLUENCES), (n_points, INFLUENCES))
    own, changed = slots < counts[:, None], slots < counts[:, None] - 1
    second = cursor.take(cursor.varint(cursor.left, "a length"))
    gaps = decode_integers(second, int(own.sum()), slots[own], "weights")
    changes = decode_integers(cursor.rest(), int(changed.sum()), slots[changed], "weights")
    if ((gaps < 0) | (gaps >= n_clusters)).any() or (np.abs(changes) >= TOTAL).any():
        raise cursor.corrupt("a rank or a weight is out of range")
    clusters, parts = np.zeros((n_points, INFLUENCES), np.int32), np.zeros((n_points, INFLUENCES), np.int32)
    wrong = restore(causal.starts, causal.near, n_clusters, counts, gaps, changes, clusters, parts)
    if wrong >= 0:
        raise cursor.corrupt(f"the weights of point {wrong} make no sense")
    return Weights(clusters, parts)


@dataclass(frozen=True)
class Prices:
    """Bits of the section's numbers, for choosing weights.

    Args:
        count: ``(5,)``; gap: ``(4, n)`` by place and gap; change: ``(4, 64)`` by place and magnitude.
    """

    count: Float64
    gap: Float64
    change: Float64

    @classmethod
    def guess(cls) -> Prices:
        """Prices before anything is coded."""
        gap = 1 + 2 * np.log2(1 + np.arange(32.0))
        change = 2 + 1.5 * np.log2(1 + np.arange(float(TOTAL)))
        return cls(np.array([0.5, 3, 3, 3, 3]), np.tile(gap, (INFLUENCES, 1)), np.tile(change, (INFLUENCES, 1)))

    @classmethod
    def learnt(cls, causal: CausalNeighbours, weights: Weights) -> Prices:
        """Prices by how often numbers occur."""
        counts, gaps, changes = _described(weights, causal)
        guess = cls.guess()
        slots = np.arange(INFLUENCES)
        own, changed = slots < counts[:, None], slots < counts[:, None] - 1
        gap = [_bits(np.minimum(gaps[own[:, j], j], 31), 2.0 ** -guess.gap[j]) for j in slots]
        change = [_bits(np.abs(changes[changed[:, j], j]), 2.0 ** -guess.change[j]) + (np.arange(TOTAL) > 0) for j in slots]
        return cls(_bits(counts, 2.0**-guess.count), np.array(gap), np.array(change))


def _bits(values: Int64, prior: Float64) -> Float64:
    frequencies = np.bincount(values, minlength=len(prior)) + 8 * prior / prior.sum()
    return np.asarray(-np.log2(frequencies / frequencies.sum()))


def _described(weights: Weights, causal: CausalNeighbours) -> tuple[Int64, Int64, Int64]:
    from gvcodecs.mcgv.motion.weight_kernels import describe

    n_points = len(weights.clusters)
    counts = np.zeros(n_points, np.int64)
    gaps, changes = np.full((n_points, INFLUENCES), -1, np.int64), np.zeros((n_points, INFLUENCES), np.int64)
    describe(causal.starts, causal.near, weights.clusters, weights.weights, counts, gaps, changes)
    return counts, gaps, changes


def _count_contexts(causal: CausalNeighbours) -> Int64:
    return np.asarray(np.minimum(np.diff(causal.starts), COUNT_CONTEXTS - 1))
