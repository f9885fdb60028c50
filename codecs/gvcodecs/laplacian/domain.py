"""What encoder and decoder both derive from triangles and the decoded average mesh, before any trajectory is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from gvcodecs.laplacian.anchors import Anchors, choose_anchors
from gvcodecs.laplacian.delta_rows import border_order, delta_causal_order, delta_order
from gvcodecs.laplacian.extended_laplacian import ExtendedLaplacian, scale_rows, thin_hubs
from gvcodecs.laplacian.header import CoefficientCoding
from gvcodecs.laplacian.laplace_operators import laplacian
from gvcodecs.laplacian.mesh_scale import fineness
from gvcodecs.laplacian.normal_equations import STEPS, count_fill, most_products
from gvpipe.arrays import Bool, Float64, Int32
from gvpipe.budget import UNLIMITED, Budget
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.mesh.topology import adjacency, components, unique_edges
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.spatial_neighbours import hierarchy_order

if TYPE_CHECKING:
    from gvpipe.mesh.hierarchy_kernels import Hierarchy


@dataclass(frozen=True)
class Surface:
    """What follows from the triangles alone.

    Args:
        faces: ``(T, 3)`` triangles of three different points, over P points.
        edges: ``(E, 2)``.
        neighbours: ``(P, P)`` adjacency.
        hierarchy: of the points.
        causal: order of all points along the hierarchy.
    """

    faces: Int32
    edges: Int32
    neighbours: sparse.csr_array
    hierarchy: Hierarchy
    causal: CausalOrder


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
    faces = _proper(point_faces)
    hierarchy = build_hierarchy(faces, n_points)
    return Surface(faces, unique_edges(faces), adjacency(faces, n_points), hierarchy, hierarchy_order(hierarchy))


def is_factorable(point_faces: Int32, n_points: int) -> bool:
    """Whether the least squares over a mesh stay within `most_products` and `STEPS`, whatever the operator."""
    faces, limit = _proper(point_faces), most_products(n_points)
    operator = thin_hubs(laplacian(np.zeros((n_points, 3)), faces, "tutte"))
    fill = count_fill(operator, limit)
    return fill.products <= limit and fill.steps <= STEPS


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
    n_points = len(surface.hierarchy.order)
    points = np.zeros((n_points, 3)) if average is None else average
    traversal = border_order(surface.faces, n_points)
    _, component_of = components(surface.neighbours)
    is_still = np.zeros(n_points, bool) if is_still is None else is_still
    anchors = choose_anchors(
        coding.anchor_choice, coding.anchors, surface.hierarchy, surface.causal, traversal, component_of, is_still
    )
    is_anchor = np.zeros(n_points, bool)
    is_anchor[anchors.points] = True
    has_deltas = (np.bincount(component_of[~is_anchor], minlength=int(component_of.max()) + 1) > 0)[component_of]
    has_deltas &= ~is_still
    scale = np.ones(n_points) if average is None else fineness(average, surface.edges, coding.edge_power)
    operator = scale_rows(thin_hubs(laplacian(points, surface.faces, coding.operator)), scale * has_deltas)
    system = ExtendedLaplacian(operator, anchors.points, 1 / coding.anchor_ratio, anchors.is_free, budget)
    order, blocks, limits = delta_order(coding.delta_prediction, surface.hierarchy, traversal, has_deltas)
    causal = delta_causal_order(coding.delta_prediction, order, blocks, limits, surface.neighbours, system.deltas(points))
    return Domain(anchors, order, causal, system)


def _proper(faces: Int32) -> Int32:
    """The triangles of three different points."""
    proper: Int32 = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return proper
