"""Which corners share a normal: the hard edges and smooth groups of a mesh, whose normals follow the moving surface."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.foundation.arrays import Float32, Int32
from gvpipe.mesh.topology import weld

STEPS = 512  # of a normal's coordinate: normals that differ by less, a tenth of a degree, are one


def shared_normals(faces: Int32, base: Float32, given: Attribute | None) -> tuple[Int32, int]:
    """Return the normal of each corner, ``(T, 3)``, and the number of normals.

    Vertices at one point share a normal, so that seams do not show. With normals that are given, the corners at a point share
    one if theirs are equal.

    Args:
        base: ``(V, 3)``, one frame.
        given: of vertices or corners; others do not count.
    """
    first, points = weld(base)
    if given is None or given.domain not in ("vertex", "corner"):
        return points.astype(np.int32)[faces], len(first)
    corners = faces if given.domain == "vertex" else np.arange(faces.size).reshape(-1, 3)
    snapped = np.rint(np.clip(given.values, -2, 2) * STEPS).astype(np.int32)
    values = weld(snapped + 2 * STEPS)[1]  # of equal normals
    value_of = values if given.indices is None else values[given.indices]
    pairs = np.stack([points[faces].ravel(), value_of[corners].ravel()], axis=1)
    first, shared = weld(pairs.astype(np.int64))
    return shared.astype(np.int32).reshape(-1, 3), len(first)
