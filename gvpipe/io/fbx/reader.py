"""An FBX scene as a `MeshSequence`: nodes with a mesh become parts in world space, frames are evaluated when they are read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.arguments import did_you_mean
from gvpipe.arrays import Array, Float64
from gvpipe.asset.metadata import Metadata
from gvpipe.errors import InputError
from gvpipe.io.fbx.library import fbx_errors, hold, import_ufbx, listed, numbers
from gvpipe.io.fbx.materials import read_material
from gvpipe.io.fbx.motion import Evaluator, FbxMotion, linear
from gvpipe.io.fbx.textures import Textures
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene_frames import SceneFrames, frame_times
from gvpipe.io.scene_layers import join_layers
from gvpipe.io.scene_mesh import Layer, SceneMesh, join
from gvpipe.io.simulation.side_files import side_file
from gvpipe.sequence import MeshSequence

UP = {0: "x", 1: "x", 2: "y", 3: "y", 4: "z", 5: "z"}
EXPERIMENTAL = "FBX is read by ufbx, whose Python package is experimental"


def read_fbx(path: Path, options: ReadOptions) -> MeshSequence:
    """Read the meshes of an FBX file, in the file's units and axes, with the world transforms of its nodes.

    Args:
        path: .fbx; textures and geometry caches beside it are read too.
        options: `clip` names a take, the first by default; `fps` samples it at that rate instead of the file's.

    Raises:
        InputError: ufbx is missing, the file is damaged, it has no mesh, there is no such take, a position is not finite.
    """
    ufbx = import_ufbx(path)
    if not path.stat().st_size:
        raise InputError(f"{path} is empty; export it again")
    with fbx_errors(ufbx, path):
        scene, notes = _load(ufbx, path)
        return _read_scene(ufbx, scene, path, options, notes)


def _load(ufbx: Any, path: Path) -> tuple[Any, list[str]]:
    """The scene, with its geometry caches where all of them lie in its folder, and notes."""
    settings = {"file_format": ufbx.FileFormat.FBX, "generate_missing_normals": True}
    scene = hold(ufbx.load_file(str(path), **settings))
    caches = listed(scene.cache_files)
    if not caches:
        return scene, []
    for cache in caches:
        named = cache.relative_filename or cache.filename
        try:
            side_file(path, named, "geometry cache")
            if not Path(cache.filename).resolve().is_relative_to(path.parent.resolve()):
                raise ValueError(f"its geometry cache {named!r} lies outside the file's folder; move it beside the file")
        except ValueError as exc:
            raise InputError(f"{path}: {exc}") from exc
    return hold(ufbx.load_file(str(path), **settings, load_external_files=True)), []


def _read_scene(ufbx: Any, scene: Any, path: Path, options: ReadOptions, notes: list[str]) -> MeshSequence:
    where, settings = str(path), hold(scene.settings)
    take, take_notes = _take(scene, options.clip, where)
    anim = hold(scene.anim) if take is None else hold(take.anim)
    rate = float(settings.frames_per_second)
    fps = options.fps or (rate if np.isfinite(rate) and rate > 0 else 24.0)
    times = np.zeros(1) if take is None else _times(take, fps, where)
    start, stop = options.span(len(times), where)
    times = times[start:stop]
    nodes = listed(scene.nodes)
    shown, hidden = _with_mesh(nodes)
    if not shown:
        raise InputError(f"{where} has no polygon mesh; a mesh with triangles is needed")
    evaluator = Evaluator(ufbx, scene, anim)
    motions = [FbxMotion(evaluator, index, nodes[index], take is not None) for index in shown]
    frames = SceneFrames(motions, times, where, "second")
    textures, uv_names = Textures(path), _uv_names([nodes[index] for index in shown])
    found = listed(scene.materials)
    materials = tuple(read_material(material, textures, uv_names) for material in found)
    by_id = {int(material.typed_id): number for number, material in enumerate(found)}
    meshes = [_read_mesh(nodes[motion.index], motion, by_id, float(times[0])) for motion in motions]
    joined = join(meshes, where)
    attributes, layer_notes = join_layers(meshes, joined.fans, frames.first)
    if hidden:
        notes.append(f"{hidden} meshes are hidden; they were left out")
    return MeshSequence(
        frames,
        joined.faces,
        fps,
        attributes,
        where,
        frames.origin,
        (*notes, *take_notes, *textures.notes, *layer_notes, EXPERIMENTAL),
        parts=joined.parts,
        polygons=joined.polygons,
        materials=materials,
        images=tuple(textures.images),
        metadata=_metadata(scene, settings, path, float(times[0]), take),
    )


def _take(scene: Any, clip: str | None, where: str) -> tuple[Any, list[str]]:
    """The take that is read, None if the file has none, and notes."""
    takes = listed(scene.anim_stacks)
    names = [str(take.name) for take in takes]
    if clip is not None and clip not in names:
        there = f"there are {', '.join(map(repr, names))}" if names else "it has none"
        raise InputError(f"{where} has no take {clip!r}; {there}{did_you_mean(clip, names)}")
    if not takes:
        return None, []
    number = 0 if clip is None else names.index(clip)
    others = [name for i, name in enumerate(names) if i != number]
    note = f"take {names[number]!r} was read; others are {', '.join(map(repr, others))} (clip, --clip)"
    return takes[number], [note] if clip is None and others else []


def _times(take: Any, fps: float, where: str) -> Float64:
    start, stop = float(take.time_begin), float(take.time_end)
    if not (np.isfinite(start) and np.isfinite(stop)):
        raise InputError(f"{where}: take {take.name!r} runs from {start} to {stop} s; finite times are needed")
    return frame_times(start, max(start, stop), 1 / fps, where)


def _with_mesh(nodes: list[Any]) -> tuple[list[int], int]:
    """Indices of the nodes that show a mesh, and how many others are hidden; if all are hidden, they are shown."""
    found = []
    for index, node in enumerate(nodes):
        mesh = hold(node.mesh)
        if mesh is not None and mesh.num_faces and mesh.num_vertices:
            found.append(index)
    visible = [index for index in found if nodes[index].visible]
    return (visible, len(found) - len(visible)) if visible else (found, 0)


def _uv_names(nodes: list[Any]) -> dict[str, str]:
    """Names of attributes by the names of uv sets: the first of each mesh is ``uv``, the second ``uv1``."""
    names: dict[str, str] = {}
    for node in nodes:
        for number, held in enumerate(listed(hold(node.mesh).uv_sets)):
            names.setdefault(str(held.name), "uv" if number == 0 else f"uv{number}")
    return names


def _read_mesh(node: Any, motion: FbxMotion, materials: dict[int, int], time: float) -> SceneMesh:
    mesh = hold(node.mesh)
    faces = numbers(mesh.faces, np.int64).reshape(-1, 2)  # first corner and number of corners
    counts = faces[:, 1]
    take = np.repeat(faces[:, 0], counts) + np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    corners = numbers(mesh.vertex_indices, np.int64)[take]
    bound = tuple(materials.get(int(each.typed_id)) for each in listed(node.materials))
    groups = numbers(mesh.face_material, np.int64)
    if len(groups) != len(counts) or groups.max(initial=0) >= len(bound):
        groups, bound = np.zeros(len(counts), np.int64), bound[:1] or (None,)
    parent = hold(node.parent)
    name = str(node.name) or str(mesh.name)
    plain = SceneMesh(name, "" if parent is None or parent.is_root else str(parent.name), motion.n_vertices, counts, corners,
                      groups, bound)  # fmt: skip
    layers = [*_sets(mesh.uv_sets, "uv", take), *_sets(mesh.color_sets, "color", take)]
    normals = motion.normals(time)
    if normals is not None:
        layers.append(Layer("normal", "normal", "corner", normals[0], normals[1][take]))
    is_mirrored = bool(np.linalg.det(linear(node)) < 0)
    return replace(plain, is_flipped=is_mirrored != bool(mesh.reversed_winding), layers=tuple(layers))


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


def _metadata(scene: Any, settings: Any, path: Path, start: float, take: Any) -> Metadata:
    unit = float(settings.unit_meters)
    up = int(hold(settings.axes).up)
    texts = {"fbx creator": str(hold(scene.metadata).creator)}
    if take is not None:
        texts["fbx take"] = str(take.name)
    return Metadata(UP.get(up, ""), unit if np.isfinite(unit) and unit > 0 else None, start, path.name, texts)
