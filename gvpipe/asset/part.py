"""Parts: the named meshes of one scene, as ranges of vertices and triangles."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.asset.attribute import check_text
from gvpipe.foundation.arrays import Int32
from gvpipe.foundation.errors import InputError


@dataclass(frozen=True)
class Part:
    """A named mesh of the scene, or what of it has one material.

    A mesh with several materials is several parts of one name, which may share their vertices.

    Args:
        name: of the mesh.
        vertices: first vertex, and the one after the last.
        triangles: first triangle, and the one after the last.
        material: index into the sequence's materials, or None.
        parent: name of the node that it hangs on, ``""`` for none.
    """

    name: str
    vertices: tuple[int, int]
    triangles: tuple[int, int]
    material: int | None = None
    parent: str = ""


def check_parts(parts: Iterable[Any], faces: Int32, n_vertices: int, n_materials: int, where: str) -> tuple[Part, ...]:
    """Return the parts; raise `InputError` unless they hold all triangles in order, each on vertices of its part's range."""
    result = tuple(parts)
    end = 0
    for number, part in enumerate(result):
        if not isinstance(part, Part):
            raise TypeError(f"part {number} is a {type(part).__name__}; a gvpipe.Part is needed")
        for role in ("name", "parent"):
            check_text(getattr(part, role), f"{role} of part {number}")
        name = f"{where}: part {number} ({part.name!r})"
        first, stop = part.triangles
        if first != end or not first <= stop <= len(faces):
            raise InputError(f"{name} has triangles {first} to {stop}; they start at {end} and end by {len(faces)}")
        low, high = part.vertices
        if not 0 <= low <= high <= n_vertices:
            raise InputError(f"{name} has vertices {low} to {high}; there are {n_vertices}")
        if part.material is not None and not 0 <= part.material < n_materials:
            raise InputError(f"{name} has material {part.material}; there are {n_materials} materials")
        end = stop
    if result and end != len(faces):
        raise InputError(f"{where}: the parts end at triangle {end} of {len(faces)}; every triangle belongs to a part")
    _check_ranges(result, faces, where)
    return result


def _check_ranges(parts: tuple[Part, ...], faces: Int32, where: str) -> None:
    filled = [part for part in parts if part.triangles[1] > part.triangles[0]]
    if not filled:
        return
    starts = np.array([part.triangles[0] for part in filled])
    low, high = np.minimum.reduceat(faces.min(axis=1), starts), np.maximum.reduceat(faces.max(axis=1), starts)
    ranges = np.array([part.vertices for part in filled])
    bad = np.flatnonzero((low < ranges[:, 0]) | (high >= ranges[:, 1]))
    if len(bad):
        part = filled[bad[0]]
        raise InputError(
            f"{where}: part {part.name!r} has vertices {part.vertices[0]} to {part.vertices[1]}, but its triangles use "
            f"{low[bad[0]]} to {high[bad[0]]}"
        )
