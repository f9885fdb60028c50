"""Discrete Laplace operators of a mesh, with rows that sum to zero.

Row i takes from a value at vertex i the weighted average of its neighbours' values: L_ii = 1 and L_ij = -w_ij / sum_k w_ik.
The weights are

- ``tutte``: 1. Connectivity alone.
- ``mean-value``: (tan(a/2) + tan(b/2)) / |x_j - x_i|, a and b the angles at i on both sides of edge ij. Always positive.
- ``cotangent``: (cot a + cot b) / 2, a and b the angles opposite edge ij. Negative where a + b > pi.

The last two are zero on flat neighbourhoods inside the mesh, so that uneven sampling costs nothing.

Source: Vasa, Marras, Hormann and Brunnett, "Compressing dynamic meshes with geometric Laplacians", 2014, section 6; weights
after Floater, "Mean value coordinates", 2003, and Pinkall and Polthier, "Computing discrete minimal surfaces", 1993.

Departure: no weight is below `LEAST` of its row's mean. Rows of collapsed, needle-like or obtuse triangles then stay positive,
one anchor per component makes the operator regular, and points may be quantised coarsely, and coincide. It also pays: vertices
that hang together by nearly all of their weight, and by little with the rest, amplify the quantisation of deltas.

Encoder and decoder build it from the same decoded points by additions, products, quotients and square roots, which all machines
round alike, and by minima and maxima, which are continuous: a difference in rounding stays one. Points on a lattice are best
given as its integers, which no machine rounds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gvpipe.foundation.arrays import Float64, Int32

if TYPE_CHECKING:
    from gvpipe.mesh.graph_kernels import Graph
    from gvpipe.trajectory.product_kernels import Rows

OPERATORS = ("mean-value", "cotangent", "tutte")


def laplacian(points: Float64, faces: Int32, graph: Graph, operator: str = "mean-value") -> Rows:
    """Return the normalised Laplacian ``(V, V)`` of a mesh.

    Args:
        points: ``(V, 3)``, finite, any unit: size and place do not matter. ``tutte`` looks at their number alone.
        faces: ``(T, 3)``, degenerate, repeated and non-manifold ones included.
        graph: of the faces.
        operator: one of `OPERATORS`.

    Returns:
        Ones on the diagonal, and beside it negative shares that sum to -1. The row of a vertex without neighbours is empty:
        it is a component of its own, and its anchor says all.
    """
    from gvcodecs.laplacian.laplace_kernels import laplace_rows

    return laplace_rows(points, faces, graph, OPERATORS.index(operator))
