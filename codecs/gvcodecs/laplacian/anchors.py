"""Anchors: the points whose trajectories are coded themselves, beside the deltas of all.

What: the first points of the vertex hierarchy, which lie evenly over the surface, at least one on every component. They
come in the hierarchy's order, so that each is interpolated from those before it as `pca` does it. A component of up to
`SMALL` points is all anchors, and needs no deltas. Points that stand still are anchors too, whose coefficients are given.
Why: deltas hardly fix the position of a point far from any anchor. With few anchors the surface drifts, with many their
own bits grow; anchors are quantised as finely as drift is to be small.

``walk`` takes evenly spaced points of the border-expansion traversal instead, each predicted from the one before.

Source: Sorkine, Cohen-Or and Toledo, "High-pass quantization for mesh encoding", 2003, for anchors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Int32
from gvpipe.trajectory.causal_order import CausalOrder

if TYPE_CHECKING:
    from gvpipe.mesh.hierarchy_kernels import Hierarchy

ANCHOR_CHOICES = ("hierarchy", "walk")


@dataclass(frozen=True)
class Anchors:
    """Args:
    points: ``(A,)`` anchors, in the order of their vectors.
    causal: order of the anchors, numbered 0..A-1; those that stand still are left out.
    is_free: ``(A,)`` the anchors that do not stand still.
    has_deltas: ``(P,)`` the points that have deltas.
    """

    points: Int32
    causal: CausalOrder
    is_free: Bool
    has_deltas: Bool

    def select(self, vectors: Float64) -> Float64:
        """The anchors' of all points' vectors ``(P, R)``; the same array where all points are anchors in their order."""
        if len(self.points) == len(vectors) and (np.diff(self.points) == 1).all():
            return vectors
        return vectors[self.points]


def choose_anchors(
    choice: str,
    spacing: int,
    hierarchy: Hierarchy,
    causal: CausalOrder,
    traversal: Int32,
    component_of: Int32,
    is_still: Bool | None = None,
) -> Anchors:
    """Choose about one anchor per ``spacing`` points.

    Args:
        choice: one of `ANCHOR_CHOICES`.
        causal: order of all points along the hierarchy.
        traversal: all points in border-expansion order.
        component_of: ``(P,)`` the component of each point.
        is_still: ``(P,)`` the points whose coefficients are given; none if None.
    """
    from gvcodecs.laplacian.anchor_kernels import select_anchors

    n_points, walks = len(component_of), choice == "walk"
    is_still = np.zeros(n_points, bool) if is_still is None else is_still
    if spacing == 1 and not walks and not is_still.any():  # all are anchors, and keep their numbers: their order needs no copy
        return Anchors(np.arange(n_points, dtype=np.int32), causal, np.ones(n_points, bool), np.zeros(n_points, bool))
    points, chosen, has_deltas = select_anchors(spacing, walks, hierarchy, causal, traversal, component_of, is_still)
    return Anchors(points, chosen, ~is_still[points], has_deltas)
