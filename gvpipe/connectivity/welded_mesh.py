"""Triangles, lattice positions of points, seams and vertex order of a mesh <-> bytes.

Vertices that share a trajectory are one *point*: seams, hard edges and triangle soups become the surfaces that they draw, and
are coded once. The mesh over points, with positions, is that of `base_mesh`; `seams` signals which vertex each corner uses.

Mesh stream: [varint] length, mesh of points (`base_mesh`, codec order); [varint] length, counts; corners (`seams`).
Order stream: `seams`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from gvpipe.arrays import Array, Int32, Int64
from gvpipe.connectivity.base_mesh import EncodedMesh, decode_base, encode_base, keep_mesh
from gvpipe.connectivity.seams import decode_seams, encode_seams
from gvpipe.connectivity.vertex_order import MAX_VERTICES
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.mesh.topology import adjacency
from gvpipe.mesh.unique_rows import smallest_first


@dataclass(frozen=True)
class WeldedMesh:
    """A mesh and its points, numbered in the order of the coder's traversal.

    Args:
        faces: ``(T, 3)`` triangles over V vertices.
        point: ``(V,)`` the point of each vertex.
        lattice: ``(P, 3)`` positions of the points, lattice units.
        point_faces: ``(T, 3)`` the triangles over points.
    """

    faces: Int32
    point: Int64
    lattice: Int32
    point_faces: Int32

    @cached_property
    def members(self) -> Int64:
        """``(P,)`` the first vertex of each point."""
        return np.asarray(np.unique(self.point, return_index=True)[1])

    @cached_property
    def neighbours(self) -> sparse.csr_array:
        """The points' symmetric adjacency ``(P, P)``."""
        return adjacency(self.point_faces, len(self.lattice))


def encode_points(
    lattice: Array, faces: Array, points: Array, reorder: bool, across: bool = False
) -> tuple[EncodedMesh, WeldedMesh]:
    """Code a mesh of ``points (V,)``, 0..P-1, at ``lattice (P, 3)`` with triangles ``faces (T, 3)`` over V vertices.

    Returns the streams, and the mesh as decoding returns it. ``reorder`` lets the decoder see the codec's vertex order, and
    ``across`` codes seams across edges (`gvpipe.connectivity.edge_seams`). Triangles may come back in another order, and
    rotated.
    """
    faces, points = faces.astype(np.int64), points.astype(np.int64)
    streams, base = encode_base(lattice, points[faces], reorder=True)
    place = np.argsort(streams.permutation)
    point_faces = smallest_first(base.faces.astype(np.int64))
    coded = encode_seams(faces, place[points], point_faces, len(lattice), reorder, across)
    mesh = pack_block(streams.mesh) + pack_block(coded.counts) + coded.corners
    decoded = WeldedMesh(coded.faces.astype(np.int32), coded.points, base.points, point_faces.astype(np.int32))
    return EncodedMesh(mesh, coded.order, coded.permutation), decoded


def decode_points(
    mesh: bytes, order: bytes, across: bool = False, n_vertices: int = MAX_VERTICES, n_triangles: int = 2 * MAX_VERTICES
) -> WeldedMesh:
    """Mirror of `encode_points`, for a mesh of at most ``n_vertices`` and ``n_triangles``; raises `CorruptFile`."""
    cursor = Cursor(mesh, "mesh")
    base = decode_base(cursor.block(), b"", n_vertices, n_triangles)
    point_faces = smallest_first(base.faces.astype(np.int64))
    counts = cursor.block()
    faces, point = decode_seams(counts, cursor.rest(), order, point_faces, len(base.points), across, n_vertices=n_vertices)
    return WeldedMesh(faces.astype(np.int32), point, base.points, point_faces.astype(np.int32))


def read_points(bitstream: Bitstream, across: bool = False) -> WeldedMesh:
    """Decode the sections ``mesh`` and ``order``; raises `CorruptFile` if they do not hold what the header says."""
    n_vertices, n_triangles = bitstream.n_vertices, bitstream.n_triangles
    keep_mesh(bitstream)
    mesh = decode_points(bitstream.section("mesh"), bitstream.section("order"), across, n_vertices, n_triangles)
    bitstream.check_size(len(mesh.point), len(mesh.faces))
    return mesh
