"""PLY frames: read by trimesh, written plainly (binary, little-endian).

trimesh 5.2 keeps PLY order if it is told not to split vertices along texture seams (`fix_texture=False`). It accepts
text files that end early, so lengths are checked here, and its attributes come from the raw columns: per corner where
the file has them per corner. Binary files that mix triangles with larger polygons are beyond it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe import notes
from gvpipe.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.io.mesh import Attributes, Encoder, Mesh, as_color, as_faces, per_vertex

UV_NAMES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
NORMAL_NAMES = ("nx", "ny", "nz")
INDEX_NAMES = ("vertex_indices", "vertex_index")
COLOR_NAMES = ("red", "green", "blue", "alpha")


def load_ply(path: Path) -> Mesh:
    """Load one file.

    Raises:
        Exception: the file cannot be read; trimesh raises many kinds, and the caller names the file.
    """
    import trimesh

    loaded: Any = trimesh.load_mesh(
        path, file_type="ply", process=False, maintain_order=True, fix_texture=False, skip_materials=True
    )
    elements = loaded.metadata.get("_ply_raw", {})
    for name in ("vertex", "face"):
        element = elements.get(name, {"length": 0})
        if element["length"] == 0:
            raise ValueError(f"it has no element {name!r}")
        if any(len(column) != element["length"] for column in _columns(element).values()):
            raise ValueError(f"it announces {element['length']} of element {name!r} but ends before the last")
    positions, faces = np.asarray(loaded.vertices), as_faces(loaded.faces, len(loaded.vertices))
    if len(positions) != elements["vertex"]["length"]:
        raise ValueError("trimesh changed its number of vertices")
    counts = _corner_counts(_columns(elements["face"]), len(faces))
    return Mesh(
        positions, faces, _attributes(_columns(elements["vertex"]), _columns(elements["face"]), faces), notes.cut(counts)
    )


def _corner_counts(face: dict[str, Any], n_triangles: int) -> Int64:
    """Corners of each face ``(N,)``; all triangles if its list of vertices has an unusual name."""
    name = next((name for name in INDEX_NAMES if name in face), None)
    if name is None:
        return np.full(n_triangles, 3)
    column = face[name]["f1"] if face[name].dtype.names else face[name]
    if column.dtype == object:
        return np.fromiter(map(len, column), np.int64, len(column))
    return np.full(len(column), column.reshape(len(column), -1).shape[1])


def _columns(element: dict[str, Any]) -> dict[str, Any]:
    """An element's properties by name; trimesh holds text as a dict and binary data as a structured array."""
    data = element.get("data")
    if data is None:
        raise ValueError("an element has no data")
    return dict(data) if isinstance(data, dict) else {name: data[name] for name in data.dtype.names}


def _attributes(vertex: dict[str, Any], face: dict[str, Any], faces: Int32) -> dict[str, NDArray[np.generic]]:
    n_vertices = len(next(iter(vertex.values())))
    attributes: dict[str, NDArray[np.generic]] = {}
    for names in UV_NAMES:
        if all(name in vertex for name in names):
            attributes["uv"] = _stack(vertex, names).astype(np.float32)
    if "texcoord" in face:  # a list (u, v, u, v, u, v) per triangle
        corners = face["texcoord"]
        corners = corners["f1"] if corners.dtype.names else corners
        if corners.dtype != object and corners.size == faces.size * 2:
            found = per_vertex(corners.reshape(-1, 2).astype(np.float32), faces, n_vertices)
            attributes |= {} if found is None else {"uv": found}
    if all(name in vertex for name in NORMAL_NAMES):
        attributes["normal"] = _stack(vertex, NORMAL_NAMES).astype(np.float32)
    if all(name in vertex for name in COLOR_NAMES[:3]):
        attributes["color"] = as_color(_stack(vertex, tuple(name for name in COLOR_NAMES if name in vertex)))
    return attributes


def _stack(columns: dict[str, Any], names: tuple[str, ...]) -> Array:
    return np.stack([np.asarray(columns[name]).reshape(-1) for name in names], axis=1)


def encode_ply(faces: Int32, attributes: Attributes, n_vertices: int, origin: Float64) -> Encoder:
    """A writer of frames with these faces, texture coordinates and vertex colours (normals: see `encode_obj`).

    Coordinates are ``double`` where they count from an origin.
    """
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

    def encode(positions: Float32) -> bytes:
        for i, name in enumerate("xyz"):
            vertices[name] = positions[:, i] + origin[i] if origin.any() else positions[:, i]
        return header + vertices.tobytes() + polygons.tobytes()

    return encode
