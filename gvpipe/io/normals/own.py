"""Which corners share a normal, and whether normals follow from a frame's positions (`gvpipe.attributes.surface_normals`)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.attributes.surface_normals import find_rule, start_free_normals
from gvpipe.foundation.arrays import Array, Frames, Int32, Int64
from gvpipe.io.sharing import shared_by_vertex
from gvpipe.mesh.unique_rows import row_ids

FIRST_NORMALS = "normals change from frame to frame, and not as those of the surface; the first frame's were kept"
TOLERANCE = 1.0  # degrees: normals this near to a rule's are the surface's own


def own_rule(normals: Array, positions: Array, faces: Int32, entries: Int64) -> str | None:
    """The rule that gives all normals ``(N, 3)`` within `TOLERANCE`, or None.

    Args:
        normals: of any length.
        positions: ``(V, 3)``.
        faces: ``(T, 3)``.
        entries: ``(3 T,)`` the normal of each corner, 0..N-1.
    """
    return find_rule(normals, entries, positions.astype(np.float32), faces, TOLERANCE)


def entries_of(normals: Attribute, faces: Int32) -> tuple[Int64, Int64]:
    """The normal of each corner ``(3 T,)``, one for each vertex and index, and a corner that has each ``(N,)``."""
    corners = faces.reshape(-1).astype(np.int64)
    if normals.domain == "corner":
        own = shared_by_vertex(normals.values, faces)[1] if normals.indices is None else normals.indices
        corners, _ = row_ids(np.stack([corners, own.astype(np.int64)], axis=1))
    _, first, entries = np.unique(corners, return_index=True, return_inverse=True)
    return entries.reshape(-1), first


def are_smooth(normals: Attribute, positions: Array, faces: Int32) -> bool:
    """Whether each vertex has one normal, which follows from positions ``(V, 3)`` and triangles ``(T, 3)``."""
    if normals.domain not in ("vertex", "corner"):
        return False
    entries, corners = entries_of(normals, faces)
    rows = corners if normals.domain == "corner" else faces.reshape(-1)[corners]
    is_one_each = len(corners) == len(np.unique(faces))
    return is_one_each and own_rule(np.asarray(normals)[rows], positions, faces, entries) is not None


def first_normals_note(attributes: Mapping[str, Attribute], faces: Int32, frames: Frames) -> tuple[str, ...]:
    """What to say of normals that change in a file: nothing if they follow from the surface in the first frame.

    Args:
        attributes: with the first frame's normals as ``normal``, or without.
        faces: ``(T, 3)``.
        frames: ``(F, V, 3)``, of which the first is read if it is needed.
    """
    normals = attributes.get("normal")
    if frames.shape[0] == 1 or normals is None or normals.domain not in ("vertex", "corner"):
        return ()
    entries, corners = entries_of(normals, faces)
    rows = corners if normals.domain == "corner" else faces.reshape(-1)[corners]
    # one frame: NumPy is done before numba has started
    rule = find_rule(np.asarray(normals)[rows], entries, frames[0:1][0], faces, TOLERANCE, start_free_normals)
    return (FIRST_NORMALS,) if rule is None else ()
