"""The meshes of one frame file, joined to one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute, as_attribute
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Int32
from gvpipe.io.mesh import Mesh


def concatenate(meshes: Sequence[Mesh]) -> Mesh:
    """Join the meshes of one file in the order given.

    Parts follow each other; a mesh without parts stays without a part unless others have some, and then becomes one without
    a name. Materials, images, metadata and ``animated`` are those of the first mesh: all parts must count in its materials.
    An attribute that only some meshes have is zeros on the others, and white if it is a color.
    """
    if len(meshes) == 1:
        return meshes[0]
    sizes = np.array([(len(mesh.positions), len(mesh.faces)) for mesh in meshes], np.int64)
    starts = np.cumsum(sizes, axis=0) - sizes
    has_polygons = any(mesh.polygons is not None for mesh in meshes)
    has_parts = any(mesh.parts for mesh in meshes)
    counts = [np.full(len(mesh.faces), 3, np.int32) if mesh.polygons is None else mesh.polygons for mesh in meshes]
    names = dict.fromkeys(name for mesh in meshes for name in mesh.attributes)
    first = meshes[0]
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, (start, _) in zip(meshes, starts, strict=True)]).astype(np.int32),
        {name: _join(name, meshes) for name in names},
        tuple(dict.fromkeys(note for mesh in meshes for note in mesh.notes)),
        np.concatenate(counts) if has_polygons else None,
        tuple(part for mesh, start in zip(meshes, starts.tolist(), strict=True) for part in _moved(mesh, *start))
        if has_parts
        else (),
        first.materials,
        first.images,
        first.metadata,
    )


def _moved(mesh: Mesh, vertex: int, triangle: int) -> tuple[Part, ...]:
    """A mesh's parts, their ranges counted from a first vertex and a first triangle."""
    parts = mesh.parts or (Part("", (0, len(mesh.positions)), (0, len(mesh.faces))),)
    return tuple(
        Part(
            part.name,
            (part.vertices[0] + vertex, part.vertices[1] + vertex),
            (part.triangles[0] + triangle, part.triangles[1] + triangle),
            part.material,
            part.parent,
        )
        for part in parts
    )


def _join(name: str, meshes: Sequence[Mesh]) -> Attribute:
    """One attribute of several meshes; per corner where one of them has it so."""
    found = [_as_attribute(mesh, name) for mesh in meshes]
    given = [one for one in found if one is not None]
    width = max(one.shape[1] for one in given)
    kind, unit = given[0].kind, given[0].unit
    domains = {one.domain for one in given}
    domain = domains.pop() if len(domains) == 1 else "corner"
    dtype = np.result_type(*(one.dtype for one in given)) if all(one.dtype.kind in "iu" for one in given) else np.dtype("f4")
    values, indices, end = [], [], 0
    for mesh, one in zip(meshes, found, strict=True):
        if one is None:
            rows = {"vertex": len(mesh.positions), "corner": mesh.faces.size, "triangle": len(mesh.faces)}[domain]
            index, table = np.zeros(rows, np.int32), _fill(np.zeros((1, 0), dtype), width, kind, dtype)
        else:
            index = np.arange(len(one), dtype=np.int32) if one.indices is None else one.indices
            index = index if one.domain == domain else _to_corners(index, one.domain, mesh.faces)
            table = _fill(_scaled(one.values, kind, dtype), width, kind, dtype)
        values.append(table)
        indices.append(index + end)
        end += len(table)
    joined = np.concatenate(indices).astype(np.int32)
    own = len(joined) == end and bool((joined == np.arange(end)).all())
    return Attribute(np.concatenate(values), domain, kind, None if own else joined, unit)


def _as_attribute(mesh: Mesh, name: str) -> Attribute | None:
    given = mesh.attributes.get(name)
    if given is None:
        return None
    rows = {"vertex": len(mesh.positions), "corner": mesh.faces.size, "triangle": len(mesh.faces), "part": -1}
    return as_attribute(name, given, rows, "a mesh")


def _to_corners(index: Int32, domain: str, faces: Int32) -> Int32:
    """Values' indices of vertices or triangles as those of corners ``(3 T,)``."""
    result: Int32 = index[faces.reshape(-1)] if domain == "vertex" else np.repeat(index, 3) if domain == "triangle" else index
    return result


def _scaled(values: Array, kind: str, dtype: np.dtype[Any]) -> Array:
    """Values of another type; colours keep their part of full range."""
    if kind == "color" and values.dtype.kind in "iu" and dtype.kind == "f":
        return (values / np.iinfo(values.dtype).max).astype(dtype)
    return values.astype(dtype)


def _fill(values: Array, width: int, kind: str, dtype: np.dtype[Any]) -> Array:
    """Values ``(N, C)`` widened to ``(N, width)``: by zeros, or by white if they are colours."""
    full = (np.iinfo(dtype).max if dtype.kind in "iu" else 1) if kind == "color" else 0
    more = np.full((len(values), width - values.shape[1]), full, dtype)
    return np.concatenate([values, more], axis=1)
