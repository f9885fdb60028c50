"""A sequence as a scene file's meshes: parts of one mesh put together, attributes by polygon corner.

It undoes what `scene_mesh` and `scene_layers` do, for writers of scene formats.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.asset.part import Part
from gvpipe.asset.polygons import polygon_corners, polygon_starts
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.io.scene.mesh import Layer
from gvpipe.model.sequence import MeshSequence


@dataclass(frozen=True)
class ExportMesh:
    """One mesh to write.

    Args:
        name, parent: as of its parts.
        vertices: first of the sequence's vertices, and the one after the last.
        triangles: the same of triangles.
        counts: ``(P,)`` corners of each polygon.
        corners: ``(sum of counts,)`` vertex of each corner, counted from the mesh's first.
        source: ``(sum of counts,)`` number of each corner among the sequence's triangle corners.
        groups: polygons (first, stop) and material of each of its parts, in order.
        part: number of its first part, 0 without parts.
    """

    name: str
    parent: str
    vertices: tuple[int, int]
    triangles: tuple[int, int]
    counts: Int32
    corners: Int64
    source: Int64
    groups: tuple[tuple[int, int, int | None], ...]
    part: int = 0


def export_meshes(sequence: MeshSequence, name: str) -> list[ExportMesh]:
    """The meshes of a sequence: parts that follow each other with one name, parent and range of vertices are one.

    Args:
        sequence: whose parts are written.
        name: of the mesh, where there are no parts.
    """
    n_triangles = len(sequence.faces)
    counts = np.full(n_triangles, 3, np.int32) if sequence.polygons is None else sequence.polygons
    starts = np.append(polygon_starts(counts.astype(np.int64)), n_triangles)  # first triangle of each polygon
    parts = sequence.parts or (Part(name, (0, sequence.n_vertices), (0, n_triangles)),)
    corner_starts = np.append(0, np.cumsum(counts))
    corners = polygon_corners(counts)
    meshes = []
    first = 0
    while first < len(parts):
        stop = first + 1
        while stop < len(parts) and _is_same(parts[first], parts[stop]):
            stop += 1
        own = parts[first:stop]
        low, high = np.searchsorted(starts, (own[0].triangles[0], own[-1].triangles[1]))
        source = corners[corner_starts[low] : corner_starts[high]]
        groups = [(*(np.searchsorted(starts, part.triangles) - low).tolist(), part.material) for part in own]
        vertex_of = sequence.faces.reshape(-1)[source].astype(np.int64) - own[0].vertices[0]
        span = (own[0].triangles[0], own[-1].triangles[1])
        meshes.append(
            ExportMesh(own[0].name or name, own[0].parent, own[0].vertices, span, counts[low:high], vertex_of, source,
                       tuple(groups), first)
        )  # fmt: skip
        first = stop
    return meshes


def uncovered(sequence: MeshSequence, meshes: Sequence[ExportMesh]) -> int:
    """How many vertices belong to no mesh."""
    is_covered = np.zeros(sequence.n_vertices, bool)
    for mesh in meshes:
        is_covered[slice(*mesh.vertices)] = True
    return int((~is_covered).sum())


def export_layer(name: str, attribute: Attribute, mesh: ExportMesh) -> Layer:
    """An attribute on one mesh. Corner values that are used are kept once each; of a polygon's triangles the first counts.

    What a part has becomes that of its polygons.
    """
    own = np.arange(len(attribute.values)) if attribute.indices is None else attribute.indices
    if attribute.domain == "vertex":
        return Layer(name, attribute.kind, "vertex", attribute.values[own[slice(*mesh.vertices)]])
    if attribute.domain == "part":
        rows = np.zeros(len(mesh.counts), np.int64)
        for number, (start, stop, _) in enumerate(mesh.groups):
            rows[start:stop] = own[mesh.part + number]
        return Layer(name, attribute.kind, "polygon", attribute.values[rows])
    if attribute.domain == "triangle":
        first = mesh.triangles[0] + polygon_starts(mesh.counts.astype(np.int64))
        return Layer(name, attribute.kind, "polygon", attribute.values[own[first]])
    used, indices = np.unique(own[mesh.source], return_inverse=True)
    return Layer(name, attribute.kind, "corner", attribute.values[used], indices.reshape(-1).astype(np.int64))


def as_unit_range(values: Array) -> Array:
    """Colours as float32, integers of full range as 0..1."""
    if values.dtype.kind in "ui":
        return (values / np.float64(np.iinfo(values.dtype).max)).astype(np.float32)
    return np.asarray(values, np.float32)


def _is_same(a: Part, b: Part) -> bool:
    return (a.name, a.parent, a.vertices) == (b.name, b.parent, b.vertices)
