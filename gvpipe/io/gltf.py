"""GLB and glTF frames (one still mesh per file), read and written by trimesh.

The meshes of a scene are joined in trimesh's traversal order, which depends on the file alone, each moved by its
node's transform. trimesh makes one mesh per primitive, so primitives that share a vertex buffer get a copy each. That is
more vertices than the file has, but the same in every frame.

trimesh leaves out animations, skins and morph targets without a word, so files that need them are refused here. Every skin
is: its still pose is the joints', and to find out whether that equals the bind pose is to apply the skin. Morph targets
whose weights are 0 move nothing, so a file of them without animations passes.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gvpipe import notes
from gvpipe.arrays import Array, Float32, Float64
from gvpipe.errors import InputError
from gvpipe.io.concatenate import concatenate
from gvpipe.io.mesh import FrameEncoder, Mesh, as_color, as_faces
from gvpipe.sequence import MeshSequence

Attributes = Mapping[str, NDArray[np.generic]]
MAGIC = b"glTF"
TRIANGLES = 4  # glTF's mode of primitives; above it strips and fans, below it points and lines
GLB_HEAD = struct.Struct("<4sIIII")  # magic, version, bytes of the file, bytes and type of the first chunk


class GltfLoader:
    """Loads the frames of one sequence; textures and materials are left alone after the first."""

    def __init__(self) -> None:
        self._is_first = True

    def __call__(self, path: Path) -> Mesh:
        """Load one file, binary or text by its first bytes, whatever its name; after the first, without attributes.

        Raises:
            InputError: the file moves, or its pose needs what is not imported.
            Exception: the file cannot be read; trimesh raises many kinds, and the caller names the file.
        """
        import trimesh

        data = path.read_bytes()
        gltf = _parse_json(data)
        _check_still(gltf, path)
        # trimesh drops texture coordinates together with the materials, so the first file is read with both
        scene: Any = trimesh.load_scene(
            path, file_type="glb" if data.startswith(MAGIC) else "gltf", process=False, skip_materials=not self._is_first
        )
        with_normals = _has_normals(gltf)
        meshes, n_others = [], 0
        for node in scene.graph.nodes_geometry:
            transform, name = scene.graph[node]
            geometry = scene.geometry[name]
            if isinstance(geometry, trimesh.Trimesh):
                attributes = _attributes(geometry, np.asarray(transform), with_normals) if self._is_first else {}
                meshes.append(_place(geometry, np.asarray(transform), attributes))
            else:
                n_others += 1
        if not meshes:
            raise ValueError("it has no triangle mesh in its scene")
        self._is_first = False
        return replace(concatenate(meshes), notes=notes.left_out(n_others))


def _parse_json(data: bytes) -> dict[str, Any]:
    """The JSON part of a binary or text file; raises `ValueError` if there is none."""
    if data.startswith(MAGIC):
        *_, length, _ = GLB_HEAD.unpack(data[: GLB_HEAD.size].ljust(GLB_HEAD.size, b"\0"))
        data = data[GLB_HEAD.size : GLB_HEAD.size + length]
    parsed = json.loads(data)
    if not isinstance(parsed, dict):
        raise ValueError("its JSON is not an object")
    return parsed


def _check_still(gltf: dict[str, Any], path: Path) -> None:
    """Raise `InputError` unless the meshes as stored are what the file shows, at all times."""
    nodes, meshes = gltf.get("nodes", []), gltf.get("meshes", [])
    weights = [node.get("weights", meshes[node["mesh"]].get("weights", [])) for node in nodes if "mesh" in node]
    n_animations = len(gltf.get("animations", []))
    if n_animations:
        found = f"holds {n_animations} animation{'s' * (n_animations > 1)}"
    elif any("skin" in node for node in nodes):
        found = "holds a skinned mesh"
    elif any(any(own) for own in weights):
        found = "is posed by morph targets"
    else:
        return
    raise InputError(f"{path} {found}, which gvpipe does not import yet; export its frames as still files, one file per frame")


def _has_normals(gltf: dict[str, Any]) -> bool:
    """Whether every triangle mesh of the file brings its normals; trimesh would compute those that are missing."""
    used = {node["mesh"] for node in gltf.get("nodes", []) if "mesh" in node}
    primitives = [primitive for i in used for primitive in gltf["meshes"][i]["primitives"]]
    return all("NORMAL" in one["attributes"] for one in primitives if one.get("mode", TRIANGLES) >= TRIANGLES)


def _place(geometry: Any, transform: Float64, attributes: Attributes) -> Mesh:
    """A mesh moved by its node's ``transform (4, 4)``."""
    positions = np.asarray(geometry.vertices)
    faces = as_faces(np.asarray(geometry.faces), len(positions))
    linear = transform[:3, :3]
    if not np.array_equal(transform, np.eye(4)):  # float32 positions pass exactly where nothing moves them
        with np.errstate(invalid="ignore"):  # infinite positions are refused later
            positions = positions @ linear.T + transform[:3, 3]
        if np.linalg.det(linear) < 0:
            faces = np.ascontiguousarray(faces[:, ::-1])  # glTF 2.0, 3.7.4: a mirroring node flips the winding
    return Mesh(positions, faces, attributes)


def _attributes(geometry: Any, transform: Float64, with_normals: bool) -> Attributes:
    """Texture coordinates, normals and colours, one per vertex; normals are turned by ``transform (4, 4)``."""
    attributes: dict[str, NDArray[np.generic]] = {}
    visual = geometry.visual
    if getattr(visual, "uv", None) is not None:
        attributes["uv"] = np.asarray(visual.uv, np.float32)
    if with_normals:
        normals = np.asarray(geometry.vertex_normals) @ np.linalg.pinv(transform[:3, :3])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        attributes["normal"] = (normals / np.where(length > 0, length, 1)).astype(np.float32)
    if visual.kind == "vertex":
        attributes["color"] = as_color(np.asarray(visual.vertex_colors))
    elif "color" in getattr(visual, "vertex_attributes", {}):  # beside a texture
        attributes["color"] = as_color(np.asarray(visual.vertex_attributes["color"]))
    return {name: values for name, values in attributes.items() if len(values) == len(geometry.vertices)}


def encode_glb(sequence: MeshSequence, shared: str) -> FrameEncoder:
    """An encoder of frames with texture coordinates and colours where there is one per vertex.

    glTF has no corner attributes: they would need vertices split along seams, and vertex order goes first. Its positions are
    float32, so an origin becomes the node's translation.
    """
    from trimesh import Scene, Trimesh
    from trimesh.visual import TextureVisuals

    make_visual: Any = TextureVisuals
    uv, color = (
        np.asarray(each) if each is not None and each.domain == "vertex" else None
        for each in (sequence.attributes.get("uv"), sequence.attributes.get("color"))
    )
    faces, origin = sequence.faces, sequence.origin

    place = np.eye(4)
    place[:3, 3] = origin

    def encode(positions: Float32, fields: Mapping[str, Array]) -> bytes:
        mesh: Any = Trimesh(positions, faces, process=False, validate=False)
        if uv is not None:
            mesh.visual = make_visual(uv=uv)
            if color is not None:
                mesh.visual.vertex_attributes["color"] = color
        elif color is not None:
            mesh.visual.vertex_colors = color
        scene: Any = mesh
        if origin.any():
            scene = Scene()
            scene.add_geometry(mesh, transform=place)
        exported: bytes = scene.export(file_type="glb")
        return exported

    return FrameEncoder(encode)
