"""Causal orders of the vertices' feature vectors over the surface, and the weights that prediction starts from.

Interpolated vertices start from their ring's average, a little overshot, as interpolating subdivision does: weight ``1 +
OVERSHOOT`` on the ring and ``-OVERSHOOT`` on what lies beyond. At a boundary the two neighbours along it share the weight:
the ring lies on one side only. In the coarsest mesh a vertex starts from the parallelogram, or from the one or two causal
neighbours that there are.

Source: Vasa and Skala 2010, sections 3.2 and 3.3; overshoot and boundary rule are departures. See
`gvpipe.trajectory.prediction`.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.foundation.arrays import Int32
from gvpipe.foundation.budget import Budget
from gvpipe.runtime.ahead import halves, run_ahead
from gvpipe.trajectory.causal_order import CausalOrder

PEAK_PER_VERTEX, PEAK_PER_TRIANGLE = 520, 40  # bytes, of `parallelogram_order`
SECONDS_PER_VERTEX, SECONDS_PER_TRIANGLE = 2e-6, 1e-6

if TYPE_CHECKING:
    from gvpipe.mesh.hierarchy_kernels import Hierarchy


def hierarchy_order(hierarchy: Hierarchy, overshoots: bool = True) -> CausalOrder:
    """Return the order of all V vertices, coarse to fine; ``overshoots`` is False for predictors that see the ring alone."""
    from gvpipe.trajectory.spatial_kernels import fill_weights, join_order, weigh_hierarchy

    parts = halves(len(hierarchy.rings))
    if len(parts) < 2:
        return weigh_hierarchy(hierarchy, overshoots)
    weights, variances = (np.empty(len(hierarchy.neighbours)) for _ in range(2))

    def fill(ranks: slice) -> None:
        fill_weights(hierarchy, overshoots, ranks.start, ranks.stop, weights, variances)

    deque(run_ahead(fill, parts), maxlen=0)
    return join_order(hierarchy, weights, variances)


def ask_parallelograms(budget: Budget, n_vertices: int, n_triangles: int) -> None:
    """Check that a file may take the memory and work of `parallelogram_order`; raises `OverBudget`."""
    what = f"a traversal of {n_vertices} vertices and {n_triangles} triangles"
    seconds = SECONDS_PER_VERTEX * n_vertices + SECONDS_PER_TRIANGLE * n_triangles
    budget.ask(what, PEAK_PER_VERTEX * n_vertices + PEAK_PER_TRIANGLE * n_triangles, seconds)


def traversal_order(faces: Int32, n_vertices: int) -> CausalOrder:
    """Return the order of V vertices along a traversal of ``faces (T, 3)``, each predicted by a parallelogram (``navg``).

    For static positions: on a frame of four meshes, 10 to 38 % fewer bytes than along a hierarchy; edges are straight there.
    Weights are 1 and -1 (1 alone where there is no parallelogram), so that integers predict integers, exactly.
    """
    from gvpipe.trajectory.spatial_kernels import weigh_traversal

    return weigh_traversal(np.ascontiguousarray(faces, np.int32), n_vertices)


def parallelogram_order(faces: Int32, n_vertices: int) -> CausalOrder:
    """Return the order of V vertices along a traversal of ``faces (T, 3)``, predicted from all parallelograms that they end.

    For the components that are the shape itself, which is rough: all triangles are short here, a hierarchy's are not. Weights
    start from the average of the parallelograms, a part of it the ring's average.

    Source: D. Cohen-Or, R. Cohen and R. Irony, "Multi-way Geometry Encoding", 2002; the ring's part is a departure.
    """
    from gvpipe.trajectory.spatial_kernels import weigh_parallelograms

    return weigh_parallelograms(np.ascontiguousarray(faces, np.int32), n_vertices)
