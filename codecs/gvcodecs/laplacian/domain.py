"""What encoder and decoder both derive from triangles and the decoded average mesh, before any trajectory is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvcodecs.laplacian.anchors import Anchors, choose_anchors
from gvcodecs.laplacian.delta_rows import border_order, delta_causal_order, delta_order
from gvcodecs.laplacian.extended_laplacian import ExtendedLaplacian
from gvcodecs.laplacian.header import CoefficientCoding
from gvcodecs.laplacian.laplace_operators import laplacian
from gvcodecs.laplacian.normal_equations import STEPS, count_fill, most_products
from gvpipe.foundation.arrays import Bool, Float64, Int32
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.mesh.topology import unique_edges
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.spatial_neighbours import hierarchy_order

if TYPE_CHECKING:
    from gvpipe.mesh.graph_kernels import Graph
    from gvpipe.mesh.hierarchy_kernels import Hierarchy


@dataclass(frozen=True)
class Surface:
    """What follows from the triangles alone.

    Args:
        faces: ``(T, 3)`` triangles of three different points, over P points.
        graph: of the triangles.
        hierarchy: of the points.
        causal: order of all points along the hierarchy.
    """

    faces: Int32
    graph: Graph
    hierarchy: Hierarchy
    causal: CausalOrder

    @property
    def edges(self) -> Int32:
        """``(E, 2)`` edges, each once."""
        return unique_edges(self.faces)


@dataclass(frozen=True)
class Domain:
    """Args:
    anchors: points coded themselves.
    delta_points: ``(D,)`` points that have deltas, in the order of their vectors.
    deltas: their order.
    system: the extended Laplacian.
    """

    anchors: Anchors
    delta_points: Int32
    deltas: CausalOrder
    system: ExtendedLaplacian


def build_surface(point_faces: Int32, n_points: int) -> Surface:
    """Take in the mesh ``point_faces (T, 3)``."""
    faces, graph = _link(point_faces, n_points)
    hierarchy = build_hierarchy(faces, n_points)
    return Surface(faces, graph, hierarchy, hierarchy_order(hierarchy))


def is_factorable(point_faces: Int32, n_points: int) -> bool:
    """Whether the least squares over a mesh stay within `most_products` and `STEPS`, whatever the operator."""
    from gvcodecs.laplacian.laplace_kernels import thin_rows

    limit = most_products(n_points)
    operator = laplacian(np.zeros((n_points, 3)), *_link(point_faces, n_points), "tutte")
    fill = count_fill(thin_rows(operator), limit)
    return fill.products <= limit and fill.steps <= STEPS


def _link(point_faces: Int32, n_points: int) -> tuple[Int32, Graph]:
    """Triangles of three different points, and their graph."""
    from gvpipe.mesh.graph_kernels import link_vertices
    from gvpipe.mesh.hierarchy_kernels import proper_triangles

    faces = proper_triangles(np.ascontiguousarray(point_faces, np.int32))
    return faces, link_vertices(faces, n_points)


def build_domain(
    surface: Surface,
    average: Float64 | None,
    coding: CoefficientCoding,
    is_still: Bool | None = None,
    budget: Budget = UNLIMITED,
) -> Domain:
    """Set up the coding of coefficients.

    Args:
        surface: the mesh.
        average: ``(P, 3)`` decoded, in mean edge lengths, if there is one.
        coding: of coefficients.
        is_still: ``(P,)`` the points whose coefficients are given; none if None.
        budget: of the file.

    Raises:
        TooMuchFill, OverBudget, Singular: of `gvcodecs.laplacian.normal_equations.NormalEquations`.
    """
    from gvcodecs.laplacian.laplace_kernels import fineness, scale_rows, thin_rows
    from gvpipe.mesh.graph_kernels import label_components

    n_points, graph = len(surface.hierarchy.order), surface.graph
    points = np.zeros((n_points, 3)) if average is None else average
    traversal = border_order(surface.faces, n_points)
    component_of = label_components(graph)
    anchors = choose_anchors(
        coding.anchor_choice, coding.anchors, surface.hierarchy, surface.causal, traversal, component_of, is_still
    )
    scale = fineness(points, graph, 0.0 if average is None else coding.edge_power)
    operator = thin_rows(laplacian(points, surface.faces, graph, coding.operator))
    operator = scale_rows(operator, scale, anchors.has_deltas)
    system = ExtendedLaplacian(operator, anchors.points, 1 / coding.anchor_ratio, anchors.is_free, budget)
    order = delta_order(coding.delta_prediction, surface.hierarchy, traversal, anchors.has_deltas)
    causal = delta_causal_order(coding.delta_prediction, order, graph, system.deltas(points))
    return Domain(anchors, order.points, causal, system)
