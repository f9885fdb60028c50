"""The order in which delta trajectories are coded, and how each is predicted from its causal neighbours.

``rigid``, section 7: points come in the order of a traversal, from triangle to triangle, that expands the border of the decoded
part. For each, a breadth-first search over the mesh finds up to k = 15 decoded ones. Where the surface moves almost rigidly,
one linear map takes the average mesh's differential coordinates around a point to its delta trajectories. Eliminating it leaves
a weighted sum of decoded delta trajectories. The weights follow from the average mesh alone:
``w = A (A^T A + r I)^-1 delta``.

``kalman``, the default, starts from these weights (from zero, if there is no average mesh). Each decoded component corrects
them for the next one (`gvpipe.trajectory.prediction`). Learned weights may have any size, and along a traversal of thousands of
points a rounding difference could grow without limit. So points come in the order of the vertex hierarchy, and only those of
earlier blocks count: no chain of predictions is longer than there are blocks. ``none`` codes deltas as they are.

Source: Vasa, Marras, Hormann and Brunnett 2014, section 7. Departures: a ridge r, since flat regions define no map; `kalman`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from gvpipe.arrays import Bool, Float64, Int32
from gvpipe.trajectory.causal_order import CausalOrder

if TYPE_CHECKING:
    from gvpipe.mesh.hierarchy_kernels import Hierarchy

DELTA_PREDICTIONS = ("kalman", "rigid", "none")
N_CAUSAL = {"kalman": 20, "rigid": 15, "none": 0}  # causal neighbours, at most; 15 is the paper's k
REACH = 160  # points that the search for them visits at most
RIDGE = 0.01  # in traces of A^T A
VARIANCE = 0.2  # prior variance of a weight
BLOCK = 512  # vectors of the traversal that are entropy coded at once
N_RING = 6  # causal neighbours whose magnitudes count for a vector's contexts
TINY = 1e-30


def border_order(faces: Int32, n_points: int) -> Int32:
    """All points in the order of a traversal over ``faces (T, 3)`` that goes from triangle to triangle, breadth first."""
    from gvpipe.mesh.traversal import traverse

    order: Int32 = traverse(faces, np.arange(n_points, dtype=np.int32), n_points)[0]
    return order


def delta_order(prediction: str, hierarchy: Hierarchy, traversal: Int32, has_deltas: Bool) -> tuple[Int32, Int32, Int32]:
    """Return points in their order ``(n,)``, bounds of blocks, and ``(n,)`` the rank below which causal neighbours are."""
    if prediction == "kalman":
        keep = has_deltas[hierarchy.order]
        blocks = np.unique(np.concatenate([[0], np.cumsum(keep)])[hierarchy.blocks])
        return hierarchy.order[keep], blocks.astype(np.int32), np.repeat(blocks[:-1], np.diff(blocks)).astype(np.int32)
    order = traversal[has_deltas[traversal]]
    blocks = np.unique(np.append(np.arange(0, len(order), BLOCK), len(order)))
    return order, blocks.astype(np.int32), np.arange(len(order), dtype=np.int32)


def delta_causal_order(
    prediction: str,
    order: Int32,
    blocks: Int32,
    limits: Int32,
    neighbours: sparse.csr_array,
    differential: Float64,
) -> CausalOrder:
    """Return the causal order of points in ``order (n,)``, numbered by their ranks in it.

    Args:
        prediction: one of `DELTA_PREDICTIONS`.
        order, blocks, limits: as `delta_order` gives them.
        neighbours: ``(P, P)`` adjacency.
        differential: ``(P, 3)`` differential coordinates of the average mesh; zero without one.
    """
    from gvcodecs.laplacian.neighbour_search import causal_around
    from gvcodecs.laplacian.rigid_kernels import rigid_weights

    graph = neighbours.sorted_indices()
    starts_of, ends = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    starts, near = causal_around(order, limits, starts_of, ends, N_CAUSAL[prediction], REACH)
    counts = np.diff(starts)
    rank = np.zeros(len(differential), np.int32)
    rank[order] = np.arange(len(order))
    return CausalOrder(
        order=np.arange(len(order), dtype=np.int32),
        starts=starts,
        neighbours=rank[near],
        weights=rigid_weights(differential[order], differential[near], starts, RIDGE, TINY),
        variances=np.full(len(near), VARIANCE),
        ring_sizes=counts.astype(np.int32) if prediction == "rigid" else np.minimum(counts, N_RING).astype(np.int32),
        blocks=blocks,
        affine=False,
    )
