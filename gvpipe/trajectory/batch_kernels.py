"""Batches of feature vectors that do not predict one another: kernels work on them side by side (`gvpipe.runtime.lanes`).

A window of the causal order is sorted by how long the chain of predictions before each vector is. What comes out at one depth
is put together, up to `LANES` at a time, with all that its predictions start from.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.runtime.compiled import compiled, inlined
from gvpipe.runtime.lanes import LANES, prefetch
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.prediction_kernels import VectorCoding

LINE = 8  # numbers that come from memory at once, on most processors
WINDOW = 512  # vectors of which some are put together: in more, the next ones would lie too far apart in memory


class Batch(NamedTuple):
    """Up to `LANES` vectors of R components with up to n neighbours, n a multiple of four.

    Arrays of float64 are flat, in rows of one number for each vector. Of neighbours that a vector lacks, weights are 0.

    Args:
        ranks, vectors: ``(LANES,)`` where the vectors are in the order, and which they are.
        neighbours: n rows: which they are; the first one, or the vector itself, in place of those that it lacks.
        weights, variances, roots: n rows of the neighbours: prior weights, their variances and these' square roots.
        totals: one row: the sums of the variances; infinite where there is none.
        values: n R rows: the neighbours' components.
    """

    ranks: Int32
    vectors: Int32
    neighbours: Int32
    weights: Float64
    variances: Float64
    roots: Float64
    totals: Float64
    values: Float64


@compiled
def empty_batch(n_components: int, most: int) -> Batch:
    """Memory for vectors of ``n_components`` with up to ``most`` neighbours."""
    n = LANES * in_fours(most)
    ranks, vectors = np.zeros(LANES, np.int32), np.zeros(LANES, np.int32)
    return Batch(
        ranks, vectors, np.zeros(n, np.int32), np.zeros(n), np.zeros(n), np.zeros(n), np.ones(LANES), np.zeros(n * n_components)
    )


@compiled
def in_fours(n: int) -> int:
    """The multiple of four that is n or the next above it."""
    return (n + 3) // 4 * 4


@compiled
def gather(coding: VectorCoding, ranks: Int32, batch: Batch) -> int:
    """Fill a batch with vectors; return how many rows of neighbours it has."""
    causal, decoded, n_components = coding.causal, coding.decoded, coding.decoded.shape[1]
    most = 0
    for lane in range(len(ranks)):
        most = max(most, causal.starts[ranks[lane] + 1] - causal.starts[ranks[lane]])
    n_rows = in_fours(most)
    for lane in range(len(ranks)):
        rank = ranks[lane]
        batch.ranks[lane], batch.vectors[lane] = rank, causal.order[rank]
        first, n = causal.starts[rank], causal.starts[rank + 1] - causal.starts[rank]
        total = 0.0
        for j in range(n):
            row, variance = LANES * j + lane, causal.variances[first + j]
            batch.neighbours[row], batch.weights[row] = causal.neighbours[first + j], causal.weights[first + j]
            batch.variances[row], batch.roots[row] = variance, np.sqrt(variance)
            total += variance
        for j in range(n, n_rows):
            row = LANES * j + lane
            batch.neighbours[row] = batch.neighbours[lane] if n else causal.order[rank]
            batch.weights[row] = batch.variances[row] = batch.roots[row] = 0.0
        batch.totals[lane] = total if total > 0 else np.inf
    for j in range(n_rows):
        a, b, c, d, e, f, g, h = batch.neighbours[LANES * j : LANES * j + LANES]
        for i in range(n_components):  # row by row, as they lie in memory: all lanes at once
            row = LANES * (j * n_components + i)
            values = batch.values[row : row + LANES]
            values[0], values[1], values[2], values[3] = decoded[a, i], decoded[b, i], decoded[c, i], decoded[d, i]
            values[4], values[5], values[6], values[7] = decoded[e, i], decoded[f, i], decoded[g, i], decoded[h, i]
    return int(n_rows)


@inlined
def fetch(coding: VectorCoding, ranks: Int32) -> None:
    """Ask the memory for what `gather` takes: the neighbours of large meshes lie far apart, and it would wait for each."""
    causal, n_components = coding.causal, coding.decoded.shape[1]
    for rank in ranks:
        for k in range(causal.starts[rank], causal.starts[rank + 1]):
            for column in range(0, n_components, LINE):
                prefetch(coding.decoded, causal.neighbours[k], column)


@compiled
def sort_window(causal: CausalOrder, first: int, end: int, before: int, depths: Int32, ranks: Int32, bounds: Int32) -> int:
    """Sort ranks ``first`` to ``end`` by depth: a vector is predicted by those of lesser depths, or before the window, alone.

    Args:
        causal: the order.
        before: the greatest depth before the window.
        depths: ``(n,)`` of vectors, is filled: one more than those of their neighbours, ``before + 1`` at least.
        ranks: is filled with the ranks.
        bounds: is filled with where depth ``before + d`` begins in ``ranks`` and, at d + 1, ends; d from 1.

    Returns:
        The greatest depth of the window.
    """
    deepest = before
    for i in range(first, end):
        depth = before
        for k in range(causal.starts[i], causal.starts[i + 1]):
            depth = max(depth, depths[causal.neighbours[k]])
        depths[causal.order[i]] = depth + 1
        deepest = max(deepest, depth + 1)
    for d in range(deepest - before + 1):
        bounds[d] = 0
    for i in range(first, end):
        bounds[depths[causal.order[i]] - before] += 1
    for d in range(deepest - before):
        bounds[d + 1] += bounds[d]
    bounds[deepest - before + 1] = end - first
    for i in range(end - 1, first - 1, -1):
        d = depths[causal.order[i]] - before
        bounds[d] -= 1
        ranks[bounds[d]] = i
    return deepest
