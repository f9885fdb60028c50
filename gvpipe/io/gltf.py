"""GLB and glTF frames (one still mesh per file), read and written by trimesh.

The meshes of a scene are joined in trimesh's traversal order, which depends on the file alone, each moved by its
node's transform. trimesh makes one mesh per primitive, so primitives that share a vertex buffer get a copy each: more
vertices than the file, but the same in every frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe.io.mesh import Attributes, Encoder, Mesh, as_color, as_faces, as_positions, concatenate
from gvpipe.sequence import Float32, Int32


class GltfLoader:
    """Loads the frames of one sequence; textures and materials are left alone after the first."""

    def __init__(self) -> None:
        self._is_first = True

    def __call__(self, path: Path) -> Mesh:
        """Load one file; after the first, without attributes.

        Raises:
            Exception: the file cannot be read; trimesh raises many kinds, and the caller names the file.
        """
        import trimesh

        # trimesh drops texture coordinates together with the materials, so the first file is read with both
        scene: Any = trimesh.load_scene(
            path, file_type=path.suffix[1:].lower(), process=False, skip_materials=not self._is_first
        )
        meshes = []
        for node in scene.graph.nodes_geometry:
            transform, name = scene.graph[node]
            geometry = scene.geometry[name]
            if isinstance(geometry, trimesh.Trimesh):
                meshes.append(_place(geometry, np.asarray(transform), self._is_first))
        if not meshes:
            raise ValueError("it has no triangle mesh in its scene")
        self._is_first = False
        return concatenate(meshes)


def _place(geometry: Any, transform: NDArray[np.float64], with_attributes: bool) -> Mesh:
    positions = np.asarray(geometry.vertices)
    faces = as_faces(np.asarray(geometry.faces), len(positions))
    linear = transform[:3, :3]
    if not np.array_equal(transform, np.eye(4)):  # float32 positions pass exactly where nothing moves them
        positions = positions @ linear.T + transform[:3, 3]
        if np.linalg.det(linear) < 0:
            faces = np.ascontiguousarray(faces[:, ::-1])  # glTF 2.0, 3.7.4: a mirroring node flips the winding
    return Mesh(as_positions(positions), faces, _attributes(geometry, linear) if with_attributes else {})


def _attributes(geometry: Any, linear: NDArray[np.float64]) -> Attributes:
    attributes: dict[str, NDArray[np.generic]] = {}
    visual = geometry.visual
    if getattr(visual, "uv", None) is not None:
        attributes["uv"] = np.asarray(visual.uv, np.float32)
    if "vertex_normals" in geometry._cache:  # from the file; otherwise trimesh would compute them
        normals = np.asarray(geometry.vertex_normals) @ np.linalg.pinv(linear)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        attributes["normal"] = (normals / np.where(length > 0, length, 1)).astype(np.float32)
    if visual.kind == "vertex":
        attributes["color"] = as_color(np.asarray(visual.vertex_colors))
    elif "color" in getattr(visual, "vertex_attributes", {}):  # beside a texture
        attributes["color"] = as_color(np.asarray(visual.vertex_attributes["color"]))
    return {name: values for name, values in attributes.items() if len(values) == len(geometry.vertices)}


def encode_glb(faces: Int32, attributes: Attributes, n_vertices: int) -> Encoder:
    """A writer of frames with these faces, texture coordinates and colours where there is one per vertex.

    glTF has no corner attributes: they would need vertices split along seams, and vertex order goes first.
    """
    from trimesh import Trimesh
    from trimesh.visual import TextureVisuals

    make_visual: Any = TextureVisuals
    uv, color = (
        values if values is not None and len(values) == n_vertices else None
        for values in (attributes.get("uv"), attributes.get("color"))
    )

    def encode(positions: Float32) -> bytes:
        mesh: Any = Trimesh(positions, faces, process=False, validate=False)
        if uv is not None:
            mesh.visual = make_visual(uv=uv)
            if color is not None:
                mesh.visual.vertex_attributes["color"] = color
        elif color is not None:
            mesh.visual.vertex_colors = color
        exported: bytes = mesh.export(file_type="glb")
        return exported

    return encode
