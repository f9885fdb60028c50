"""One frame file as a mesh, and the few steps that several formats share to get there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Float32, Floats, Int32, Int64, Integers, UInt8

ATTRIBUTES = {"uv": (2,), "normal": (3,), "color": (3, 4)}  # name: columns that are understood

Attributes = Mapping[str, NDArray[np.generic]]


@dataclass(frozen=True)
class Mesh:
    """What one frame file holds.

    Args:
        positions: ``(V, 3)``, float32 or float64 as the file has them, model units, in the file's own order.
        faces: ``(T, 3) int32``.
        attributes: static arrays, as in `MeshSequence`.
        notes: what the loader did that the user should know, a line each; of the first file alone.
    """

    positions: Floats
    faces: Int32
    attributes: Attributes = field(default_factory=dict)
    notes: tuple[str, ...] = ()


Loader = Callable[[Path], Mesh]  # one per sequence: it may remember its first file to read the others faster
Encoder = Callable[[Float32], bytes]  # positions (V, 3), relative to the origin that it was made for -> a whole file


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
    step = np.arange(n_triangles.sum()) - np.repeat(np.cumsum(n_triangles) - n_triangles, n_triangles)
    return np.stack([first, first + step + 1, first + step + 2], axis=1)


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


def per_vertex(corner_values: NDArray[np.generic], faces: Int32, n_vertices: int) -> NDArray[np.generic] | None:
    """Corner values ``(3 T, k)`` as ``(V, k)`` if all corners of each vertex agree, else unchanged.

    None if they differ and ``3 T = V``: `MeshSequence` could not tell corners from vertices by their number.
    """
    corners = faces.reshape(-1)
    values = np.zeros((n_vertices, corner_values.shape[1]), corner_values.dtype)
    values[corners] = corner_values
    if np.array_equal(values[corners], corner_values):
        return values
    return corner_values if len(corners) != n_vertices else None


def concatenate(meshes: Sequence[Mesh]) -> Mesh:
    """Join the meshes of one file in the order given; an attribute is kept if all of them have it per vertex."""
    if len(meshes) == 1:
        return meshes[0]
    first = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    shared = [name for name in ATTRIBUTES if all(len(mesh.attributes.get(name, ())) == len(mesh.positions) for mesh in meshes)]
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, first, strict=True)]).astype(np.int32),
        {name: np.concatenate([mesh.attributes[name] for mesh in meshes]) for name in shared},
    )
