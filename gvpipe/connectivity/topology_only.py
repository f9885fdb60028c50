"""Triangles, seams and vertex order of a mesh <-> bytes, without any position.

Codecs that code all positions themselves need connectivity alone. Draco's Edgebreaker codes it at 2.3 bits per vertex once
positions carry no information. They go in as distinct tiny floats that all quantise to one value at one bit, so that Draco
keeps vertices apart and spends next to nothing on them. A second run, whose stream is not kept, has the vertices' numbers for
positions; it shows in which order vertices come out.

Vertices that share a trajectory (seams, triangle soups) are welded to *points* first, so that Draco, and everything after it,
sees one surface; each corner then names the vertex it uses (`seams`).

Mesh stream: [6 x 32 bits] bytes of Draco, merges, loose triangles, counts; loose triangles; points. Then these in that order:

- Draco's stream;
- *merges* [integers]: Draco splits points at non-manifold places. Of each vertex whose point came out before: how many Draco
  vertices lie between it and the last such one, and how far back its point's first vertex is;
- loose triangles, deflated as in `base_mesh`;
- the streams ``counts`` and ``corners`` of `seams`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.base_mesh import (
    COMPRESSION_LEVEL,
    MAX_PER_BYTE,
    EncodedMesh,
    check_draco_header,
    keep_mesh,
    may_run_beside,
)
from gvpipe.connectivity.candidate_order import seconds_of
from gvpipe.connectivity.seams import decode_seams, encode_seams
from gvpipe.connectivity.vertex_order import MAX_VERTICES
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.foundation.errors import CorruptFile, corrupt_section
from gvpipe.mesh.unique_rows import decode_table, encode_table, left_out, smallest_first, used_vertices
from gvpipe.runtime.ahead import beside

HEADER = struct.Struct("<6I")


@dataclass(frozen=True)
class Topology:
    """Triangles over vertices and over welded points, without positions.

    Args:
        faces: ``(T, 3) int32`` triangles over V vertices.
        points: ``(V,) int64`` the point of each vertex.
        point_faces: ``(T, 3) int32`` the same triangles over P points, numbered in the order of Draco's traversal.
        n_points: P.
    """

    faces: Int32
    points: Array
    point_faces: Int32
    n_points: int


class PointTriangles(NamedTuple):
    """What comes first of a decoded mesh: triangles ``point_faces (T, 3) int32`` over ``n_points``, P."""

    point_faces: Int32
    n_points: int


def encode_mesh(faces: Int32, points: Array, reorder: bool) -> tuple[EncodedMesh, Topology]:
    """Code triangles ``(T, 3)`` over V vertices, of which those with equal ``points (V,)``, 0..P-1, are one point.

    Returns the streams, and the mesh as decoding returns it. ``reorder`` lets the decoder see the codec's vertex order.
    Triangles may come back in another order, and rotated.
    """
    faces, points = faces.astype(np.int64), points.astype(np.int64)
    n_points = int(points.max()) + 1
    parts, permutation, coded_faces = encode_triangles(points[faces], n_points)
    coded = encode_seams(faces, np.argsort(permutation)[points], coded_faces, n_points, reorder, adaptive=True)
    head = HEADER.pack(*(len(part) for part in parts[:2]), len(parts[2]), len(coded.counts), parts[3], n_points)
    streams = head + b"".join([*parts[:3], coded.counts, coded.corners])
    decoded = Topology(coded.faces.astype(np.int32), coded.points, coded_faces.astype(np.int32), n_points)
    return EncodedMesh(streams, coded.order, coded.permutation), decoded


CodedTriangles = tuple[tuple[bytes, bytes, bytes, int], Array, Array]
"""What `encode_triangles` returns."""


def encode_triangles(faces: Array, n_points: int) -> CodedTriangles:
    """Code triangles ``(T, 3)`` over P points.

    Returns:
        Draco's stream, merges, loose triangles and how many these are; the given point ``(P,)`` of each decoded one; and the
        decoded triangles.
    """
    try:
        return _place_points(faces, n_points, _encode_draco(faces))
    except (ValueError, CorruptFile):
        return _place_points(faces, n_points, _NOTHING)


def decode_mesh(mesh: bytes, order: bytes, n_vertices: int, n_triangles: int = 2 * MAX_VERTICES) -> Topology:
    """Mirror of `encode_mesh`, for a mesh of at most ``n_vertices`` and ``n_triangles``; raises `CorruptFile`."""
    return _begin_mesh(mesh, order, n_vertices, n_triangles)[1]()


def _begin_mesh(mesh: bytes, order: bytes, n_vertices: int, n_triangles: int) -> tuple[PointTriangles, Callable[[], Topology]]:
    """Decode the triangles over points; return these, and a function that decodes the vertices. Both raise `CorruptFile`."""
    cursor = Cursor(mesh, "mesh")
    bytes_draco, bytes_merges, bytes_loose, bytes_counts, n_loose, n_points = cursor.struct(HEADER)
    if n_points > min(MAX_VERTICES, n_vertices) or n_loose > min(n_triangles, MAX_PER_BYTE * len(mesh)):
        raise cursor.corrupt(f"{n_points} points and {n_loose} loose triangles in {len(mesh)} bytes")
    draco, merges, loose = cursor.take(bytes_draco), cursor.take(bytes_merges), cursor.take(bytes_loose)
    check_draco_header(draco, n_triangles)
    point_faces = decode_triangles(draco, merges, loose, n_loose)
    if point_faces.size and (point_faces.min() < 0 or point_faces.max() >= n_points):
        raise cursor.corrupt("a triangle names a point that does not exist")
    counts, corners = cursor.take(bytes_counts), cursor.rest()
    opened = PointTriangles(point_faces.astype(np.int32), n_points)

    def finish() -> Topology:
        faces, points = decode_seams(counts, corners, order, opened.point_faces, n_points, n_vertices=n_vertices)
        return Topology(faces.astype(np.int32), points, *opened)

    return opened, finish


def decode_triangles(draco: bytes, merges: bytes, loose: bytes, n_loose: int) -> Array:
    """Triangles over points, smallest point first: Draco's with its split vertices merged, then the loose ones.

    Mirror of `encode_triangles`; raises `CorruptFile`. The caller checks the points.
    """
    faces, n_vertices = _decode_draco(draco)
    return np.concatenate([smallest_first(_merge(faces, n_vertices, merges)), decode_table(loose, n_loose)])


@contextmanager
def open_mesh(bitstream: Bitstream) -> Iterator[tuple[PointTriangles, Callable[[], Topology]]]:
    """Decode the sections ``mesh`` and ``order``: give the first part, and a function that waits for all of it.

    What needs the first part alone can be done meanwhile. Both raise `CorruptFile` if the sections do not hold what the header
    says.
    """
    n_vertices, n_triangles = bitstream.n_vertices, bitstream.n_triangles
    order = bitstream.section("order")
    keep_mesh(bitstream.budget, n_vertices, n_triangles, seconds_of(order, n_vertices))
    opened, finish = _begin_mesh(bitstream.section("mesh"), order, n_vertices, n_triangles)
    bitstream.check_size(n_vertices, len(opened.point_faces))

    def checked() -> Topology:
        mesh = finish()
        bitstream.check_size(len(mesh.points), len(mesh.faces))
        return mesh

    with beside(checked, may_run_beside(bitstream.budget, n_vertices, n_triangles)) as finished:
        yield opened, finished


class _Carried(NamedTuple):
    """What Draco carries: its stream, the triangles that it decodes to, and the point of each of their vertices."""

    draco: bytes
    faces: Array
    came_from: Array


_NOTHING = _Carried(b"", np.zeros((0, 3), np.int64), np.zeros(0, np.int64))


def _encode_draco(faces: Array) -> _Carried:
    """Code the triangles with three different points; raises ValueError where Draco fails."""
    import DracoPy

    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    faces = faces[np.argsort(-faces.max(axis=1, initial=0), kind="stable")]  # as in `base_mesh`: vertex orders follow
    used = used_vertices(faces, int(faces.max(initial=-1)) + 1)
    if not len(used):
        return _NOTHING
    number = np.arange(len(used))
    silent = np.zeros((len(used), 3), np.float32)
    silent[:, 0] = (1 + number % 1024) * 2.0**-30
    silent[:, 1] = (1 + number // 1024) * 2.0**-40
    silent[0] = 1
    numbered = np.c_[number, 0 * number, 0 * number].astype(np.uint32)
    corners = np.searchsorted(used, faces).astype(np.uint32)
    try:
        draco = bytes(DracoPy.encode(silent, corners, quantization_bits=1, compression_level=COMPRESSION_LEVEL))
        in_order = DracoPy.decode(DracoPy.encode(numbered, corners, compression_level=COMPRESSION_LEVEL))
        decoded = DracoPy.decode(draco).faces
    except Exception as exc:  # DracoPy's own and bare ones; each means: not this way
        raise ValueError("Draco cannot encode this mesh") from exc
    if not np.array_equal(in_order.faces, decoded):
        raise ValueError("Draco's order depends on positions")
    return _Carried(draco, decoded.astype(np.int64), used[in_order.points[:, 0].astype(np.int64)])


def _place_points(faces: Array, n_points: int, carried: _Carried) -> tuple[tuple[bytes, bytes, bytes, int], Array, Array]:
    """What `encode_triangles` returns, of triangles over points and what Draco carries of them."""
    draco, draco_faces, came_from = carried
    _, first, inverse = np.unique(came_from, return_index=True, return_inverse=True)
    again = np.flatnonzero(first[inverse] != np.arange(len(came_from)))  # Draco vertices whose point came before
    back = again - first[inverse][again]
    merges = varint(len(again)) + encode_integers(np.stack([np.diff(again, prepend=-1) - 1, back])) if len(again) else b""
    carried_points = came_from[np.sort(first)]
    is_left = np.ones(n_points, bool)
    is_left[carried_points] = False
    permutation = np.concatenate([carried_points, np.flatnonzero(is_left)])
    merged = smallest_first(_merge(draco_faces, len(came_from), merges))
    loose = left_out(smallest_first(np.argsort(permutation)[faces]), merged)
    return (draco, merges, encode_table(loose), len(loose)), permutation, np.concatenate([merged, loose])


def _merge(faces: Array, n_vertices: int, merges: bytes) -> Array:
    """Draco's triangles over points: vertices that it split are one point again; raises `CorruptFile`."""
    if not merges:
        return faces
    cursor, stands_for = Cursor(merges, "mesh"), np.arange(n_vertices)
    n_merges = cursor.varint(n_vertices, "the number of merges")
    gaps, back = decode_integers(cursor.rest(), 2 * n_merges, name="mesh").reshape(2, -1)
    if not n_merges or ((gaps < 0) | (gaps >= n_vertices)).any():
        raise corrupt_section("mesh", "a merge names a vertex that does not exist")
    again = np.cumsum(gaps + 1) - 1
    if (back <= 0).any() or again[-1] >= n_vertices or (back > again).any():
        raise corrupt_section("mesh", "a merge names a vertex that does not exist")
    stands_for[again] = again - back
    is_new = np.ones(n_vertices, bool)
    is_new[again] = False
    if not is_new[stands_for[again]].all():
        raise corrupt_section("mesh", "a merge names a merged vertex")
    stands_for = (np.cumsum(is_new) - 1)[stands_for]
    merged: Array = stands_for[faces]
    return merged


def _decode_draco(draco: bytes) -> tuple[Array, int]:
    import DracoPy

    if not draco:
        return np.zeros((0, 3), np.int64), 0
    try:
        decoded = DracoPy.decode(draco)
        faces, n_vertices = decoded.faces.astype(np.int64), len(decoded.points)
    except Exception as exc:  # DracoPy's own, TypeError, bare ones; each means: corrupt
        raise corrupt_section("mesh", "Draco cannot decode it") from exc
    if faces.size and (faces.min() < 0 or faces.max() >= n_vertices):
        raise corrupt_section("mesh", "a triangle names a vertex that does not exist")
    return faces, n_vertices
