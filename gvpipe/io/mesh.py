"""One frame file as a mesh, what a format needs to write frames, and the few steps that several formats share to get there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gvpipe.asset.attribute import MAX_COMPONENTS, Attribute
from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import NO_METADATA, Metadata
from gvpipe.asset.part import Part
from gvpipe.asset.polygons import polygon_starts
from gvpipe.foundation.arrays import Array, Bool, Float32, Floats, Int32, Int64, Integers, UInt8
from gvpipe.model.sequence import MeshSequence


class FrameValues(NamedTuple):
    """Numbers that each frame file has: a field where they differ between files, an attribute where they do not.

    Args:
        values: ``(R,)`` or ``(R, C)``, of the file's own type.
        domain, kind, unit: as of `gvpipe.Attribute`. Values per corner become an attribute, the first file's.
    """

    values: Array
    domain: str = "vertex"
    kind: str = ""
    unit: str = ""

    @property
    def can_be_held(self) -> bool:
        """Whether an attribute or a field can have numbers of their type and as many components."""
        width = self.values.shape[1] if self.values.ndim == 2 else 1
        return self.values.ndim in (1, 2) and self.values.dtype.kind in "biuf" and 1 <= width <= MAX_COMPONENTS


def too_wide(names: Sequence[str]) -> tuple[str, ...]:
    """What is said of numbers that cannot be held."""
    return tuple(f"{name!r}, which are not numbers of 1 to {MAX_COMPONENTS} components" for name in names)


@dataclass(frozen=True)
class Mesh:
    """What one frame file holds. All but positions, faces and ``animated`` is needed of the first file alone.

    Args:
        positions: ``(V, 3)``, float32 or float64 as the file has them, model units, in the file's own order.
        faces: ``(T, 3) int32``.
        attributes: static arrays or `Attribute`, as in `MeshSequence`.
        notes: what the loader did that the user should know, a line each.
        polygons, parts, materials, images, metadata: as in `MeshSequence`.
        animated: numbers by name that may change from file to file; every file of a sequence has the same names. Each is
            computed when it is called for.
        not_carried: as in `MeshSequence`.
    """

    positions: Floats
    faces: Int32
    attributes: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    polygons: Int32 | None = None
    parts: tuple[Part, ...] = ()
    materials: tuple[Material, ...] = ()
    images: tuple[Image, ...] = ()
    metadata: Metadata = NO_METADATA
    animated: Mapping[str, Callable[[], FrameValues]] = field(default_factory=dict)
    not_carried: tuple[str, ...] = ()


Loader = Callable[[Path], Mesh]  # one per sequence: it may remember its first file to read the others faster


@dataclass(frozen=True)
class FrameEncoder:
    """How the frames of one sequence become files.

    Args:
        encode: positions ``(V, 3) float32`` relative to the sequence's origin, and the frame's fields ``(R, C)`` by name, to
            a whole file. The encoder adds the origin; it raises `InputError` if the format cannot hold the sums.
        fields: names of the fields that it wants; no others are read.
        notes: what the format cannot hold, a line each.
        beside: files that all frames share, such as pictures, by their names in the frames' folder.
        of_frame: what a frame has of its own, given its number and the number in its file's name: text before what ``encode``
            returns, and files in the frames' folder by their names. None: nothing.
    """

    encode: Callable[[Float32, Mapping[str, Array]], bytes]
    fields: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    beside: Mapping[str, bytes] = field(default_factory=dict)
    of_frame: Callable[[int, str], tuple[bytes, Mapping[str, bytes]]] | None = None


EncoderMaker = Callable[[MeshSequence, str], FrameEncoder]  # a sequence, and a name for files that all frames share


def fan(counts: Int64) -> Int64:
    """Cut polygons into triangles around their first corner.

    Args:
        counts: ``(N,)``, corners per polygon.

    Returns:
        ``(T, 3)`` indices into the polygons' corners, written one after the other; polygon order is kept.

    Raises:
        ValueError: a polygon with fewer than three corners.
    """
    small = np.flatnonzero(counts < 3)
    if len(small):
        raise ValueError(f"face {small[0] + 1} has {counts[small[0]]} corners, and at least 3 are needed")
    n_triangles = counts - 2
    first = np.repeat(np.cumsum(counts) - counts, n_triangles)
    step = np.arange(n_triangles.sum()) - np.repeat(polygon_starts(counts), n_triangles)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


def as_polygons(counts: Integers) -> Int32 | None:
    """Corners of each polygon ``(N,)`` as a mesh has them: None if all are triangles."""
    return counts.astype(np.int32) if (counts > 3).any() else None


def as_faces(values: Integers, n_vertices: int) -> Int32:
    """Narrow to ``(T, 3) int32``.

    Raises:
        ValueError: no face, or an index outside ``0..n_vertices - 1``.
    """
    if len(values) == 0:
        raise ValueError("it has no faces, and a triangle mesh is needed")
    out = np.flatnonzero(((values < 0) | (values >= n_vertices)).any(axis=1))
    if len(out):
        raise ValueError(f"triangle {out[0]} is {values[out[0]].tolist()}, but vertices are 0..{n_vertices - 1}")
    return np.ascontiguousarray(values, dtype=np.int32)


def as_color(values: NDArray[np.generic]) -> UInt8:
    """Colours ``(N, 3 or 4)``, either 0..255 or floats 0..1, as ``(N, 4) uint8`` RGBA."""
    scaled = values.astype(np.float64)
    if values.dtype.kind == "f" and not (scaled > 1).any():
        scaled *= 255
    rgba = np.full((len(values), 4), 255, np.uint8)
    rgba[:, : values.shape[1]] = np.clip(np.rint(np.nan_to_num(scaled)), 0, 255)
    return rgba


def as_normals(values: Array) -> Float32:
    """Normals ``(N, 3)``; those that are not finite, as programs write them for triangles without an area, become zeros."""
    normals = np.asarray(values, np.float32)
    is_finite: Bool = np.asarray(np.isfinite(normals).all(axis=1))
    return normals if is_finite.all() else np.where(is_finite[:, None], normals, np.float32(0))


def indexed(table: Float32, index: Int64, faces: Int32, n_vertices: int, kind: str) -> Attribute:
    """An attribute whose corners show rows of a table: per vertex where all corners of each vertex show one row.

    Args:
        table: ``(N, C)``; rows that no corner shows are left out.
        index: ``(3 T,)`` the row of each corner, -1 for none, which becomes zeros.
        faces: ``(T, 3)`` vertices of the corners.
        n_vertices: those that have no corner get zeros, too.
        kind: as of `Attribute`.
    """
    corners = faces.reshape(-1)
    rows = np.full(n_vertices, -1, np.int64)
    rows[corners] = index
    padded = np.concatenate([table, np.zeros((1, table.shape[1]), table.dtype)])
    if np.array_equal(rows[corners], index):
        return Attribute(padded[rows], "vertex", kind, name=kind)
    used, indices = np.unique(np.where(index < 0, len(table), index), return_inverse=True)
    return Attribute(padded[used], "corner", kind, indices.reshape(-1).astype(np.int32), name=kind)
