"""A loaded FBX scene, and its meshes at a time, evaluated by ufbx. It runs without NumPy, see `gvpipe.io.fbx.answers`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gvpipe.foundation.errors import InputError
from gvpipe.io.fbx.answers import Described, Map, Mesh, Picture, Placed, Posed, Shown, Table, Take
from gvpipe.io.fbx.library import columns, hold, integers, listed, vectors
from gvpipe.io.simulation.side_files import side_file

UP = {0: "x", 1: "x", 2: "y", 3: "y", 4: "z", 5: "z"}
OTHERS = ("lights", "cameras", "nurbs_curves", "nurbs_surfaces", "line_curves", "constraints", "audio_clips")
MAPS = (
    "base_color",
    "base_factor",
    "opacity",
    "emission_color",
    "emission_factor",
    "normal_map",
    "ambient_occlusion",
    "metalness",
    "roughness",
)


class FbxScene:
    """A loaded file; raises `InputError` or the library's errors."""

    def __init__(self, ufbx: Any, path: Path) -> None:
        self._ufbx = ufbx
        self._scene = _load(ufbx, path)
        self._nodes = listed(self._scene.nodes)
        self._shown, self._n_hidden = _with_mesh(self._nodes)
        self._may_hide = all(self._nodes[index].visible for index in self._shown)  # else all are hidden, and all are shown
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
        contents: dict[str, bytes] = {}
        materials = [_material(material, contents) for material in listed(self._scene.materials)]
        now, posed = self._evaluate(time)
        meshes = [_mesh(self._nodes[index], posed[index]) for index in self._shown]
        now.free()
        return Described(
            meshes,
            self._n_hidden,
            materials,
            contents,
            float(settings.frames_per_second),
            float(settings.unit_meters),
            UP.get(int(hold(settings.axes).up), ""),
            str(hold(self._scene.metadata).creator),
            {kind.replace("_", " "): len(found) for kind in OTHERS if (found := listed(getattr(self._scene, kind)))},
        )

    def positions(self, time: float) -> list[Posed]:
        """Positions of each mesh at a time, seconds."""
        now, posed = self._evaluate(time)
        nodes = [posed[index] for index in self._shown]
        result = [
            Posed(vectors(hold(hold(node.mesh).skinned_position).values), _placed(node), self._may_hide and not node.visible)
            for node in nodes
        ]
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


def _placed(node: Any) -> Placed:
    mesh, to_world = hold(node.mesh), columns(node.geometry_to_world)
    if mesh.skinned_is_local:
        return Placed(to_world, True, None)
    skins = listed(mesh.skin_deformers)
    clusters = listed(skins[0].clusters) if skins else []
    if len(hold(mesh.instances)) < 2 or not clusters:
        return Placed(to_world, False, None)
    return Placed(to_world, False, (columns(clusters[0].geometry_to_bone), columns(clusters[0].bind_to_world)))


def _mesh(node: Any, posed: Any) -> Mesh:
    """A node's mesh; normals and place are those of the posed node."""
    mesh, parent = hold(node.mesh), hold(node.parent)
    normals = hold(hold(posed.mesh).skinned_normal)
    return Mesh(
        str(node.name) or str(mesh.name),
        "" if parent is None or parent.is_root else str(parent.name),
        int(mesh.num_vertices),
        vectors(mesh.faces),
        integers(mesh.vertex_indices),
        integers(mesh.face_material),
        tuple(int(each.typed_id) for each in listed(node.materials)),
        [_table(each.name, each.vertex_uv) for each in listed(mesh.uv_sets)],
        [_table(each.name, each.vertex_color) for each in listed(mesh.color_sets)],
        _table("normal", normals) if normals.exists else None,
        _placed(posed),
    )


def _table(name: Any, found: Any) -> Table:
    held = hold(found)
    return Table(str(name), vectors(held.values), integers(held.indices))


def _material(material: Any, contents: dict[str, bytes]) -> Shown:
    """A material; what its pictures hold is added to ``contents``."""
    held = hold(material.pbr)
    maps = {name: _map(getattr(held, name), contents) for name in MAPS}
    double_sided = bool(hold(hold(material.features).double_sided).enabled)
    return Shown(int(material.typed_id), str(material.name), maps, double_sided)


def _map(found: Any, contents: dict[str, bytes]) -> Map:
    held = hold(found)
    value = tuple(map(float, hold(held.value_vec4))) if held.has_value else None
    texture = hold(held.texture)
    return Map(value, _picture(texture, contents) if texture is not None and held.texture_enabled else None)  # type: ignore[arg-type]  # four


def _picture(texture: Any, contents: dict[str, bytes]) -> Picture:
    key = str(texture.relative_filename or texture.filename or texture.name)
    if key not in contents:
        contents[key] = bytes(texture.content or b"")
    wrap = int(texture.wrap_u), int(texture.wrap_v)
    return Picture(key, str(texture.name), str(texture.relative_filename or ""), wrap, str(texture.uv_set))
