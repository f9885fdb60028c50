"""Triangles and base-frame lattice positions of points <-> bytes, exactly.

Draco's Edgebreaker (Rossignac, Edgebreaker: Connectivity compression for triangle meshes, 1999) carries connectivity
and positions. Alone it is not lossless: it renumbers vertices, merges those with equal attributes, splits
non-manifold ones, and drops degenerate triangles and unreferenced vertices. So positions go in as integers, an
occurrence number tells apart vertices that share a lattice position, the decoder merges what was split, and whatever
does not come back from a trial decode (in the worst case everything) is sent beside it as *loose* vertices and faces.

Mesh stream: [4 x 32 bits] Draco bytes, loose vertices, loose faces, bytes of the loose vertices; then the Draco
stream, the loose vertices and the loose faces, each table as deflated byte planes of row differences.
Codec order: Draco's vertices by first appearance after merging, then the loose ones.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from gvpipe.connectivity.vertex_order import MAX_VERTICES
from gvpipe.container.cursor import Cursor
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import CorruptFile, InputError, corrupt_section
from gvpipe.mesh.unique_rows import are_distinct, decode_table, encode_table, left_out, row_ids, smallest_first, used_vertices
from gvpipe.runtime.ahead import beside

HEADER = struct.Struct("<4I")
COMPRESSION_LEVEL = 10  # Draco's best; 20 ms for 10k vertices
MAX_DRACO_COORDINATE = (1 << 22) - 1  # Draco's time and memory grow with the range: 31 bits take 90 s for 81 vertices
DRACO_PREFIX = b"DRACO\x02\x02\x01\x01\x00\x00"  # version 2.2, triangular mesh, Edgebreaker, no metadata
MAX_PER_BYTE = 1024  # no allocation beyond what this many bytes can honestly hold; deflate's own limit is near
PEAK_PER_VERTEX, PEAK_PER_TRIANGLE = 160, 160  # bytes
LARGE = 1 << 14  # vertices; fewer do not pay for another thread
BESIDE = 3  # times the peak, above what a mesh and a vertex hierarchy take together
KEPT_PER_VERTEX, KEPT_PER_TRIANGLE = 24, 24
SECONDS_PER_VERTEX, SECONDS_PER_TRIANGLE = 0.4e-6, 0.3e-6
GENERIC = 4  # draco::GeometryAttribute::GENERIC


@dataclass(frozen=True)
class EncodedMesh:
    """The streams of a mesh, and how a decoder numbers its vertices.

    Args:
        mesh: stream.
        order: stream, empty: decode in the codec's order.
        permutation: ``(V,) int64``: decoded vertex i is the given vertex permutation[i].
        is_adaptive: whether adaptive contexts made a stream smaller (`welded_mesh`).
    """

    mesh: bytes
    order: bytes
    permutation: Array
    is_adaptive: bool = False


@dataclass(frozen=True)
class BaseMesh:
    """Points ``(P, 3) int32``, lattice units, and triangles ``(T, 3) int32``, in the order of a traversal of the surface."""

    points: Int32
    faces: Int32


def encode_base(points: Array, faces: Array) -> tuple[bytes, Array, BaseMesh]:
    """Code lattice points ``(P, 3)`` integers in [0, 2^31) and triangles ``(T, 3)``.

    Triangles may come back in another order, and rotated.

    Returns:
        The stream, the given point ``(P,)`` of each decoded one, and the mesh as decoding returns it.
    """
    points, faces = np.asarray(points), np.asarray(faces)
    n_points = len(points)
    if points.shape != (n_points, 3) or faces.shape != (len(faces), 3):
        raise InputError(f"points {points.shape} and faces {faces.shape}: both must have three columns")
    if n_points > MAX_VERTICES:
        raise InputError(f"{n_points} vertices: at most {MAX_VERTICES}")
    if points.size and (points.min() < 0 or points.max() >= 1 << 31):
        raise InputError(f"points span {points.min()}..{points.max()}: lattice coordinates lie in 0..2^31 - 1")
    if faces.size and (faces.min() < 0 or faces.max() >= n_points):
        raise InputError(f"faces index {faces.min()}..{faces.max()}, vertices are 0..{n_points - 1}")
    points, faces = points.astype(np.int64), faces.astype(np.int64)

    try:
        mesh, permutation, codec_faces = _encode_mesh(points, faces, _encode_draco(points, _proper(points, faces)))
    except (ValueError, CorruptFile):
        mesh, permutation, codec_faces = _encode_mesh(points, faces, b"")
    return mesh, permutation, BaseMesh(points[permutation].astype(np.int32), codec_faces.astype(np.int32))


def decode_base(mesh: bytes, n_vertices: int = MAX_VERTICES, n_triangles: int = 2 * MAX_VERTICES) -> BaseMesh:
    """Mirror of `encode_base`, for a mesh of at most ``n_vertices`` and ``n_triangles``; raises `CorruptFile`."""
    points, faces = _decode_mesh(mesh, n_vertices, n_triangles)
    return BaseMesh(points.astype(np.int32), faces.astype(np.int32))


def keep_mesh(budget: Budget, n_vertices: int, n_triangles: int, more_seconds: float = 0.0) -> None:
    """Check that a file may take the memory and work of a mesh of its size, and more of work; raises `OverBudget`."""
    what = f"a mesh of {n_vertices} vertices and {n_triangles} triangles"
    budget.ask(what, PEAK_PER_VERTEX * n_vertices + PEAK_PER_TRIANGLE * n_triangles)
    seconds = SECONDS_PER_VERTEX * n_vertices + SECONDS_PER_TRIANGLE * n_triangles + more_seconds
    budget.keep(what, KEPT_PER_VERTEX * n_vertices + KEPT_PER_TRIANGLE * n_triangles, seconds)


def may_run_beside(budget: Budget, n_vertices: int, n_triangles: int) -> bool:
    """Whether vertices are decoded beside what needs points alone: of large meshes, if the file may take the memory of both."""
    peak = PEAK_PER_VERTEX * n_vertices + PEAK_PER_TRIANGLE * n_triangles
    return n_vertices >= LARGE and BESIDE * peak <= budget.memory_beside


def _encode_draco(points: Array, faces: Array) -> bytes:
    """The Draco stream, or nothing where there is nothing that Draco could carry. Raises ValueError if it fails."""
    import DracoPy

    # Draco visits components in the order of their first triangles. The vertex order is cheaper to code when
    # components follow it, backwards because Draco's decoder rebuilds the mesh from its end.
    faces = faces[np.argsort(-faces.max(axis=1, initial=0), kind="stable")]
    used = used_vertices(faces, len(points))
    if not len(used) or points.max() > MAX_DRACO_COORDINATE:
        return b""
    occurrence = _occurrences(points[used])
    distinct = {0: occurrence[:, None].astype(np.uint32)} if occurrence.any() else None
    try:
        return bytes(
            DracoPy.encode(
                points[used].astype(np.uint32),  # an integer dtype: Draco then keeps positions as they are
                np.searchsorted(used, faces).astype(np.uint32),
                compression_level=COMPRESSION_LEVEL,
                generic_attributes=distinct,  # a number as key: a name would add metadata
            )
        )
    except Exception as exc:  # DracoPy's own and bare ones; each means: not this way
        raise ValueError("Draco cannot encode this mesh") from exc


def _encode_mesh(points: Array, faces: Array, draco: bytes) -> tuple[bytes, Array, Array]:
    """The mesh stream, its codec order, and its triangles in that order.

    Whatever the Draco stream does not give back is added as loose rows. Raises ValueError where it gives back something else.
    """
    keys, draco_faces = _decode_draco(draco)
    carried = _find_vertices(points, used_vertices(_proper(points, faces), len(points)), keys)
    is_loose = np.ones(len(points), bool)
    is_loose[carried] = False
    permutation = np.concatenate([carried, np.flatnonzero(is_loose)])
    codec_index = np.argsort(permutation).astype(np.int32)

    loose_faces = left_out(smallest_first(codec_index[faces]), smallest_first(draco_faces.astype(np.int32))).astype(np.int64)
    loose_points = encode_table(points[is_loose])
    header = HEADER.pack(len(draco), int(is_loose.sum()), len(loose_faces), len(loose_points))
    mesh = header + draco + loose_points + encode_table(loose_faces)
    return mesh, permutation, np.concatenate([draco_faces, loose_faces])


def _proper(points: Array, faces: Array) -> Array:
    """The triangles with three different lattice positions; Draco drops the others, and prints if no triangle is left."""
    place = row_ids(points)[0][faces]
    proper: Array = faces[(place != np.roll(place, 1, axis=1)).all(axis=1)]
    return proper


def _find_vertices(points: Array, used: Array, keys: Array) -> Array:
    """The vertex that each key (position, occurrence), as decoded, stands for."""
    own_keys = np.c_[points[used], _occurrences(points[used])]
    ids, representatives = row_ids(np.concatenate([own_keys, keys]))
    found = representatives[ids[len(used) :]]
    if (found >= len(used)).any():
        raise ValueError("Draco returned vertices that the mesh does not have")
    vertices: Array = used[found]
    return vertices


def _decode_draco(draco: bytes) -> tuple[Array, Array]:
    """Keys (n, 4) int64 of distinct vertices (position, occurrence), and triangles over them."""
    import DracoPy

    if not draco:
        return np.zeros((0, 4), np.int64), np.zeros((0, 3), np.int64)
    try:
        decoded = DracoPy.decode(draco)
        points, attributes = decoded.points, decoded.attributes
        faces = decoded.faces.astype(np.int64)
    except Exception as exc:  # DracoPy's own, TypeError, bare ones; each means: corrupt
        raise corrupt_section("mesh", "Draco cannot decode it") from exc
    if points is None or points.dtype != np.uint32 or points.shape[1:] != (3,) or len(attributes) > 2:
        raise corrupt_section("mesh", "unexpected Draco attributes")
    occurrence = np.zeros((len(points), 1), np.int64)
    for attribute in attributes:
        if attribute["attribute_type"] == GENERIC:
            occurrence = np.asarray(attribute["data"])
    if occurrence.shape != (len(points), 1) or occurrence.dtype.kind not in "iu":
        raise corrupt_section("mesh", "unexpected Draco attributes")
    keys = np.empty((len(points), 4), np.int64)
    keys[:, :3], keys[:, 3:] = points, occurrence
    if keys.size and keys.max() >= 1 << 31:
        raise corrupt_section("mesh", "lattice coordinate out of range")
    with beside(lambda: are_distinct(keys), len(keys) >= LARGE) as distinct:
        if faces.size and (faces.min() < 0 or faces.max() >= len(keys)):
            raise corrupt_section("mesh", "a triangle names a vertex that does not exist")
        if distinct():
            return keys, faces
    ids, representatives = row_ids(keys)  # merge what Draco split
    by_appearance = np.argsort(representatives)
    return keys[representatives[by_appearance]], np.argsort(by_appearance)[ids][faces]


def check_draco_header(draco: bytes, n_triangles: int) -> None:
    """Refuse counts that a mesh of ``n_triangles`` cannot have before Draco allocates for them.

    They say nothing about the stream's length: a regular mesh of two million triangles takes 1.7 kB. `keep_mesh` has limited
    ``n_triangles``.
    """
    if not draco:
        return
    if not draco.startswith(DRACO_PREFIX):
        raise corrupt_section("mesh", "not the kind of Draco stream that is written here")
    cursor = Cursor(draco, "mesh")
    cursor.take(len(DRACO_PREFIX) + 1)  # the last byte is the traversal type
    for elements, most in (("vertices", 3 * n_triangles), ("faces", n_triangles)):
        count = cursor.varint((1 << 35) - 1, f"Draco's number of {elements}")
        if count > most:
            raise cursor.corrupt(f"{count} {elements} in Draco's stream; at most {most} fit the header")


def _decode_mesh(mesh: bytes, n_vertices: int, n_triangles: int) -> tuple[Array, Array]:
    cursor = Cursor(mesh, "mesh")
    bytes_draco, n_loose_points, n_loose_faces, bytes_points = cursor.struct(HEADER)
    if n_loose_points > n_vertices or n_loose_faces > n_triangles:
        raise cursor.corrupt(f"{n_loose_points} loose vertices and {n_loose_faces} loose triangles")
    draco, loose_points = cursor.take(bytes_draco), cursor.take(bytes_points)
    check_draco_header(draco, n_triangles)
    keys, draco_faces = _decode_draco(draco)
    points = _with_loose(keys[:, :3], loose_points, n_loose_points)
    faces = _with_loose(draco_faces, cursor.rest(), n_loose_faces)
    if len(points) > MAX_VERTICES:
        raise corrupt_section("mesh", f"{len(points)} vertices, at most {MAX_VERTICES}")
    if points.size and points.min() < 0:
        raise corrupt_section("mesh", "lattice coordinate out of range")
    if faces.size and (faces.min() < 0 or faces.max() >= len(points)):
        raise corrupt_section("mesh", "a triangle names a vertex that does not exist")
    return points, faces


def _with_loose(rows: Array, data: bytes, count: int) -> Array:
    """Rows, and after them ``count`` more that a table holds."""
    loose = decode_table(data, count)
    return np.concatenate([rows, loose]) if count else rows


def _occurrences(rows: Array) -> Array:
    """For each row, how many equal rows come before it."""
    ids, _ = row_ids(rows)
    order = np.argsort(ids, kind="stable")
    place = np.arange(len(rows))
    is_first = np.diff(ids[order], prepend=-1) > 0
    occurrences = np.empty(len(rows), np.int64)
    occurrences[order] = place - np.maximum.accumulate(np.where(is_first, place, 0))
    return occurrences
