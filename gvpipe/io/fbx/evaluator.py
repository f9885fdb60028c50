"""A loaded FBX scene, and its meshes at a time, evaluated by ufbx."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gvpipe.arrays import Array, Float64
from gvpipe.asset.material import Image, Material
from gvpipe.errors import InputError
from gvpipe.io.fbx.library import columns, hold, listed, numbers, square
from gvpipe.io.fbx.materials import read_material
from gvpipe.io.fbx.textures import Textures
from gvpipe.io.scene_mesh import Layer, SceneMesh
from gvpipe.io.simulation.side_files import side_file

UP = {0: "x", 1: "x", 2: "y", 3: "y", 4: "z", 5: "z"}


class Take(NamedTuple):
    """An animation of the file; times in seconds."""

    name: str
    start: float
    stop: float


class Described(NamedTuple):
    """What an FBX file holds beside motion.

    Args:
        meshes: of the nodes that show one, with their layers.
        n_hidden: nodes whose mesh is hidden, which were left out.
        materials, images: of the scene.
        fps, unit, up, creator: of the scene; the unit in metres.
        notes: what was left out, a line each.
    """

    meshes: list[SceneMesh]
    n_hidden: int
    materials: tuple[Material, ...]
    images: tuple[Image, ...]
    fps: float
    unit: float
    up: str
    creator: str
    notes: list[str]


class FbxScene:
    """A loaded file; raises `InputError` or the library's errors."""

    def __init__(self, ufbx: Any, path: Path) -> None:
        self._ufbx, self._path = ufbx, path
        self._scene = _load(ufbx, path)
        self._nodes = listed(self._scene.nodes)
        self._shown, self._n_hidden = _with_mesh(self._nodes)
        self._takes = listed(self._scene.anim_stacks)
        self._anim = hold(self._scene.anim)

    def takes(self) -> list[Take]:
        """The takes, in the order of the file."""
        return [Take(str(take.name), float(take.time_begin), float(take.time_end)) for take in self._takes]

    def choose(self, number: int) -> None:
        """Evaluate a take from now on."""
        self._anim = hold(self._takes[number].anim)

    def describe(self, time: float) -> Described:
        """Everything but motion; normals are those at a time, seconds."""
        settings = hold(self._scene.settings)
        nodes = [self._nodes[index] for index in self._shown]
        textures, uv_names = Textures(self._path), _uv_names(nodes)
        found = listed(self._scene.materials)
        materials = tuple(read_material(material, textures, uv_names) for material in found)
        by_id = {int(material.typed_id): number for number, material in enumerate(found)}
        now, posed = self._evaluate(time)
        meshes = [_read_mesh(node, posed[index], by_id) for node, index in zip(nodes, self._shown, strict=True)]
        now.free()
        return Described(
            meshes,
            self._n_hidden,
            materials,
            tuple(textures.images),
            float(settings.frames_per_second),
            float(settings.unit_meters),
            UP.get(int(hold(settings.axes).up), ""),
            str(hold(self._scene.metadata).creator),
            textures.notes,
        )

    def positions(self, time: float) -> list[Array]:
        """``(n, 3)`` of each mesh in world space at a time, seconds."""
        now, posed = self._evaluate(time)
        result = []
        for index in self._shown:
            values = numbers(hold(hold(posed[index].mesh).skinned_position).values, np.float64).reshape(-1, 3)
            matrix = _to_world(posed[index])
            result.append(values @ matrix[:3] + matrix[3])
        now.free()
        return result

    def _evaluate(self, time: float) -> tuple[Any, list[Any]]:
        """The scene at a time, and its nodes."""
        # without the last, caches stay at rest; `_load` has looked where their files are
        options = {"evaluate_skinning": True, "evaluate_caches": True, "load_external_files": True}
        now = hold(self._ufbx.evaluate_scene(self._scene, self._anim, time, **options))
        return now, listed(now.nodes)


def _load(ufbx: Any, path: Path) -> Any:
    """The scene, with its geometry caches, which must lie in its folder."""
    settings = {"file_format": ufbx.FileFormat.FBX, "generate_missing_normals": True}
    scene = hold(ufbx.load_file(str(path), **settings))
    caches = listed(scene.cache_files)
    for cache in caches:
        named = cache.relative_filename or cache.filename
        try:
            side_file(path, named, "geometry cache")
            _check_place(path, Path(cache.filename))
        except ValueError as exc:
            raise InputError(f"{path}: {exc}") from exc
    return hold(ufbx.load_file(str(path), **settings, load_external_files=True)) if caches else scene


def _check_place(path: Path, cache: Path) -> None:
    """Raise `ValueError` if a cache, or a file of Maya's samples that it stands for, lies outside the folder of ``path``.

    The library reads samples from files that have the name of Maya's .xml, and more after it.
    """
    samples = [each for each in cache.parent.glob("*.mc*") if each.name.startswith(cache.stem)] if cache.parent.is_dir() else []
    for file in (cache, *samples):
        if not file.resolve().is_relative_to(path.parent.resolve()):
            raise ValueError(f"its geometry cache {file.name!r} lies outside the file's folder; move it beside the file")


def _with_mesh(nodes: list[Any]) -> tuple[list[int], int]:
    """Indices of the nodes that show a mesh, and how many others are hidden; if all are hidden, they are shown."""
    found = []
    for index, node in enumerate(nodes):
        mesh = hold(node.mesh)
        if mesh is not None and mesh.num_faces and mesh.num_vertices:
            found.append(index)
    visible = [index for index in found if nodes[index].visible]
    return (visible, len(found) - len(visible)) if visible else (found, 0)


def _to_world(node: Any) -> Float64:
    """``(4, 3)`` the transform of a node's evaluated positions to the world.

    A skin puts its mesh into the world. Where several nodes show a skinned mesh, each node moves what the skin gives,
    relative to where the mesh was bound; Maya does so.
    """
    mesh = hold(node.mesh)
    if mesh.skinned_is_local:
        return columns(node)
    skins = listed(mesh.skin_deformers)
    clusters = listed(skins[0].clusters) if skins else []
    if len(hold(mesh.instances)) < 2 or not clusters:
        return np.eye(4, 3)
    bound = square(clusters[0].geometry_to_bone) @ square(clusters[0].bind_to_world)
    return np.asarray((np.linalg.pinv(bound) @ square(node.geometry_to_world))[:, :3])


def _uv_names(nodes: list[Any]) -> dict[str, str]:
    """Names of attributes by the names of uv sets: the first of each mesh is ``uv``, the second ``uv1``."""
    names: dict[str, str] = {}
    for node in nodes:
        for number, held in enumerate(listed(hold(node.mesh).uv_sets)):
            names.setdefault(str(held.name), "uv" if number == 0 else f"uv{number}")
    return names


def _read_mesh(node: Any, posed: Any, materials: dict[int, int]) -> SceneMesh:
    """A node's mesh; normals are those of the posed node."""
    mesh = hold(node.mesh)
    faces = numbers(mesh.faces, np.int64).reshape(-1, 2)  # first corner and number of corners
    counts = faces[:, 1]
    take = np.repeat(faces[:, 0], counts) + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    bound = tuple(materials.get(int(each.typed_id)) for each in listed(node.materials))
    groups = numbers(mesh.face_material, np.int64)
    if len(groups) != len(counts) or groups.max(initial=0) >= len(bound):
        groups, bound = np.zeros(len(counts), np.int64), bound[:1] or (None,)
    parent = hold(node.parent)
    is_mirrored = bool(np.linalg.det(_to_world(posed)[:3]) < 0)
    return SceneMesh(
        str(node.name) or str(mesh.name),
        "" if parent is None or parent.is_root else str(parent.name),
        int(mesh.num_vertices),
        counts,
        numbers(mesh.vertex_indices, np.int64)[take],
        groups,
        bound,
        is_mirrored,
        (*_sets(mesh.uv_sets, "uv", take), *_sets(mesh.color_sets, "color", take), *_normals(posed, take)),
    )


def _sets(held: Any, kind: str, take: Array) -> list[Layer]:
    """Texture coordinates or colours of the polygons' corners."""
    layers = []
    for number, one in enumerate(listed(held)):
        values = hold(one.vertex_uv if kind == "uv" else one.vertex_color)
        table = numbers(values.values, np.float32).reshape(-1, 2 if kind == "uv" else 4)
        if len(table):
            name = kind if number == 0 else f"{kind}{number}"
            layers.append(Layer(name, kind, "corner", table, numbers(values.indices, np.int64)[take]))
    return layers


def _normals(posed: Any, take: Array) -> list[Layer]:
    """Unit normals of the polygons' corners in world space."""
    mesh = hold(posed.mesh)
    held = hold(mesh.skinned_normal)
    if not held.exists:
        return []
    values = numbers(held.values, np.float64).reshape(-1, 3)
    values = values @ np.linalg.pinv(_to_world(posed)[:3]).T
    length = np.linalg.norm(values, axis=1, keepdims=True)
    unit = np.where(length > 0, values / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    return [Layer("normal", "normal", "corner", unit.astype(np.float32), numbers(held.indices, np.int64)[take])]
