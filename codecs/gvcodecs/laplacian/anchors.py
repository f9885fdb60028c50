"""Anchors: the points whose trajectories are coded themselves, beside the deltas of all.

What: the first points of the vertex hierarchy, which lie evenly over the surface, at least one on every component. They
come in the hierarchy's order, so that each is interpolated from those before it as `pca` does it. A component of up to `SMALL`
points is all anchors, and needs no deltas. Points that stand still are anchors too, whose coefficients are given.
Why: deltas hardly fix the position of a point far from any anchor. With few anchors the surface drifts, with many their
own bits grow; anchors are quantised as finely as drift is to be small.

``walk`` takes evenly spaced points of the border-expansion traversal instead, each predicted from the one before.

Source: Sorkine, Cohen-Or and Toledo, "High-pass quantization for mesh encoding", 2003, for anchors.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.arrays import Bool, Int32, Integers
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.causal_selection import leave_out, select_vectors

if TYPE_CHECKING:
    from gvpipe.mesh.hierarchy_kernels import Hierarchy

ANCHOR_CHOICES = ("hierarchy", "walk")
SMALL = 4  # points of components that are all anchors
MIN_BLOCK = 48  # vectors coded at once, at least


@dataclass(frozen=True)
class Anchors:
    """Args:
    points: ``(A,)`` anchors, in the order of their vectors.
    causal: order of the anchors, numbered 0..A-1; those that stand still are left out.
    is_free: ``(A,)`` the anchors that do not stand still.
    """

    points: Int32
    causal: CausalOrder
    is_free: Bool


def choose_anchors(
    choice: str,
    spacing: int,
    hierarchy: Hierarchy,
    causal: CausalOrder,
    traversal: Int32,
    component_of: Integers,
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
    is_still = np.zeros(len(component_of), bool) if is_still is None else is_still
    is_held = (np.bincount(component_of, minlength=1) <= SMALL)[component_of] | is_still
    n_points = len(component_of)
    if choice == "hierarchy":
        n_coarse = int((hierarchy.rings == 0).sum())
        keep = np.arange(n_points) < max(n_coarse, -(-n_points // spacing))
        keep |= is_held[hierarchy.order]
        points, chosen = hierarchy.order[keep], select_vectors(causal, keep)
        return Anchors(points, leave_out(chosen, is_still[points]), ~is_still[points])
    keep = (np.arange(n_points) % spacing == 0) | is_held[traversal]
    keep[np.unique(component_of[traversal], return_index=True)[1]] = True
    points = traversal[keep]
    return Anchors(points, leave_out(_chain(len(points)), is_still[points]), ~is_still[points])


def _chain(n: int) -> CausalOrder:
    """An order in which each vector is predicted from the one before."""
    return CausalOrder(
        order=np.arange(n, dtype=np.int32),
        starts=np.maximum(np.arange(n + 1) - 1, 0).astype(np.int32),
        neighbours=np.arange(n - 1, dtype=np.int32),
        weights=np.ones(n - 1),
        variances=np.full(n - 1, 0.1),
        ring_sizes=(np.arange(n) > 0).astype(np.int32),
        blocks=np.unique(np.append(np.arange(0, n, MIN_BLOCK), n)).astype(np.int32),
        affine=True,
    )
