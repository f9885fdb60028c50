"""Rows of vertices' feature vectors in the order of a hierarchy, and the weights that prediction starts from.

Interpolated vertices start from their ring's average, a little overshot, as interpolating subdivision does: weight ``1 +
OVERSHOOT`` on the ring and ``-OVERSHOOT`` on what lies beyond. At a boundary the two neighbours along it share the weight:
the ring lies on one side only. In the coarse mesh a vertex starts from the parallelogram, or from the one or two vertices
known.

Source: Vasa and Skala 2010, sections 3.2 and 3.3; overshoot and boundary rule are departures. See `row_prediction`.
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Int32
from gvpipe.mesh.hierarchy import Hierarchy
from gvpipe.trajectory.prediction import Rows

OVERSHOOT = 0.2
RING_VARIANCE, FAR_VARIANCE = 0.3, 0.1  # of the weights
WALK_BLOCK = 512  # vertices of a walk that are entropy coded at once
SURE, LEAST = 512, 0.05  # the first rows are far apart: fitted weights tell little, and errors would grow from row to row


def mesh_rows(hierarchy: Hierarchy, overshoot: float = OVERSHOOT) -> Rows:
    """Return the rows of all vertices; ``overshoot`` must be 0 for predictors that see the ring alone."""
    known = np.diff(hierarchy.starts)
    row = np.repeat(np.arange(len(known)), known)
    place = np.arange(len(row)) - hierarchy.starts[row]
    ring = np.abs(hierarchy.rings)[row]
    beyond = known[row] - ring
    in_ring = place < ring
    extra = overshoot * (beyond > 0)
    weights = np.where(in_ring, (1 + extra) / np.maximum(ring, 1), -extra / np.maximum(beyond, 1))
    at_boundary = hierarchy.rings[row] < 0
    ends = (place == 0) | (place == ring - 1)
    weights = np.where(at_boundary, np.where(ends & (ring > 1), 0.5, 1.0 * (ring == 1)), weights)
    coarse = ring == 0
    parallelogram = np.where(place == 2, -1.0, 1.0)
    weights = np.where(coarse, np.where(beyond == 3, parallelogram, 1 / np.maximum(beyond, 1)), weights)
    return Rows(
        order=hierarchy.order,
        starts=hierarchy.starts,
        near=hierarchy.neighbours,
        weights=weights,
        variances=np.where(in_ring | coarse, RING_VARIANCE, FAR_VARIANCE) * np.clip(row / SURE, LEAST, 1.0),
        rings=np.abs(hierarchy.rings),
        blocks=hierarchy.blocks,
        affine=True,
    )


def walk_rows(faces: Int32, n_vertices: int) -> Rows:
    """Return the rows of V vertices along a walk from triangle to triangle, each predicted by a parallelogram (``navg``).

    For static positions: on a frame of four meshes, 10 to 38 % fewer bytes than along a hierarchy; edges are straight there.
    Weights are 1 and -1 (1 alone where no parallelogram is known), so that integers predict integers, exactly.
    """
    from gvpipe.mesh.traversal import traverse

    proper = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)].astype(np.int32)
    order, starts, near = traverse(proper, np.arange(n_vertices, dtype=np.int32), n_vertices)
    known = np.diff(starts)
    row = np.repeat(np.arange(n_vertices), known)
    place = np.arange(len(row)) - starts[row]
    return Rows(
        order=order,
        starts=starts.astype(np.int32),
        near=near,
        weights=np.where(known[row] == 3, np.where(place == 2, -1.0, 1.0), 1.0 * (place == 0)),
        variances=np.full(len(row), RING_VARIANCE),
        rings=known.astype(np.int32),
        blocks=np.unique(np.append(np.arange(0, n_vertices, WALK_BLOCK), n_vertices)).astype(np.int32),
        affine=True,
    )
