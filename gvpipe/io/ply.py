"""PLY frames: text or binary, read from the file's own columns (`gvpipe.io.ply_elements`), written as binary little-endian.

Vertex order is the file's. Attributes are per corner where the file has them per corner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.arrays import Array, Float32, Int32
from gvpipe.io.mesh import FrameEncoder, Mesh, as_color, as_faces, as_polygons, fan, indexed
from gvpipe.io.ply_elements import Columns, Lists, read_elements
from gvpipe.sequence import MeshSequence

UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
NORMAL_NAMES = ("nx", "ny", "nz")
INDEX_NAMES = ("vertex_indices", "vertex_index")
COLOR_NAMES = ("red", "green", "blue", "alpha")


def load_ply(path: Path) -> Mesh:
    """Load one file.

    Raises:
        OSError, ValueError: the file cannot be read; the caller names it.
    """
    elements = read_elements(path.read_bytes())
    for name in ("vertex", "face"):
        if not elements.get(name):
            raise ValueError(f"it has no element {name!r}")
    vertex, face = elements["vertex"], elements["face"]
    positions = _stack(vertex, tuple("xyz"))
    if positions is None:
        raise ValueError("its vertices lack x, y or z")
    polygons = _polygons(face)
    faces = as_faces(polygons.values[fan(polygons.lengths)], len(positions))
    return Mesh(positions, faces, _attributes(vertex, face, faces, len(positions)), polygons=as_polygons(polygons.lengths))


def _polygons(face: Columns) -> Lists:
    """The vertex indices of each face: the list with a usual name, or the only list that there is."""
    lists = {name: column for name, column in face.items() if isinstance(column, Lists)}
    usual = [lists[name] for name in INDEX_NAMES if name in lists]
    if not usual and len(lists) != 1:
        raise ValueError(f"its faces have no list {' or '.join(INDEX_NAMES)}")
    return usual[0] if usual else next(iter(lists.values()))


def _attributes(vertex: Columns, face: Columns, faces: Int32, n_vertices: int) -> dict[str, Any]:
    attributes: dict[str, Any] = {}
    for pair in UV_NAMES:
        uv = _stack(vertex, pair)
        if uv is not None:
            attributes["uv"] = uv.astype(np.float32)
    corners = face.get("texcoord")  # a list (u, v, u, v, u, v) per triangle
    if isinstance(corners, Lists) and (corners.lengths == 6).all() and len(corners.values) == faces.size * 2:
        table = corners.values.reshape(-1, 2).astype(np.float32)
        attributes["uv"] = indexed(table, np.arange(len(table)), faces, n_vertices, "uv")
    normal = _stack(vertex, NORMAL_NAMES)
    if normal is not None:
        attributes["normal"] = normal.astype(np.float32)
    for names in (COLOR_NAMES, COLOR_NAMES[:3]):
        color = _stack(vertex, names)
        if color is not None and "color" not in attributes:
            attributes["color"] = as_color(color)
    return attributes


def _stack(columns: Columns, names: Sequence[str]) -> Array | None:
    """Number properties side by side, ``(N, len(names))``; None unless all are there."""
    found = [columns.get(name) for name in names]
    numbers = [column for column in found if isinstance(column, np.ndarray)]
    return np.stack(numbers, axis=1) if len(numbers) == len(names) else None


def encode_ply(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames with texture coordinates and vertex colours (normals: see `encode_obj`).

    Coordinates are ``double`` where they count from an origin.
    """
    faces, origin, n_vertices = sequence.faces, sequence.origin, sequence.n_vertices
    attributes = {name: np.asarray(each) for name, each in sequence.attributes.items()}
    uv, color = attributes.get("uv"), attributes.get("color")
    vertex_fields: list[tuple[str, str]] = [(name, "<f8" if origin.any() else "<f4") for name in "xyz"]
    face_fields: list[tuple[Any, ...]] = [("n", "u1"), ("vertex_indices", "<i4", 3)]
    if uv is not None and len(uv) == n_vertices:
        vertex_fields += [("s", "<f4"), ("t", "<f4")]
    elif uv is not None:
        face_fields += [("n_texcoord", "u1"), ("texcoord", "<f4", 6)]
    if color is not None and len(color) == n_vertices:  # PLY has no usual place for corner colours
        vertex_fields += [(name, "u1") for name in COLOR_NAMES]

    vertices = np.zeros(n_vertices, vertex_fields)
    for names, values in ((("s", "t"), uv), (COLOR_NAMES, color)):
        if values is not None and len(values) == n_vertices:
            for i, name in enumerate(names):
                vertices[name] = values[:, i]
    polygons = np.zeros(len(faces), face_fields)
    polygons["n"], polygons["vertex_indices"] = 3, faces
    lists = ["property list uchar int vertex_indices"]
    if "texcoord" in (polygons.dtype.names or ()) and uv is not None:
        polygons["n_texcoord"], polygons["texcoord"] = 6, uv.reshape(-1, 6)
        lists.append("property list uchar float texcoord")

    kinds = {"<f4": "float", "<f8": "double", "u1": "uchar"}
    properties = [f"property {kinds[kind]} {name}" for name, kind in vertex_fields]
    header = "\n".join(
        [
            "ply",
            "format binary_little_endian 1.0",
            f"element vertex {n_vertices}",
            *properties,
            f"element face {len(faces)}",
            *lists,
            "end_header\n",
        ]
    ).encode("ascii")

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        for i, name in enumerate("xyz"):
            vertices[name] = positions[:, i] + origin[i] if origin.any() else positions[:, i]
        return header + vertices.tobytes() + polygons.tobytes()

    return FrameEncoder(encode)
