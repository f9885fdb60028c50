"""The layers of a scene's meshes, joined into attributes of the sequence.

A mesh that lacks a layer gets a stand-in: (0, 0) for texture coordinates, white for colours, the surface's own direction for
normals, 0 for anything else. Corners share a value exactly where they share it in the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gvpipe.asset.attribute import Attribute
from gvpipe.foundation.arrays import Array, Float64, Int64
from gvpipe.io.scene.mesh import Fans, Layer, SceneMesh
from gvpipe.mesh.unique_rows import row_ids


def join_layers(
    meshes: Sequence[SceneMesh], fans: Sequence[Fans], first_frame: Float64
) -> tuple[dict[str, Attribute], tuple[str, ...]]:
    """Return the attributes by name, and notes on layers that could not be joined.

    Args:
        meshes: in the order of the sequence's vertices.
        fans: of each mesh.
        first_frame: ``(V, 3)`` positions, for the normals of meshes that have none.
    """
    names = list(dict.fromkeys(layer.name for mesh in meshes for layer in mesh.layers))
    attributes: dict[str, Attribute] = {}
    left: list[str] = []
    for name in names:
        found = [next((layer for layer in mesh.layers if layer.name == name), None) for mesh in meshes]
        made = _join_layer(meshes, fans, found, first_frame)
        if made is None:
            left.append(name)
        else:
            attributes[name] = made
    note = (f"the meshes disagree on the type of {', '.join(left)}; they were left out",) if left else ()
    return attributes, note


def _join_layer(
    meshes: Sequence[SceneMesh], fans: Sequence[Fans], found: Sequence[Layer | None], first_frame: Float64
) -> Attribute | None:
    present = [layer for layer in found if layer is not None]
    kind = present[0].kind
    widths = {layer.values.shape[1] for layer in present}
    if len(widths) > 1 and kind != "color":
        return None
    domains = {layer.domain for layer in present} - {"constant"}
    domain = domains.pop() if len(domains) == 1 else "corner" if domains else "vertex"
    values: list[Array] = []
    indices: list[Int64] = []
    start = vertex = 0
    for mesh, made, layer in zip(meshes, fans, found, strict=True):
        span = first_frame[vertex : vertex + mesh.n_vertices]
        used = layer or _stand_in(kind, max(widths), present[0].values.dtype, mesh, made, span)
        rows = _rows(used, domain, mesh, made)
        pool, rows = _shared(used, rows) if domain == "corner" else (used.values, rows)
        values.append(_widen(pool, max(widths)))
        indices.append(rows + start)
        start += len(pool)
        vertex += mesh.n_vertices
    pool, rows = np.concatenate(values), np.concatenate(indices)
    plain = len(rows) == len(pool) and bool((rows == np.arange(len(rows))).all())
    if kind == "label" and pool.dtype.kind not in "iu":
        return None
    result = "triangle" if domain == "polygon" else domain
    return Attribute(pool, result, kind, None if plain else rows.astype(np.int32), name=present[0].name)


def _rows(layer: Layer, domain: str, mesh: SceneMesh, fans: Fans) -> Int64:
    """The value of each element of ``domain``: vertices, corners of triangles, or triangles."""
    own = np.arange(len(layer.values)) if layer.indices is None else layer.indices.astype(np.int64)
    if layer.domain == "constant":
        sizes = {"vertex": mesh.n_vertices, "corner": len(fans.corner_source), "polygon": len(fans.triangle_source)}
        return np.full(sizes[domain], own[0], np.int64)
    if layer.domain == "corner":
        return np.asarray(own[fans.corner_source])
    if layer.domain == "vertex":
        return np.asarray(own if domain == "vertex" else own[mesh.corners[fans.corner_source]])
    triangles = own[fans.triangle_source]
    return np.asarray(triangles if domain == "polygon" else np.repeat(triangles, 3))


def _shared(layer: Layer, rows: Int64) -> tuple[Array, Int64]:
    """Values of corners without indices of their own: equal ones become one."""
    if layer.indices is not None or layer.domain != "corner":
        return layer.values, rows
    bits = np.ascontiguousarray(layer.values)
    ids, first = row_ids(bits.view(np.int32) if bits.dtype == np.float32 else bits)
    order = np.argsort(first, kind="stable")  # values in the order of the file
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return layer.values[first[order]], np.asarray(rank[ids][rows])


def _stand_in(kind: str, width: int, dtype: np.dtype[Any], mesh: SceneMesh, fans: Fans, positions: Float64) -> Layer:
    if kind == "normal":
        faces = mesh.corners[fans.corner_source].reshape(-1, 3)
        return Layer("normal", kind, "vertex", vertex_normals(positions, faces))
    value = np.ones((1, width), np.float32) if kind == "color" else np.zeros((1, width), dtype)
    return Layer("", kind, "constant", value, np.zeros(1, np.int64))


def vertex_normals(positions: Float64, faces: Int64) -> Array:
    """``(V, 3) float32`` unit normals, the triangles' weighted by area; (0, 0, 1) where there is no triangle."""
    a, b, c = (positions[faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    flat = faces.reshape(-1)
    total = np.stack([np.bincount(flat, np.repeat(cross[:, k], 3), len(positions)) for k in range(3)], axis=1)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    unit = np.where(length > 0, total / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    return unit.astype(np.float32)


def _widen(values: Array, width: int) -> Array:
    """Colours without opacity get one of 1."""
    if values.shape[1] == width:
        return values
    result = np.ones((len(values), width), np.float32)
    result[:, : values.shape[1]] = values
    return result
