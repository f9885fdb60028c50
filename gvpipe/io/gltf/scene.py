"""A file's scene as one mesh: blocks of vertices in the order of its nodes, parts, attributes and materials.

The order of vertices: the scene's nodes, each before its children, children in the file's order. A node's mesh gives its blocks
in the order of its primitives, one block per primitive; primitives that share all accessors share a block. A mesh that several
nodes show has vertices for each of them.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gvpipe.asset.material import Image, Material
from gvpipe.asset.metadata import NO_METADATA, Metadata
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Float64, Int32
from gvpipe.io.gltf.accessors import Accessors
from gvpipe.io.gltf.clips import NO_CLIP, Clip, find_clip, read_clip
from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.geometry import GltfMesh, read_mesh, read_weights
from gvpipe.io.gltf.instances import read_instances
from gvpipe.io.gltf.json_fields import child, index, text
from gvpipe.io.gltf.left_behind import left_behind
from gvpipe.io.gltf.materials import Looks, read_materials
from gvpipe.io.gltf.nodes import Nodes, read_nodes, scene_order
from gvpipe.io.gltf.poses import Placed, Poses, find_hidden
from gvpipe.io.gltf.skins import Skin, read_skin
from gvpipe.io.gltf.used_looks import used_looks
from gvpipe.io.gltf.vectors import handedness
from gvpipe.io.scene.hiding import hidden_note


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene of V vertices and T triangles.

    Args:
        poses: positions at any time of the clip.
        clip: what moves it.
        faces: ``(T, 3)``.
        placed: its blocks of vertices.
        linear: what turns each block's vectors at the first frame.
        parts, materials, images, metadata, notes, not_carried: as in `MeshSequence`.
    """

    poses: Poses
    clip: Clip
    faces: Int32
    placed: tuple[Placed, ...]
    linear: tuple[Float64, ...]
    parts: tuple[Part, ...]
    materials: tuple[Material, ...]
    images: tuple[Image, ...]
    metadata: Metadata
    notes: tuple[str, ...]
    not_carried: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Shown:
    """A mesh where a node shows it, and the vertices of its blocks."""

    node: int
    mesh: GltfMesh
    placed: tuple[Placed, ...]


def read_scene(document: Document, clip: str | None = None, is_still: bool = False, moving_alone: bool = False) -> Scene:
    """Read the scene that a file shows, all of it: see `open_scene`."""
    return open_scene(document, clip, is_still, moving_alone).all()


@dataclass(frozen=True, eq=False)
class OpenScene:
    """What a file shows before it is put together.

    Args:
        document, nodes, clip: of the file.
        shown: the meshes.
        moving_alone: as of `open_scene`.
    """

    document: Document
    nodes: Nodes
    clip: Clip
    shown: list[Shown]
    moving_alone: bool

    @cached_property
    def looks(self) -> Looks:
        """All materials and images."""
        return Looks((), (), ()) if self.moving_alone else read_materials(self.document)

    @cached_property
    def left(self) -> tuple[str, ...]:
        """What is not carried, by name."""
        in_scene = set(scene_order(self.document, self.nodes))
        return () if self.moving_alone else left_behind(self.document, in_scene)

    def all(self) -> Scene:
        """The scene of all meshes, at the clip's start; raises `ValueError`."""
        nodes, clip = self.nodes, self.clip
        visible, hiding = _without_hidden(nodes, clip, self.shown)
        if not visible:  # a file that shows nothing shows all
            curves = {key: curve for key, curve in clip.curves.items() if key[1] != "visible"}
            nodes, clip = replace(nodes, visible=np.ones_like(nodes.visible)), replace(clip, curves=curves)
        return _joined(self, nodes, clip, visible or self.shown, hiding, clip.start)

    def some(self, numbers: Collection[int], time: float) -> Scene:
        """The scene of some meshes at a time; raises `ValueError`."""
        kept = _placed_anew([self.shown[number] for number in numbers])
        scene = _joined(self, self.nodes, self.clip, kept, (), time)
        parts, materials, images = used_looks(scene.parts, scene.materials, scene.images)
        return replace(scene, parts=parts, materials=materials, images=images)


def open_scene(document: Document, clip: str | None = None, is_still: bool = False, moving_alone: bool = False) -> OpenScene:
    """Read the scene that a file shows.

    Args:
        document: the file.
        clip: name of its animation; None: the first.
        is_still: leave out animations.
        moving_alone: leave out what is the same in all frames of a series: texture coordinates, tangents, materials, images.

    Raises:
        ValueError: it holds no triangle, or anything in it cannot be.
    """
    accessors = Accessors(document)
    nodes = read_nodes(document)
    shown = _shown_meshes(accessors, nodes, moving_alone)
    moves, number = NO_CLIP, None
    if not is_still:
        counts = {one.node: len(one.block.morphs) for each in shown for one in each.placed}
        number = find_clip(document, clip)
        moves = read_clip(accessors, number, counts)
    return OpenScene(document, nodes, moves, shown, moving_alone)


def _joined(opened: OpenScene, nodes: Nodes, moves: Clip, shown: list[Shown], hiding: tuple[str, ...], time: float) -> Scene:
    """The scene of some meshes, its vectors as at a time."""
    document, moving_alone = opened.document, opened.moving_alone
    placed = [one for each in shown for one in each.placed]
    poses = Poses(nodes, moves, placed)
    linear = poses.linear(time)
    faces, parts = _triangles(nodes, shown, linear)
    if not len(faces):
        raise ValueError("its meshes have no triangles")
    looks = opened.looks
    return Scene(
        poses,
        moves,
        faces,
        tuple(placed),
        tuple(linear),
        parts,
        looks.materials,
        looks.images,
        NO_METADATA if moving_alone else _metadata(document, moves.name, time),
        () if moving_alone else (*hiding, *looks.notes),
        opened.left,
    )


def _shown_meshes(accessors: Accessors, nodes: Nodes, moving_alone: bool) -> list[Shown]:
    document = accessors.document
    items = document.items("nodes")
    n_meshes, n_skins = len(document.items("meshes")), len(document.items("skins"))
    meshes: dict[int, GltfMesh] = {}
    skins: dict[int, Skin] = {}
    shown: list[Shown] = []
    n_vertices = 0
    for node in scene_order(document, nodes):
        where = f"node {node}"
        number = index(items[node], "mesh", where, n_meshes)
        if number is None:
            continue
        if number not in meshes:
            meshes[number] = read_mesh(accessors, number, moving_alone)
        skin_number = index(items[node], "skin", where, n_skins)
        if skin_number is not None and skin_number not in skins:
            skins[skin_number] = read_skin(accessors, skin_number)
        mesh = meshes[number]
        weights = read_weights(items[node], len(mesh.weights), where) if "weights" in items[node] else mesh.weights
        for instance in read_instances(accessors, items[node], where):
            placed = []
            for block in mesh.blocks:
                skin = None if skin_number is None or block.joints is None else skins[skin_number]
                document.budget.spend(48 * len(block.positions), where)
                placed.append(Placed(node, block, skin, weights[: len(block.morphs)], n_vertices, instance))
                n_vertices += len(block.positions)
            shown.append(Shown(node, mesh, tuple(placed)))
    if not n_vertices:
        raise ValueError("it has no triangle mesh in its scene")
    return shown


def _without_hidden(nodes: Nodes, clip: Clip, shown: list[Shown]) -> tuple[list[Shown], tuple[str, ...]]:
    """Those that are visible at any time of the clip, and what to say of the others."""
    keys = [curve.times for (_, path), curve in clip.curves.items() if path == "visible"]
    times = np.unique(np.concatenate([[clip.start], *keys]))
    hidden = [find_hidden(nodes, clip, each.node) for each in shown]
    spans = [np.zeros(len(times), bool) if one is None else one(times) for one in hidden]
    kept = [each for each, span in zip(shown, spans, strict=True) if not span.all()]
    if not kept:
        return [], ("all of its meshes are hidden; they were read as they are",)
    result = _placed_anew(kept)
    n_left, n_passing = len(shown) - len(kept), sum(bool(span.any()) and not span.all() for span in spans)
    left = (f"{n_left} of {len(shown)} meshes are hidden; they were left out",) if n_left else ()
    return result, (*left, *hidden_note(n_passing))


def _placed_anew(kept: list[Shown]) -> list[Shown]:
    """Some of the meshes, their vertices numbered from 0."""
    result, start = [], 0
    for each in kept:
        placed = []
        for one in each.placed:
            placed.append(replace(one, start=start))
            start += len(one.block.positions)
        result.append(replace(each, placed=tuple(placed)))
    return result


def _triangles(nodes: Nodes, shown: list[Shown], linear: list[Float64]) -> tuple[Int32, tuple[Part, ...]]:
    """All triangles ``(T, 3)``, and the parts; glTF 2.0, 3.7.4: a mirroring transform turns the winding."""
    faces: list[Int32] = []
    parts: list[Part] = []
    n_faces, n_placed = 0, 0
    for each in shown:
        parent = nodes.parents[each.node]
        for primitive in each.mesh.primitives:
            one = each.placed[primitive.block]
            turns = linear[n_placed + primitive.block]
            is_mirrored = float(np.mean(handedness(turns))) < 0
            triangles = primitive.triangles[:, ::-1] if is_mirrored else primitive.triangles
            faces.append(triangles + np.int32(one.start))
            parts.append(
                Part(
                    nodes.names[each.node] or each.mesh.name,
                    (one.start, one.start + len(one.block.positions)),
                    (n_faces, n_faces + len(triangles)),
                    primitive.material,
                    nodes.names[parent] if parent >= 0 else "",
                )
            )
            n_faces += len(triangles)
        n_placed += len(each.placed)
    is_plain = len(parts) == 1 and not parts[0].name and parts[0].material is None
    joined = np.concatenate(faces) if faces else np.zeros((0, 3), np.int32)
    return np.ascontiguousarray(joined, np.int32), () if is_plain else tuple(parts)


def _metadata(document: Document, clip: str, start: float) -> Metadata:
    asset = child(document.tree, "asset", "the file")
    texts = {"copyright": text(asset, "copyright"), "clip": clip}
    return Metadata("y", 1.0, start, text(asset, "generator"), {key: value for key, value in texts.items() if value})
