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

from gvpipe.foundation.arrays import Bool, Float64, Int32
from gvpipe.trajectory.causal_order import CausalOrder

if TYPE_CHECKING:
    from gvcodecs.laplacian.delta_kernels import DeltaOrder
    from gvpipe.mesh.graph_kernels import Graph
    from gvpipe.mesh.hierarchy_kernels import Hierarchy

DELTA_PREDICTIONS = ("kalman", "rigid", "none")
N_CAUSAL = {"kalman": 20, "rigid": 15, "none": 0}  # causal neighbours, at most; 15 is the paper's k
N_RING = {"kalman": 6, "rigid": 15, "none": 0}  # those of them whose magnitudes count for a vector's contexts


def border_order(faces: Int32, n_points: int) -> Int32:
    """All points in the order of a traversal over ``faces (T, 3)`` that goes from triangle to triangle, breadth first."""
    from gvpipe.mesh.traversal import traverse

    order: Int32 = traverse(faces, np.arange(n_points, dtype=np.int32), n_points).order
    return order


def delta_order(prediction: str, hierarchy: Hierarchy, traversal: Int32, has_deltas: Bool) -> DeltaOrder:
    """Return the order of the points that have deltas, for one of `DELTA_PREDICTIONS`."""
    from gvcodecs.laplacian.delta_kernels import order_deltas

    return order_deltas(prediction == "kalman", hierarchy, traversal, has_deltas)


def delta_causal_order(prediction: str, deltas: DeltaOrder, graph: Graph, differential: Float64) -> CausalOrder:
    """Return the causal order of points, numbered by their ranks in ``deltas``.

    Args:
        prediction: one of `DELTA_PREDICTIONS`.
        deltas: as `delta_order` gives them.
        graph: of the mesh over P points.
        differential: ``(P, 3)`` differential coordinates of the average mesh; zero without one.
    """
    from gvcodecs.laplacian.delta_kernels import weigh_deltas

    return weigh_deltas(deltas, graph, differential, N_CAUSAL[prediction], N_RING[prediction])
