"""Triangles, lattice positions of points, seams and vertex order of a mesh <-> bytes.

Vertices that share a trajectory are one *point*: seams, hard edges and triangle soups become the surfaces that they draw, and
are coded once. The mesh over points, with positions, is that of `base_mesh`; `seams` signals which vertex each corner uses.

Mesh stream: [8 bits] flags; [varint] length, mesh of points (codec order); [varint] length, counts; corners (`seams`).
Order stream: `seams`.

Flag 1: the mesh of points is of `adaptive_mesh`; 4: of that, and fitted; neither: of `base_mesh`. An encoder takes the smallest
that is worth its time. Flag 2: the order is of `adaptive_order`, as older encoders wrote it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.connectivity import adaptive_mesh, candidate_order
from gvpipe.connectivity.base_mesh import BaseMesh, EncodedMesh, decode_base, encode_base, keep_mesh, may_run_beside
from gvpipe.connectivity.seams import decode_seams, encode_seams
from gvpipe.connectivity.topology_only import encode_triangles
from gvpipe.connectivity.vertex_order import MAX_VERTICES
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.mesh.unique_rows import smallest_first
from gvpipe.runtime.ahead import beside
from gvpipe.runtime.forks import kept

if TYPE_CHECKING:
    from gvpipe.mesh.graph_kernels import Graph

ADAPTIVE_MESH, ADAPTIVE_ORDER, FITTED_MESH = 1, 2, 4  # flags; the first and the last exclude each other
FEW_POINTS, FEW_FITTED = 1 << 13, 1 << 11  # up to which adaptive positions, and fitted ones, open in no time
SECONDS_PER_FITTED = 32e-6  # of hostile streams
WORTH_WAITING = 0.9  # of what takes less time, what theirs must be beyond that


@dataclass(frozen=True)
class PointMesh:
    """The points of a mesh, numbered in the order of the coder's traversal.

    Args:
        lattice: ``(P, 3)`` positions of the points, lattice units.
        point_faces: ``(T, 3)`` the triangles over points.
    """

    lattice: Int32
    point_faces: Int32

    @kept
    def graph(self) -> Graph:
        """The points' edges."""
        from gvpipe.mesh.graph_kernels import link_vertices

        return link_vertices(np.ascontiguousarray(self.point_faces, np.int32), len(self.lattice))


@dataclass(frozen=True)
class WeldedMesh(PointMesh):
    """A mesh and its points.

    Args:
        faces: ``(T, 3)`` triangles over V vertices.
        point: ``(V,)`` the point of each vertex.
    """

    faces: Int32
    point: Int64

    @kept
    def members(self) -> Int64:
        """``(P,)`` the first vertex of each point."""
        return np.asarray(np.unique(self.point, return_index=True)[1])


def encode_points(
    lattice: Array, faces: Array, points: Array, reorder: bool, adaptive: bool = True
) -> tuple[EncodedMesh, WeldedMesh]:
    """Code a mesh of ``points (V,)``, 0..P-1, at ``lattice (P, 3)`` with triangles ``faces (T, 3)`` over V vertices.

    Returns the streams, and the mesh as decoding returns it. ``reorder`` lets the decoder see the codec's vertex order, and
    ``adaptive`` allows streams by adaptive contexts. Triangles may come back in another order, and rotated.
    """
    faces, points = faces.astype(np.int64), points.astype(np.int64)
    mesh, flags, permutation, base = _encode_mesh(lattice, points[faces], adaptive)
    place = np.argsort(permutation)
    point_faces = smallest_first(base.faces.astype(np.int64))
    coded = encode_seams(faces, place[points], point_faces, len(lattice), reorder, adaptive)
    mesh = bytes([flags]) + pack_block(mesh) + pack_block(coded.counts) + coded.corners
    decoded = WeldedMesh(base.points, point_faces.astype(np.int32), coded.faces.astype(np.int32), coded.points)
    return EncodedMesh(mesh, coded.order, coded.permutation, is_adaptive=flags > 0 or coded.is_adaptive), decoded


def _encode_mesh(lattice: Array, faces: Array, adaptive: bool) -> tuple[bytes, int, Array, BaseMesh]:
    """The mesh stream of points that is worth its time, its flag, the given point of each decoded one, what a decoder has."""
    mesh, order, base = encode_base(lattice, faces)
    flag = 0
    if adaptive and len(lattice) <= adaptive_mesh.MAX_POINTS:
        coded = encode_triangles(faces.astype(np.int64), len(lattice))
        for own_flag, few in ((ADAPTIVE_MESH, FEW_POINTS), (FITTED_MESH, FEW_FITTED)):
            own, permutation, triangles = adaptive_mesh.encode_adaptive_mesh(lattice, faces, own_flag == FITTED_MESH, coded)
            if len(own) < (1 if len(lattice) <= few else WORTH_WAITING) * len(mesh):
                mesh, flag, order = own, own_flag, permutation
                base = BaseMesh(lattice[order].astype(np.int32), triangles.astype(np.int32))
    return mesh, flag, order, base


def decode_points(mesh: bytes, order: bytes, n_vertices: int = MAX_VERTICES, n_triangles: int = 2 * MAX_VERTICES) -> WeldedMesh:
    """Mirror of `encode_points`, for a mesh of at most ``n_vertices`` and ``n_triangles``; raises `CorruptFile`."""
    return _begin_points(mesh, order, n_vertices, n_triangles)[1]()


def _begin_points(mesh: bytes, order: bytes, n_vertices: int, n_triangles: int) -> tuple[PointMesh, Callable[[], WeldedMesh]]:
    """Decode the points; return these, and a function that decodes the vertices. Both raise `CorruptFile`."""
    cursor = Cursor(mesh, "mesh")
    flags = cursor.take(1)[0]
    if flags > FITTED_MESH + ADAPTIVE_ORDER or (flags & ADAPTIVE_MESH and flags & FITTED_MESH):
        raise cursor.corrupt(f"flags {flags} are unknown")
    points, own = _decode_mesh(cursor.block(), flags & (ADAPTIVE_MESH | FITTED_MESH), n_vertices, n_triangles)
    counts, corners = cursor.block(), cursor.rest()
    opened = PointMesh(points.astype(np.int32), smallest_first(own.astype(np.int32)))
    _ = opened.graph  # found now, before two threads ask for it

    def finish() -> WeldedMesh:
        adapts, streams = bool(flags & ADAPTIVE_ORDER), (counts, corners, order)
        faces, point = decode_seams(
            *streams, opened.point_faces, len(points), adapts, n_vertices=n_vertices, graph=opened.graph
        )
        return WeldedMesh(opened.lattice, opened.point_faces, faces.astype(np.int32, copy=False), point)

    return opened, finish


def _decode_mesh(mesh: bytes, flag: int, n_vertices: int, n_triangles: int) -> tuple[Array, Array]:
    """Mirror of `_encode_mesh`: points ``(P, 3)`` and triangles over them."""
    if flag:
        return adaptive_mesh.decode_adaptive_mesh(mesh, n_vertices, n_triangles, flag == FITTED_MESH)
    base = decode_base(mesh, n_vertices, n_triangles)
    return base.points, base.faces


@contextmanager
def open_points(bitstream: Bitstream) -> Iterator[tuple[PointMesh, Callable[[], WeldedMesh]]]:
    """Decode the sections ``mesh`` and ``order``: give the points, and a function that waits for all of it.

    What needs points alone can be done meanwhile. Both raise `CorruptFile` if the sections do not hold what the header says.
    """
    points, finish = _begin_reading(bitstream)
    with beside(finish, may_run_beside(bitstream.budget, bitstream.n_vertices, bitstream.n_triangles)) as finished:
        yield points, finished


def read_points(bitstream: Bitstream) -> WeldedMesh:
    """Decode the sections ``mesh`` and ``order``; raises `CorruptFile` if they do not hold what the header says."""
    return _begin_reading(bitstream)[1]()


def _begin_reading(bitstream: Bitstream) -> tuple[PointMesh, Callable[[], WeldedMesh]]:
    """As `_begin_points`, of a file; sizes are checked."""
    n_vertices, n_triangles = bitstream.n_vertices, bitstream.n_triangles
    mesh, order = bitstream.section("mesh"), bitstream.section("order")
    fitted = min(n_vertices, adaptive_mesh.MAX_POINTS) if mesh and mesh[0] & FITTED_MESH else 0
    more = SECONDS_PER_FITTED * fitted + candidate_order.seconds_of(order, n_vertices)
    keep_mesh(bitstream.budget, n_vertices, n_triangles, more)
    points, finish = _begin_points(mesh, order, n_vertices, n_triangles)
    bitstream.check_size(n_vertices, len(points.point_faces))

    def checked() -> WeldedMesh:
        mesh = finish()
        bitstream.check_size(len(mesh.point), len(mesh.faces))
        return mesh

    return points, checked
