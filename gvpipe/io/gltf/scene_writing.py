"""A sequence's scene in a GLB file: nodes, meshes, attributes and materials. Positions are added frame by frame.

glTF counts in metres, with Y up. Scenes of other units or axes are turned and scaled by their nodes, so that positions stay as
they are, to the bit. An origin becomes the nodes' translation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.arrays import Array, Float32, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.io.gltf.attribute_writing import GltfAttribute, as_gltf, name_attributes
from gvpipe.io.gltf.draco_writing import Fineness, add_primitive, fineness
from gvpipe.io.gltf.glb import INDICES, VERTICES, Glb
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.material_writing import write_materials
from gvpipe.io.gltf.nodes import compose
from gvpipe.io.gltf.normal_writing import NORMAL, SplitNormals, split_normals
from gvpipe.io.gltf.quantizing import EXTENSION, needs_extension, quantized, steps_of
from gvpipe.io.gltf.split import Shape, Split, in_drawing_order, split_vertices
from gvpipe.io.losses import lost_notes
from gvpipe.model.sequence import MeshSequence

HALF = float(np.sqrt(0.5))
TURNS = {"z": (-HALF, 0.0, 0.0, HALF), "x": (0.0, 0.0, HALF, HALF)}  # quaternions that take an up axis to Y


@dataclass(frozen=True, eq=False)
class Prepared:
    """What all frames share.

    Args:
        sequence: that is written.
        split: its vertices.
        attributes: as the file holds them, without normals that change from frame to frame.
        normals: of each frame; None if there are none, or if they are among the attributes.
        uv_sets: number of each attribute of texture coordinates.
        place: transform of the scene's nodes.
        notes: what is not held or was changed, a line each.
    """

    sequence: MeshSequence
    split: Split
    attributes: tuple[GltfAttribute, ...]
    normals: SplitNormals | None
    uv_sets: Mapping[str, int]
    place: Json
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Written:
    """A mesh in the file: numbers of its node and mesh, and the shape that it shows."""

    node: int
    mesh: int
    shape: Shape


def prepare(
    sequence: MeshSequence, fields: tuple[str, ...] = (), is_packed: bool = False, is_skinned: bool = False
) -> Prepared:
    """Split vertices and convert attributes.

    Args:
        sequence: that is written.
        fields: names of fields that are written, too.
        is_packed: the file is compressed; vertices and triangles then have another order.
        is_skinned: joints turn the normals of the first frame.
    """
    if not len(sequence.faces):
        raise InputError(f"{sequence.name} has no triangles; glTF needs one, so write .npz or .ply")
    split = in_drawing_order(split_vertices(sequence)) if is_packed else split_vertices(sequence)
    names = {name: held for name, held in name_attributes(sequence.attributes).items() if name in split.attributes}
    made = {name: as_gltf(names[name], sequence.attributes[name].kind, split.attributes[name]) for name in names}
    attributes = {name: one for name, one in made.items() if one is not None}
    place, turned = _place(sequence)
    normals = split_normals(sequence, split)
    held = ("parts", "materials", "metadata", "polygons", *attributes, *fields, *(("normal",) if normals else ()))
    cut = (f"glTF has triangles alone; {len(sequence.polygons)} polygons became fans",) if sequence.polygons is not None else ()
    n_free = len(split.sources) - len(np.unique(np.concatenate([np.arange(each.start, each.stop) for each in split.shapes])))
    free = (f"{n_free} vertices are of no part; left out",) if n_free else ()
    return Prepared(
        sequence,
        split,
        tuple(one for one in attributes.values() if normals is None or one.name != NORMAL),
        normals,
        {name: int(one.name.rpartition("_")[2]) for name, one in attributes.items() if one.name.startswith("TEXCOORD_")},
        place,
        (*turned, *cut, *free, *(normals.notes if normals and not is_skinned else ()), *lost_notes(sequence, "glTF", held)),
    )


def write_scene(
    glb: Glb,
    prepared: Prepared,
    positions: Array,
    more: tuple[GltfAttribute, ...] = (),
    is_skinned: bool = False,
    step: float = 0.0,
    is_morphed: bool = False,
) -> list[Written]:
    """Add the whole scene.

    Args:
        glb: the file.
        prepared: what all frames share.
        positions: ``(W, 3)`` of the split vertices; integers of a `Lattice`, or float32.
        more: attributes of this frame alone.
        is_skinned: joints place the meshes, whose nodes are then roots.
        step: how far off compressed positions may be; 0: not at all.
        is_morphed: meshes may get morph targets, which have the order of their vertices.
    """
    sequence = prepared.sequence
    numbers = write_materials(glb, sequence.materials, sequence.images, prepared.uv_sets)
    written: list[Written] = []
    roots: list[int] = []
    last_parent = ""
    attributes = tuple(map(quantized, (*prepared.attributes, *more))) if glb.is_packed else (*prepared.attributes, *more)
    if positions.dtype != np.float32 or (glb.is_packed and any(map(needs_extension, attributes))):
        glb.use(EXTENSION, is_required=True)
    fine = fineness(positions, step) if glb.is_draco else None
    vertices = _Vertices(positions, attributes, step, fine, is_morphed)
    for shape in prepared.split.shapes:
        mesh = _write_mesh(glb, shape, vertices.of(shape), numbers)
        node = glb.append("nodes", {"mesh": mesh} | ({"name": shape.name} if shape.name else {}))
        written.append(Written(node, mesh, shape))
        if is_skinned or not shape.parent:
            roots.append(node)
        elif shape.parent == last_parent:
            glb.tree["nodes"][roots[-1]]["children"].append(node)
        else:
            roots.append(glb.append("nodes", {"name": shape.parent, "children": [node]}))
        last_parent = shape.parent
    for node in () if is_skinned else roots:
        glb.tree["nodes"][node] |= prepared.place
    glb.append("scenes", {"nodes": roots})
    glb.tree["scene"] = 0
    rights = sequence.metadata.texts.get("copyright")
    glb.tree["asset"] |= {"copyright": rights} if rights else {}
    return written


class _Vertices(NamedTuple):
    """Vertices of meshes: ``positions (W, 3)``, attributes, and how they are compressed, see `write_scene`."""

    positions: Array
    attributes: tuple[GltfAttribute, ...]
    step: float
    fine: Fineness | None
    is_morphed: bool

    def of(self, shape: Shape) -> _Vertices:
        """Those of a mesh."""
        own = tuple(one.part(shape.start, shape.stop) for one in self.attributes)
        return self._replace(positions=self.positions[shape.start : shape.stop], attributes=own)


def _write_mesh(glb: Glb, shape: Shape, vertices: _Vertices, materials: list[int]) -> int:
    accessors: dict[str, int] = {}  # that primitives share
    primitives = []
    for faces, material in shape.primitives:
        item = _compressed(glb, vertices, faces)
        if item is None:
            accessors = accessors or _write_vertices(glb, vertices)
            small = len(vertices.positions) < 65536  # the largest number of a type is no vertex
            corners = faces.reshape(-1, 1).astype(np.uint16 if small else np.uint32)
            item = {"attributes": accessors, "indices": glb.array(corners, INDICES)}
        primitives.append(item | ({} if material is None else {"material": materials[material]}))
    return glb.append("meshes", {"primitives": primitives} | ({"name": shape.name} if shape.name else {}))


def _compressed(glb: Glb, vertices: _Vertices, faces: Int32) -> Json | None:
    if vertices.fine is None:
        return None
    return add_primitive(glb, vertices.positions, vertices.attributes, faces, vertices.fine, vertices.is_morphed)


def _write_vertices(glb: Glb, vertices: _Vertices) -> dict[str, int]:
    filtered = steps_of(vertices.positions, vertices.step) if vertices.step and glb.is_packed else None
    accessors = {"POSITION": glb.array(vertices.positions, VERTICES, bounds=True, filtered=filtered)}
    for one in vertices.attributes:
        accessors[one.name] = glb.array(one.values, VERTICES, normalized=one.normalized, filtered=one.filtered)
    return accessors


def normals_of(prepared: Prepared, number: int, positions: Float32) -> GltfAttribute | None:
    """The normals of a frame ``(V, 3)`` by its number; None if the sequence has none that change."""
    if prepared.normals is None:
        return None
    fields = prepared.sequence.fields
    own = {"normal": fields["normal"].read(number, number + 1)[0]} if prepared.normals.is_field else {}
    return prepared.normals.of(positions, own)


def world_matrix(metadata: Metadata) -> Float64:
    """``(3, 3)`` that takes positions of a scene, as columns, to metres and Y up."""
    turn = np.array(TURNS.get(metadata.up_axis, (0, 0, 0, 1.0)))
    return compose(np.zeros(3), turn, np.full(3, metadata.metres_per_unit or 1.0))[:3, :3]


def _place(sequence: MeshSequence) -> tuple[Json, tuple[str, ...]]:
    """The transform of the scene's nodes to metres and Y up, and a note if it changes anything."""
    metadata, origin = sequence.metadata, sequence.origin
    turn = TURNS.get(metadata.up_axis)
    scale = metadata.metres_per_unit or 1.0
    place: Json = {}
    place |= {"translation": (world_matrix(metadata) @ origin).tolist()} if origin.any() else {}
    place |= {"rotation": list(turn)} if turn else {}
    place |= {"scale": [scale] * 3} if scale != 1 else {}
    steps = [f"turned from {metadata.up_axis.upper()} up" if turn else "", f"scaled by {scale:g}" if scale != 1 else ""]
    done = " and ".join(step for step in steps if step)
    return place, (f"glTF is in metres with Y up; the scene's nodes are {done}",) if done else ()


def frame_attributes(prepared: Prepared, fields: Mapping[str, Array]) -> tuple[GltfAttribute, ...]:
    """A frame's fields ``(V, C)`` as attributes of its file; normals are not among them."""
    named = {name: values for name, values in fields.items() if name != "normal" or prepared.normals is None}
    made = (as_gltf(f"_{name}", "scalar", values[prepared.split.sources]) for name, values in named.items())
    return tuple(one for one in made if one is not None)
