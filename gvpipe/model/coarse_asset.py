"""What of an asset a coarser level of detail keeps: it has some of the mesh's points, and triangles of its own.

Vertices that move together are one point for a codec (`gvpipe.trajectory.welding`). Numbers per vertex survive where those of a
point have the same. Numbers per corner or triangle and polygons belong to triangles that are gone. Parts survive unless
vertices of two meshes are one point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from gvpipe.asset.material import with_uv
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.foundation.notes import coarser_level
from gvpipe.model.sequence import MeshSequence


def add_asset(level: MeshSequence, whole: MeshSequence, points: Int32, kept: Int32, lod: int) -> MeshSequence:
    """Return the level with what it keeps of the whole mesh's asset, and a note of what it does not.

    Args:
        level: positions and triangles of the level; its vertex i is point ``kept[i]``.
        whole: level 0.
        points: ``(V,)`` the point of each of its vertices.
        kept: ``(n,)`` points, ascending.
        lod: number of the level, for the note.
    """
    lost: list[str] = []
    parted = _parted(whole, level.faces, points, kept)
    lost += ["parts"] if parted is None and whole.parts else []
    order, faces, parts = parted or _Parted(np.arange(len(kept)), level.faces, ())
    first = np.unique(points, return_index=True)[1]  # a vertex of each point
    vertices = first[kept[order]]
    shown = np.flatnonzero(np.isin(points, kept))
    twins = first[points[shown]]
    static = {name: np.asarray(each) for name, each in whole.attributes.items() if each.domain == "vertex"}
    moving = {name: each.read(0, 1)[0] for name, each in whole.fields.items() if each.domain == "vertex"}
    agree = [name for name, values in (static | moving).items() if np.array_equal(values[shown], values[twins])]
    rows: dict[str, Int64 | None] = dict.fromkeys(agree, vertices)
    rows |= {name: None for name, each in whole.attributes.items() if each.domain == "part" and parts}
    attributes, fields = _selected(whole.attributes, rows), _selected(whole.fields, rows)
    lost = [*(name for name in (*whole.attributes, *whole.fields) if name not in rows), *lost]
    lost += ["polygons"] if whole.polygons is not None else []
    given = whole.materials if parts else ()
    materials = with_uv(given, attributes)
    lost += ["textures"] if materials != given else []
    return replace(
        level.reordered(order, faces),
        attributes=attributes,
        fields=fields,
        parts=parts,
        materials=materials,
        images=whole.images if any(material.textures for material in materials) else (),
        metadata=whole.metadata,
        sound=whole.sound,
        notes=(*whole.notes, *coarser_level(lod, lost)),
    )


class _Parted(NamedTuple):
    """A level whose vertices and triangles are those of one part after the other.

    Args:
        order: ``(n,)`` vertices of the level.
        faces: ``(t, 3)`` its triangles, in the new order of vertices.
        parts: its parts.
    """

    order: Int64
    faces: Int32
    parts: tuple[Part, ...]


def _parted(whole: MeshSequence, faces: Int32, points: Int32, kept: Int32) -> _Parted | None:
    """The level by parts; None if there are none, or if meshes share a point. Parts of one mesh are one material each."""
    parts = whole.parts
    if not parts:
        return None
    meshes = np.cumsum([0] + [_mesh(a) != _mesh(b) for a, b in pairwise(parts)])
    part_of = np.repeat(np.arange(len(parts)), [stop - start for start, stop in (part.triangles for part in parts)])
    corners = points[whole.faces].reshape(-1)
    lowest, highest = np.full(int(points.max()) + 1, len(parts)), np.full(int(points.max()) + 1, -1)
    np.minimum.at(lowest, corners, np.repeat(part_of, 3))
    np.maximum.at(highest, corners, np.repeat(part_of, 3))
    low, high = lowest[kept], highest[kept]
    is_used = high >= 0
    mesh = np.full(len(kept), int(meshes[-1]) + 1)  # points without a triangle come last
    mesh[is_used] = meshes[low[is_used]]
    if (meshes[high[is_used]] != mesh[is_used]).any() or np.ptp(mesh[faces], axis=1).any():
        return None
    order = np.argsort(mesh, kind="stable")
    ranks = np.empty(len(order), np.int32)
    ranks[order] = np.arange(len(order))
    triangle_parts = low[faces].max(axis=1)  # a point at the border of two materials counts to the first of them
    sorting = np.argsort(triangle_parts, kind="stable")
    spans = np.searchsorted(mesh[order], np.arange(int(meshes[-1]) + 2))
    ends = np.searchsorted(triangle_parts[sorting], np.arange(len(parts) + 1))
    made = (
        replace(part, vertices=(int(spans[own]), int(spans[own + 1])), triangles=(int(ends[number]), int(ends[number + 1])))
        for number, (part, own) in enumerate(zip(parts, meshes.tolist(), strict=True))
    )
    return _Parted(order, ranks[faces[sorting]], tuple(made))


def _mesh(part: Part) -> tuple[str, str, tuple[int, int]]:
    return part.name, part.parent, part.vertices


def _selected(named: Mapping[str, Any], rows: Mapping[str, Int64 | None]) -> dict[str, Any]:
    """Attributes or fields with the rows that are left; None: all."""
    chosen = ((name, each, rows[name]) for name, each in named.items() if name in rows)
    return {name: each if own is None else each.select(own) for name, each, own in chosen}
