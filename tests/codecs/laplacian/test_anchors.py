"""Every component has an anchor."""

from __future__ import annotations

import dataclasses

import numpy as np
from sequences import grid
from tubes import CODING

from gvcodecs.laplacian.anchor_kernels import SMALL
from gvcodecs.laplacian.anchors import choose_anchors
from gvcodecs.laplacian.delta_rows import border_order
from gvcodecs.laplacian.domain import build_domain, build_surface
from gvpipe.mesh.graph_kernels import label_components
from gvpipe.mesh.topology import adjacency, components


def test_every_component_has_an_anchor_and_small_ones_nothing_else() -> None:
    points, faces = grid(12)
    rng = np.random.default_rng(3)
    loose = 144 + np.arange(60).reshape(-1, 3)
    faces = np.concatenate([faces, loose, [[204, 205, 206], [204, 206, 207], [204, 207, 208], [204, 208, 205]]]).astype(
        np.int32
    )
    points = np.concatenate([points, rng.random((66, 3))])  # the last one is in no triangle
    surface = build_surface(faces, len(points))
    component_of = label_components(surface.graph)
    n_components, theirs = components(adjacency(faces, len(points)))
    assert np.array_equal(component_of, theirs)
    sizes = np.bincount(component_of)
    walk = border_order(surface.faces, len(points))
    for choice in ("hierarchy", "walk"):
        for spacing in (1, 7, 1000):
            anchors = choose_anchors(choice, spacing, surface.hierarchy, surface.causal, walk, component_of)
            assert len(set(anchors.points)) == len(anchors.points) == len(anchors.causal.order)
            assert set(component_of[anchors.points]) == set(range(n_components))
            small = np.flatnonzero(sizes[component_of] <= SMALL)
            assert set(small) <= set(anchors.points)
            assert spacing > 1 or len(anchors.points) == len(points)
            rank = np.argsort(anchors.causal.order)  # of each vector
            predicted = np.repeat(np.arange(len(anchors.points)), np.diff(anchors.causal.starts))  # bounds go by rank
            assert (rank[anchors.causal.neighbours] < predicted).all()
        coding = dataclasses.replace(CODING, anchor_choice=choice)
        domain = build_domain(surface, points, coding)
        assert set(domain.delta_points) <= set(np.flatnonzero(sizes[component_of] > SMALL))
