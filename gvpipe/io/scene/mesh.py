"""Meshes of a scene file, joined into what one `MeshSequence` has: triangles, polygons and parts.

A scene's mesh has polygons, and groups of polygons with a material each. Here polygons become fans of triangles, and those of a
group follow each other, because a part is a range of triangles. Vertices keep their order, polygons that of their group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Int32, Int64, Integers
from gvpipe.foundation.errors import InputError
from gvpipe.io.mesh import fan

LAYER_DOMAINS = ("constant", "polygon", "vertex", "corner")


@dataclass(frozen=True)
class Layer:
    """Static numbers on one mesh, before meshes are joined.

    Args:
        name: of the attribute.
        kind: as of `gvpipe.Attribute`.
        domain: what has a row each: ``"constant"`` (the mesh), ``"polygon"``, ``"vertex"`` or ``"corner"`` (of polygons).
        values: ``(N, C)``.
        indices: ``(rows,)`` the value of each row; None: row i has value i.
    """

    name: str
    kind: str
    domain: str
    values: Array
    indices: Int64 | None = None


@dataclass(frozen=True)
class SceneMesh:
    """One mesh of a scene, as its file has it.

    Args:
        name: of the mesh.
        parent: path of the node that it hangs on.
        n_vertices: its number of vertices.
        counts: ``(P,)`` corners of each polygon.
        corners: ``(sum of counts,)`` vertex of each corner.
        groups: ``(P,)`` group of each polygon, 0 to the number of materials less 1.
        materials: index of each group's material, or None.
        is_flipped: whether its polygons are clockwise seen from outside.
        layers: what it has beside.
    """

    name: str
    parent: str
    n_vertices: int
    counts: Int64
    corners: Int64
    groups: Int64
    materials: tuple[int | None, ...] = (None,)
    is_flipped: bool = False
    layers: tuple[Layer, ...] = ()


@dataclass(frozen=True)
class Fans:
    """The triangles of one mesh, and where they come from.

    Args:
        counts: ``(P',)`` corners of each polygon, in the order of parts.
        corner_source: ``(3 T,)`` number of each triangle corner among the mesh's polygon corners.
        triangle_source: ``(T,)`` polygon of each triangle.
        group_sizes: triangles of each group.
    """

    counts: Int64
    corner_source: Int64
    triangle_source: Int64
    group_sizes: tuple[int, ...]


@dataclass(frozen=True)
class Joined:
    """The meshes of a scene as one: the arguments of `MeshSequence`, and the fans of each mesh."""

    faces: Int32
    polygons: Int32
    parts: tuple[Part, ...]
    fans: tuple[Fans, ...] = field(repr=False, default=())


def join(meshes: Sequence[SceneMesh], where: str) -> Joined:
    """Join the meshes of a scene, in their order.

    Raises:
        InputError: counts or corners of a mesh cannot be, or no mesh has a triangle.
    """
    faces: list[NDArray[np.int64]] = []
    parts: list[Part] = []
    fans: list[Fans] = []
    vertex = triangle = 0
    for mesh in map(by_first_polygon, meshes):
        check_topology(mesh, where)
        made = cut_polygons(mesh)
        fans.append(made)
        faces.append(mesh.corners[made.corner_source] + vertex)
        for group, size in enumerate(made.group_sizes):
            if size or len(made.group_sizes) == 1:
                span = (vertex, vertex + mesh.n_vertices)
                parts.append(Part(mesh.name, span, (triangle, triangle + size), mesh.materials[group], mesh.parent))
            triangle += size
        vertex += mesh.n_vertices
    if not triangle:
        raise InputError(f"{where} has no polygon mesh; a mesh with triangles is needed")
    joined = np.concatenate(faces).reshape(-1, 3).astype(np.int32)
    return Joined(joined, np.concatenate([each.counts for each in fans]).astype(np.int32), tuple(parts), tuple(fans))


def by_first_polygon(mesh: SceneMesh) -> SceneMesh:
    """The mesh with its groups in the order of their first polygons, so that polygons move as little as they must."""
    first = np.full(len(mesh.materials), len(mesh.groups))
    np.minimum.at(first, mesh.groups, np.arange(len(mesh.groups)))
    order = np.argsort(first, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return replace(mesh, groups=rank[mesh.groups], materials=tuple(mesh.materials[number] for number in order))


def cut_polygons(mesh: SceneMesh) -> Fans:
    """Cut a mesh's polygons into fans, group after group; polygons of fewer than 3 corners are left out.

    A flipped polygon keeps its first corner, so that its fan has the same triangles.
    """
    starts = np.cumsum(mesh.counts) - mesh.counts
    order = np.argsort(mesh.groups, kind="stable")
    order = order[mesh.counts[order] >= 3]
    counts = mesh.counts[order]
    rank = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    if mesh.is_flipped:
        rank = np.where(rank > 0, np.repeat(counts, counts) - rank, 0)
    take = np.repeat(starts[order], counts) + rank
    sizes = np.bincount(mesh.groups[order], counts - 2, len(mesh.materials)).astype(int)
    return Fans(counts, take[fan(counts)].reshape(-1), np.repeat(order, counts - 2), tuple(sizes.tolist()))


def check_topology(mesh: SceneMesh, where: str) -> None:
    """Raise `InputError` unless the polygons' corners are vertices of the mesh."""
    label = f"{where}: mesh {mesh.name!r}"
    if mesh.counts.min(initial=0) < 0 or int(mesh.counts.sum()) != len(mesh.corners):
        raise InputError(f"{label}: its faces' corners add up to {int(mesh.counts.sum())}, but it lists {len(mesh.corners)}")
    out = np.flatnonzero((mesh.corners < 0) | (mesh.corners >= mesh.n_vertices))
    if len(out):
        raise InputError(f"{label}: corner {out[0]} is vertex {mesh.corners[out[0]]}; it has vertices 0..{mesh.n_vertices - 1}")


def one_group(counts: Integers) -> Int64:
    """Groups of polygons that all have one material."""
    return np.zeros(len(counts), np.int64)
