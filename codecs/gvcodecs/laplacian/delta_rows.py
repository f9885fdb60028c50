"""The order in which delta trajectories are coded, and how each is predicted from known ones around it.

``rigid``, section 7: points come in the order of a walk from triangle to triangle that expands the border of the known part.
For each, a breadth-first search over the mesh finds up to k = 15 known ones. Where the surface moves almost rigidly, one linear
map takes the average mesh's differential coordinates around a point to its delta trajectories; eliminating it leaves a weighted
sum of known delta trajectories, with weights that follow from the average mesh alone: ``w = A (A^T A + r I)^-1 delta``.

``kalman``, the default, starts from these weights (from zero, where there is no average mesh) and lets each decoded component
correct them for the next one (`gvpipe.trajectory.prediction`). Learned weights may have any size, and along a walk of thousands
of rows a rounding difference could grow without limit; so points come in the order of the vertex hierarchy, and only those of
earlier blocks are known: no chain of predictions is longer than there are blocks. ``none`` codes deltas as they are.

Source: Vasa, Marras, Hormann and Brunnett 2014, section 7. Departures: a ridge r, since flat regions define no map; `kalman`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gvpipe.arrays import Bool, Float64, Int32
from gvpipe.mesh.hierarchy import Hierarchy
from gvpipe.trajectory.causal_order import CausalOrder

DELTA_PREDICTIONS = ("kalman", "rigid", "none")
N_KNOWN = {"kalman": 20, "rigid": 15, "none": 0}  # known points, at most; 15 is the paper's k
REACH = 160  # points that the search for them visits at most
RIDGE = 0.01  # in traces of A^T A
VARIANCE = 0.2  # prior variance of a weight
BLOCK = 512  # vectors of the traversal that are entropy coded at once
N_RING = 6  # causal neighbours whose magnitudes count for a vector's contexts
TINY = 1e-30


def border_order(faces: Int32, n_points: int) -> Int32:
    """All points in the order of a walk over ``faces (T, 3)`` that goes from triangle to triangle, breadth first."""
    from gvpipe.mesh.traversal import traverse

    order: Int32 = traverse(faces, np.arange(n_points, dtype=np.int32), n_points)[0]
    return order


def delta_order(prediction: str, hierarchy: Hierarchy, walk: Int32, has_deltas: Bool) -> tuple[Int32, Int32, Int32]:
    """Return points in their order ``(n,)``, bounds of blocks, and for each place which places before it are known ``(n,)``."""
    if prediction == "kalman":
        keep = has_deltas[hierarchy.order]
        blocks = np.unique(np.concatenate([[0], np.cumsum(keep)])[hierarchy.blocks])
        return hierarchy.order[keep], blocks.astype(np.int32), np.repeat(blocks[:-1], np.diff(blocks)).astype(np.int32)
    order = walk[has_deltas[walk]]
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
    from gvcodecs.laplacian.neighbour_search import known_around

    graph = neighbours.sorted_indices()
    starts_of, ends = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    starts, near = known_around(order, limits, starts_of, ends, N_KNOWN[prediction], REACH)
    known = np.diff(starts)
    row = np.repeat(np.arange(len(order)), known)
    place = np.zeros(len(differential), np.int32)
    place[order] = np.arange(len(order))
    return CausalOrder(
        order=np.arange(len(order), dtype=np.int32),
        starts=starts,
        neighbours=place[near],
        weights=_rigid_weights(differential[order], differential[near], row),
        variances=np.full(len(near), VARIANCE),
        ring_sizes=known.astype(np.int32) if prediction == "rigid" else np.minimum(known, N_RING).astype(np.int32),
        blocks=blocks,
        affine=False,
    )


def _rigid_weights(own: Float64, known: Float64, row: NDArray[np.intp]) -> Float64:
    """Weights of causal neighbours: differential coordinates ``own (n, 3)``, ``known (m, 3)`` of neighbours of ``row (m,)``."""
    normal = np.zeros((len(own), 3, 3))
    for a in range(3):
        for b in range(3):
            normal[:, a, b] = np.bincount(row, known[:, a] * known[:, b], len(own))
    ridge = RIDGE * np.trace(normal, axis1=1, axis2=2) + TINY
    solved = np.linalg.solve(normal + ridge[:, None, None] * np.eye(3), own[:, :, None])[:, :, 0]
    return np.asarray(np.einsum("mi,mi->m", known, solved[row]))
