"""The meshes of an FBX scene as arrays, made of what the process of ufbx answers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64
from gvpipe.io.fbx.answers import Mesh, Numbers, Placed, Posed, Table
from gvpipe.io.scene.mesh import Layer, SceneMesh


def scene_mesh(mesh: Mesh, materials: dict[int, int]) -> SceneMesh:
    """A node's mesh with its layers; ``materials`` are the numbers of the scene's materials by id."""
    faces = numbers(mesh.faces, np.int64).reshape(-1, 2)
    counts = faces[:, 1]
    take = np.repeat(faces[:, 0], counts) + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    bound = tuple(materials.get(each) for each in mesh.materials)
    groups = numbers(mesh.groups, np.int64)
    if len(groups) != len(counts) or groups.max(initial=0) >= len(bound):
        groups, bound = np.zeros(len(counts), np.int64), bound[:1] or (None,)
    return SceneMesh(
        mesh.name,
        mesh.parent,
        mesh.n_vertices,
        counts,
        numbers(mesh.corners, np.int64)[take],
        groups,
        bound,
        bool(np.linalg.det(_to_world(mesh.placed)[:3]) < 0),
        (*_sets(mesh.uv, "uv", take), *_sets(mesh.colors, "color", take), *_normals(mesh, take)),
    )


def world_positions(posed: Posed) -> Float64:
    """``(n, 3)`` positions in world space."""
    matrix = _to_world(posed.placed)
    return np.asarray(numbers(posed.positions, np.float64).reshape(-1, 3) @ matrix[:3] + matrix[3])


def uv_names(meshes: Iterable[Mesh]) -> dict[str, str]:
    """Names of attributes by the names of uv sets: the first of each mesh is ``uv``, the second ``uv1``."""
    names: dict[str, str] = {}
    for mesh in meshes:
        for number, table in enumerate(mesh.uv):
            names.setdefault(table.name, "uv" if number == 0 else f"uv{number}")
    return names


def numbers(held: Numbers, dtype: Any) -> Array:
    """An array of numbers."""
    return np.frombuffer(held.data, np.dtype(held.code)).astype(dtype)


def _to_world(placed: Placed) -> Float64:
    """``(4, 3)`` the transform of evaluated positions to the world.

    A skin puts its mesh into the world. Where several nodes show a skinned mesh, each node moves what the skin gives,
    relative to where the mesh was bound; Maya does so.
    """
    if placed.is_local:
        return np.reshape(placed.to_world, (4, 3))
    if placed.bound is None:
        return np.eye(4, 3)
    to_bone, to_world = map(_square, placed.bound)
    return np.asarray((np.linalg.pinv(to_bone @ to_world) @ _square(placed.to_world))[:, :3])


def _square(columns: tuple[float, ...]) -> Float64:
    """``(4, 4)`` a transform, for rows of coordinates."""
    result = np.eye(4)
    result[:, :3] = np.reshape(columns, (4, 3))
    return result


def _sets(tables: list[Table], kind: str, take: Array) -> list[Layer]:
    """Texture coordinates or colours of the polygons' corners."""
    layers = []
    for number, table in enumerate(tables):
        values = numbers(table.values, np.float32).reshape(-1, 2 if kind == "uv" else 4)
        if len(values):
            name = kind if number == 0 else f"{kind}{number}"
            layers.append(Layer(name, kind, "corner", values, numbers(table.indices, np.int64)[take]))
    return layers


def _normals(mesh: Mesh, take: Array) -> list[Layer]:
    """Unit normals of the polygons' corners in world space."""
    if mesh.normals is None:
        return []
    values = numbers(mesh.normals.values, np.float64).reshape(-1, 3) @ np.linalg.pinv(_to_world(mesh.placed)[:3]).T
    length = np.linalg.norm(values, axis=1, keepdims=True)
    unit = np.where(length > 0, values / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    return [Layer("normal", "normal", "corner", unit.astype(np.float32), numbers(mesh.normals.indices, np.int64)[take])]
