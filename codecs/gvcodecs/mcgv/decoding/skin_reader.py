"""The skeleton of a blended file: clusters are joints, and weights are weights already.

A point is at ``p + sum over its clusters  w_k y @ T_k`` with ``y = ((p - centre) / extent, 1)`` (`motion.skinning`). Since
weights add up to one, that is linear blend skinning by the affine motions ``p -> p + y @ T_k``.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gvcodecs.mcgv.base.surface import read_surface
from gvcodecs.mcgv.header import Header
from gvcodecs.mcgv.motion.blended import decode_transforms, read_blend
from gvcodecs.mcgv.motion.skinning import TOTAL, Weights
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import segment_starts
from gvpipe.foundation.arrays import Float32, Float64, Int32, Int64
from gvpipe.model.skin import INFLUENCES, Skin

BYTES_PER_JOINT, SECONDS_PER_JOINT = 1024, 1e-6  # of a frame; keys take most of it


def read_skin(bitstream: Bitstream) -> Skin | None:
    """The skeleton of a bitstream, without what its pictures add; None if it has none.

    Vertices that never move follow a joint of their own, which stands still.

    Raises:
        CorruptFile: a section does not hold what it must.
        OverBudget: transforms of all frames take more memory than the file may.
    """
    header = Header.of(bitstream)
    if header.prediction != "blended" or header.images:
        return None
    n_cells = bitstream.n_frames * (header.clusters + 1)
    bitstream.budget.ask(f"{header.clusters} joints", BYTES_PER_JOINT * n_cells, SECONDS_PER_JOINT * n_cells)
    surface = read_surface(bitstream, header)
    blend = read_blend(bitstream, header, surface)
    bounds = segment_starts(bitstream.n_frames, header.segments)
    to_unit = _to_unit(surface.base, blend.homogeneous)
    transforms = np.tile(np.eye(4), (bitstream.n_frames, header.clusters + 1, 1, 1))
    for s, (start, stop) in enumerate(pairwise(bounds)):
        rows = decode_transforms(bitstream, header, blend, s).rows(0, stop - start)
        own = blend.transforms(rows).reshape(header.clusters, 4, stop - start, 3)  # y @ own
        transforms[start:stop, :-1, :3] += np.einsum("kifc,ij->fkcj", own, to_unit)
    n_vertices = bitstream.n_vertices
    indices, weights = influences(n_vertices, surface.vertices, surface.slot, blend.weights, header.clusters)
    bind: Float32 = np.empty((n_vertices, 3), np.float32)
    surface.fill_still(bind[None])
    bind[surface.vertices] = surface.base[surface.slot]
    used = len(surface.vertices) < n_vertices
    return Skin(indices, weights, bind, transforms if used else transforms[:, :-1])


def influences(n_vertices: int, vertices: Int64, points: Int64, blend: Weights, n_clusters: int) -> tuple[Int32, Float32]:
    """Joints and weights ``(V, 4)``: clusters are joints, and one more, which stands still, has the vertices that never move.

    Args:
        n_vertices: V.
        vertices, points: ``(M,)`` those that move, and the point of each.
        blend: of the points.
        n_clusters: K.
    """
    indices, weights = np.zeros((n_vertices, INFLUENCES), np.int32), np.zeros((n_vertices, INFLUENCES), np.float32)
    indices[:, 0], weights[:, 0] = n_clusters, 1
    indices[vertices] = blend.clusters[points]
    weights[vertices] = blend.weights[points] / np.float32(TOTAL)  # exact: TOTAL is a power of two
    return indices, weights


def _to_unit(base: Float64, homogeneous: Float64) -> Float64:
    """``(4, 4)`` that takes ``(p, 1)`` to the coordinates of a blend: a shift and a scale, found from the points."""
    low, high = base.argmin(axis=0), base.argmax(axis=0)
    result = np.zeros((4, 4))
    result[3, 3] = 1
    for axis in range(3):
        one, two = base[low[axis], axis], base[high[axis], axis]
        a, b = homogeneous[low[axis], axis], homogeneous[high[axis], axis]
        scale = (b - a) / (two - one) if two > one else 0.0
        result[axis, axis], result[axis, 3] = scale, a - scale * one
    return result
