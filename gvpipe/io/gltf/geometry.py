"""Meshes of a file: their primitives as triangles, and the vertices that those share.

Primitives of one mesh that name the same accessors share one block of vertices; others have a block each. So a mesh of several
materials keeps its vertices as they are.

Source: Khronos, glTF 2.0 specification, section 3.7.2 (meshes); KHR_draco_mesh_compression; KHR_mesh_quantization.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64, Int32, Int64
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.attribute_names import ANY, FLOATS, KINDS, MEANT, SET, STORED, Read, own_name
from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.json_fields import Json, child, extension, index, integer, objects, text

DRACO = "KHR_draco_mesh_compression"
TRIANGLES, STRIP, FAN = 4, 5, 6  # modes of primitives; below are points and lines


@dataclass(frozen=True, eq=False)
class Morph:
    """What a morph target of weight 1 adds.

    Args:
        vertices: ``(n,)`` those that it moves, None: all.
        positions: ``(n, 3)``.
        turned: ``(m,)`` vertices whose normals it turns, None: all.
        normals: ``(m, 3)`` or None.
    """

    vertices: Int64 | None
    positions: Float32
    turned: Int64 | None
    normals: Float32 | None


@dataclass(frozen=True, eq=False)
class Block:
    """Vertices that some primitives of a mesh share, V of them, in the mesh's own space.

    Args:
        positions: ``(V, 3)``.
        attributes: arrays ``(V, C)`` by gvpipe's names; uv has its origin at the lower left.
        joints: ``(V, K)`` indices into the skin's joints, None without a skin.
        weights: ``(V, K)`` of the joints, of sum 1.
        morphs: the morph targets.
    """

    positions: Float32
    attributes: dict[str, Array]
    joints: Int64 | None
    weights: Float64 | None
    morphs: tuple[Morph, ...]


@dataclass(frozen=True, eq=False)
class Primitive:
    """Triangles of one material.

    Args:
        block: number of the mesh's block of vertices.
        triangles: ``(T, 3)`` vertices of the block.
        material: index into the file's materials, or None.
    """

    block: int
    triangles: Int32
    material: int | None


@dataclass(frozen=True, eq=False)
class GltfMesh:
    """A mesh.

    Args:
        name: ``""`` for none.
        blocks: of vertices.
        primitives: of triangles.
        weights: ``(M,)`` of the morph targets at rest.
    """

    name: str
    blocks: tuple[Block, ...]
    primitives: tuple[Primitive, ...]
    weights: Float64


def read_mesh(accessors: Accessors, number: int, moving_alone: bool) -> GltfMesh:
    """Read a mesh; raises `ValueError`.

    Args:
        accessors: of the file.
        number: of the mesh.
        moving_alone: leave out texture coordinates and tangents.
    """
    mesh, name = accessors.document.item("meshes", number)
    n_materials = len(accessors.document.items("materials"))
    keys: list[str] = []
    blocks: list[Block] = []
    primitives: list[Primitive] = []
    for i, primitive in enumerate(objects(mesh, "primitives", name)):
        where = f"{name}, primitive {i}"
        mode = integer(primitive, "mode", where, TRIANGLES, 0, FAN)
        if mode < TRIANGLES:
            continue
        if "POSITION" not in child(primitive, "attributes", where):
            continue  # nothing to draw, as the specification allows
        draco = extension(primitive, DRACO, where)
        read, faces = _sources(accessors, primitive, draco, where)
        key = repr([primitive["attributes"], primitive.get("targets"), i if draco else None])
        if key not in keys:
            keys.append(key)
            blocks.append(_read_block(accessors, read, primitive, where, moving_alone))
        at = keys.index(key)
        triangles = as_triangles(faces, mode, len(blocks[at].positions), where)
        primitives.append(Primitive(at, triangles, index(primitive, "material", where, n_materials)))
    n_morphs = max((len(block.morphs) for block in blocks), default=0)
    return GltfMesh(text(mesh, "name"), tuple(blocks), tuple(primitives), read_weights(mesh, n_morphs, name))


def read_weights(owner: Json, count: int, where: str) -> Float64:
    """Weights ``(count,)`` of morph targets that a mesh or a node gives; 0 where it gives none."""
    given = owner.get("weights", [])
    if not isinstance(given, list) or not all(isinstance(value, int | float) and abs(value) <= 1e9 for value in given):
        raise ValueError(f"{where}: 'weights' is not a list of numbers")
    weights = np.zeros(count)
    weights[: len(given)] = given[:count]
    return weights


def as_triangles(corners: Int64 | None, mode: int, n_vertices: int, where: str) -> Int32:
    """Triangles ``(T, 3)`` of a primitive; ``corners (n,)`` None: all vertices in order."""
    if corners is None:
        corners = np.arange(n_vertices)
    elif len(corners) and corners.max() >= n_vertices:
        raise ValueError(f"{where} uses vertex {corners.max()}, but has {n_vertices}")
    n = len(corners)
    if mode == TRIANGLES:
        faces = corners[: n - n % 3].reshape(-1, 3)
    else:
        i = np.arange(max(0, n - 2))
        odd = i % 2
        faces = np.stack([i, i + 1 + odd, i + 2 - odd] if mode == STRIP else [np.zeros_like(i), i + 1, i + 2], axis=1)
        faces = corners[faces]
    return faces.astype(np.int32)


def _sources(accessors: Accessors, primitive: Json, draco: Json, where: str) -> tuple[Read, Int64 | None]:
    """How attributes are read, and the corners of the triangles: from accessors, or from Draco's bytes."""
    names = child(primitive, "attributes", where)

    def read(name: str, kinds: tuple[str, ...], form: str) -> Array:
        number = integer(names, name, where)
        label = f"{where}, {name}"
        as_floats = form == FLOATS or (form == MEANT and accessors.is_normalized(number))
        return (accessors.read_floats if as_floats else accessors.read)(number, kinds, label)

    if draco:
        from gvpipe.io.gltf.draco import decode_primitive

        return decode_primitive(accessors, draco, names, read, where)
    number = index(primitive, "indices", where, len(accessors.document.items("accessors")))
    if number is None:
        return read, None
    corners = accessors.read(number, ("SCALAR",), f"{where}, indices")[:, 0]
    if corners.dtype.kind != "u":
        raise ValueError(f"{where}, indices are of type {corners.dtype}; unsigned integers are needed")
    return read, corners.astype(np.int64)


def _read_block(accessors: Accessors, read: Read, primitive: Json, where: str, moving_alone: bool) -> Block:
    names = child(primitive, "attributes", where)
    positions = read("POSITION", KINDS["POSITION"], FLOATS)
    arrays: dict[str, Array] = {}
    for name in names:
        base = name.rpartition("_")[0] if SET.fullmatch(name) else name
        if name == "POSITION" or (moving_alone and base in ("TEXCOORD", "TANGENT")):
            continue
        if base in KINDS:
            arrays[name] = read(name, KINDS[base], STORED if base == "COLOR" else FLOATS)
        elif base in ("JOINTS", "WEIGHTS"):
            arrays[name] = read(name, ("VEC4",), FLOATS if base == "WEIGHTS" else STORED)
        elif name.startswith("_") and not is_matrix(accessors.document, names.get(name)):
            arrays[name] = read(name, ANY, MEANT)
    short = next((name for name, values in arrays.items() if len(values) != len(positions)), None)
    if short:
        raise ValueError(f"{where} has {len(positions)} positions, but {len(arrays[short])} values of {short}")
    joints, weights = _influences(arrays, where)
    morphs = tuple(
        _read_morph(accessors, target, len(positions), f"{where}, morph target {i}")
        for i, target in enumerate(objects(primitive, "targets", where))
    )
    attributes = {own: _as_own(own, values) for name, values in arrays.items() if (own := own_name(name))}
    return Block(positions, attributes, joints, weights, morphs)


def is_matrix(document: Document, number: object) -> bool:
    """Whether an accessor is of matrices, which attributes do not hold."""
    items = document.items("accessors")
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < len(items):
        return False
    return text(items[number], "type").startswith("MAT")


def _as_own(name: str, values: Array) -> Array:
    """Texture coordinates count from the lower left."""
    if name.startswith("uv") and values.shape[1] == 2 and values.dtype == np.float32:
        return np.stack([values[:, 0], 1 - values[:, 1]], axis=1)
    return values


def _influences(arrays: dict[str, Array], where: str) -> tuple[Int64 | None, Float64 | None]:
    """Joints and weights of all sets together: ``(V, 4 sets)``."""
    sets = sorted(int(name.rpartition("_")[2]) for name in arrays if name.startswith("JOINTS_"))
    joints = [arrays[f"JOINTS_{i}"] for i in sets if f"WEIGHTS_{i}" in arrays]
    if not joints:
        return None, None
    if any(each.dtype.kind != "u" for each in joints):
        raise ValueError(f"{where} has joints that are no unsigned integers")
    weights = np.concatenate([arrays[f"WEIGHTS_{i}"] for i in sets if f"WEIGHTS_{i}" in arrays], axis=1).astype(np.float64)
    if not np.isfinite(weights).all():
        raise ValueError(f"{where} has skinning weights that are not finite")
    total = weights.sum(axis=1, keepdims=True)
    is_bound = total[:, 0] > 0
    weights = np.divide(weights, total, out=np.zeros_like(weights), where=is_bound[:, None])
    weights[~is_bound, 0] = 1  # as common viewers do
    return np.concatenate(joints, axis=1).astype(np.int64), weights


def _read_morph(accessors: Accessors, target: Json, n_vertices: int, where: str) -> Morph:
    def deltas(name: str) -> Float32 | None:
        number = index(target, name, where, len(accessors.document.items("accessors")))
        if number is None:
            return None
        values = accessors.read_floats(number, ("VEC3",), f"{where}, {name}")
        if len(values) != n_vertices:
            raise ValueError(f"{where} has {len(values)} values of {name}; {n_vertices} are needed")
        return values

    turned, normals = _without_zeros(deltas("NORMAL"))
    moved, positions = _without_zeros(deltas("POSITION"))
    if positions is None:
        return Morph(np.zeros(0, np.int64), np.zeros((0, 3), np.float32), turned, normals)
    return Morph(moved, positions, turned, normals)


def _without_zeros(deltas: Float32 | None) -> tuple[Int64 | None, Float32 | None]:
    """Rows that are not 0 and their numbers, where those are fewer than half; else None and all rows."""
    if deltas is None:
        return None, None
    rows = np.flatnonzero(deltas.any(axis=1))
    return (rows, deltas[rows]) if 2 * len(rows) < len(deltas) else (None, deltas)
