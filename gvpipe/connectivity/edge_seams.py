"""Which of its point's vertices each corner uses, along edges: nearly nothing where two triangles meet without a seam.

Triangles that share an edge mostly use the same vertices at both of its ends. So the vertices that a corner may use are listed
by number, likely ones first, and the rank in the list is coded. Corners come by point and corner, and see earlier ones of
their point. The context of a rank depends on triangles and counts alone, which decoders have before the ranks.

Bytes against those of differences between a point's corners (`seams`): 92 and 1616 (13 boxes, 13,182 vertices), 896 and 2336
(kaykit_spin), 73 and 239 (morph_wave).
"""

from __future__ import annotations

import numpy as np

from gvpipe.connectivity.seam_corners import are_first, find_seam_corners
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import corrupt_section


def encode_across_edges(numbers: Array, point_faces: Array, counts: Array) -> bytes:
    """Return the stream of the ``numbers (3T,)`` of the vertices that corners use, numbered at each point by first use.

    Args:
        numbers: by corner.
        point_faces: ``(T, 3)`` triangles over points.
        counts: ``(P,)`` vertices of each point.
    """
    from gvpipe.connectivity.edge_seam_kernels import ENCODE, visit_corners

    seams = find_seam_corners(point_faces, counts)
    ranks, contexts = np.zeros(len(seams.corners), np.int64), np.zeros(len(seams.corners), np.int64)
    visit_corners(seams, numbers, ranks, contexts, ENCODE)
    coded = ~are_first(seams)
    return encode_integers(ranks[coded], contexts[coded])


def decode_across_edges(data: bytes, point_faces: Array, counts: Array) -> Array:
    """Mirror of `encode_across_edges`: ``(3T,)``; raises `CorruptFile` where a corner uses a vertex that does not exist."""
    from gvpipe.connectivity.edge_seam_kernels import CONTEXTS, DECODE, visit_corners

    seams, numbers = find_seam_corners(point_faces, counts), np.zeros(point_faces.size, np.int64)
    ranks, contexts = np.zeros(len(seams.corners), np.int64), np.zeros(len(seams.corners), np.int64)
    visit_corners(seams, numbers, ranks, contexts, CONTEXTS)
    coded = ~are_first(seams)
    ranks[coded] = decode_integers(data, int(coded.sum()), contexts[coded], "mesh")
    if visit_corners(seams, numbers, ranks, contexts, DECODE) < len(seams.corners):
        raise corrupt_section("mesh", "a corner uses a copy that does not exist")
    return numbers
