"""Whether two sequences have the same vertices and triangles, and in which order.

Vertices are paired by index. If the triangles then differ, as of a file coded with `--reorder`, they are paired by their
trajectories and triangles (`gvpipe.metrics.correspondence`).
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Integers
from gvpipe.foundation.errors import InputError
from gvpipe.metrics.correspondence import canonical_triangles, match_vertices
from gvpipe.model.sequence import MeshSequence


class Unpaired(InputError):
    """Two sequences whose vertices do not correspond; of equal numbers of frames, their surfaces can still be compared."""


def aligned(reference: MeshSequence, distorted: MeshSequence) -> MeshSequence:
    """Return ``distorted`` in the reference's vertex order; raises `InputError` as `pair_vertices`."""
    pairing = pair_vertices(reference, distorted)
    return distorted if pairing is None else distorted.reordered(np.argsort(pairing), reference.faces)


def pair_vertices(reference: MeshSequence, distorted: MeshSequence) -> Integers | None:
    """Return ``(V,)`` the reference's vertex of each vertex of ``distorted``; None if they are in the same order.

    Raises:
        InputError: they have other numbers of frames.
        Unpaired: their vertices or triangles are others.
    """
    counts = (
        ("frames", reference.n_frames, distorted.n_frames),
        ("vertices", reference.n_vertices, distorted.n_vertices),
        ("triangles", len(reference.faces), len(distorted.faces)),
    )
    for what, ours, theirs in counts:
        if ours != theirs:
            error = InputError if what == "frames" else Unpaired
            raise error(
                f"{reference.name} has {ours} {what}, {distorted.name} has {theirs}; equal numbers are needed, since "
                "vertices are compared by index"
            )
    if np.array_equal(canonical_triangles(reference.faces), canonical_triangles(distorted.faces)):
        return None
    pairing = match_vertices(reference, distorted)
    if pairing is None:
        raise Unpaired(
            f"{reference.name} and {distorted.name} both have {reference.n_vertices} vertices and "
            f"{len(reference.faces)} triangles, but not the same triangles, in whatever vertex order; compare a sequence with "
            "what was made from it"
        )
    return pairing
