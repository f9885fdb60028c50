"""Which copy of its point each corner uses, told along edges: nearly nothing where two triangles meet without a seam.

Triangles that share an edge mostly use the same copies at both of its ends. So the copies that a corner may use are listed,
likely ones first, and its place in the list is coded. Corners come by point and number, and see earlier ones of their point.
The context of a place depends on triangles and numbers of copies alone, which decoders have before the places.

Bytes against those of differences between a point's corners (`copies`): 92 and 1616 (13 boxes, 13,182 vertices), 896 and 2336
(kaykit_spin), 73 and 239 (morph_wave).
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.errors import CorruptFile


def encode_seams(copies: Array, point_faces: Array, counts: Array) -> bytes:
    """Code the copy ``(3 T,)`` that each corner uses, numbered by first use.

    Args:
        point_faces: ``(T, 3)`` triangles over points.
        counts: ``(P,)`` copies of each point.
    """
    from gvpipe.connectivity.edge_seam_kernels import ENCODE, walk

    corners, begins = _shared_corners(point_faces, counts)
    places, contexts = np.zeros(len(corners), np.int64), np.zeros(len(corners), np.int64)
    walk(point_faces.ravel(), corners, begins, counts, copies, places, contexts, ENCODE)
    told = begins < np.arange(len(corners))
    return encode_integers(places[told], contexts[told])


def decode_seams(data: bytes, point_faces: Array, counts: Array) -> Array:
    """Mirror of `encode_seams`; raises `CorruptFile` where a corner uses a copy that does not exist."""
    from gvpipe.connectivity.edge_seam_kernels import CONTEXTS, DECODE, walk

    corners, begins = _shared_corners(point_faces, counts)
    flat, copies = point_faces.ravel(), np.zeros(point_faces.size, np.int64)
    places, contexts = np.zeros(len(corners), np.int64), np.zeros(len(corners), np.int64)
    walk(flat, corners, begins, counts, copies, places, contexts, CONTEXTS)
    told = begins < np.arange(len(corners))
    places[told] = decode_integers(data, int(told.sum()), contexts[told], "mesh")
    if walk(flat, corners, begins, counts, copies, places, contexts, DECODE) < len(corners):
        raise CorruptFile("section 'mesh' is corrupt: a corner uses a copy that does not exist")
    return copies


def _shared_corners(point_faces: Array, counts: Array) -> tuple[Array, Array]:
    """Corners of points with more than one copy, by point, then by number; and for each the place of its point's first."""
    flat = point_faces.ravel()
    where = np.flatnonzero(counts[flat] > 1)
    where = where[np.argsort(flat[where], kind="stable")]
    is_first = np.diff(flat[where], prepend=-1) > 0
    return where, np.maximum.accumulate(np.where(is_first, np.arange(len(where)), 0))
