"""A file's scene as one mesh: blocks of vertices in the order of its nodes, parts, attributes and materials.

The order of vertices: the scene's nodes, each before its children, children in the file's order. A node's mesh gives its blocks
in the order of its primitives, one block per primitive; primitives that share all accessors share a block. A mesh that several
nodes show has vertices for each of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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
        linear: what turns each block's vectors at the clip's start.
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
    visible, hiding = _without_hidden(nodes, moves, shown)
    if not visible:  # a file that shows nothing shows all
        curves = {key: curve for key, curve in moves.curves.items() if key[1] != "visible"}
        nodes, moves = replace(nodes, visible=np.ones_like(nodes.visible)), replace(moves, curves=curves)
    shown = visible or shown
    placed = [one for each in shown for one in each.placed]
    poses = Poses(nodes, moves, placed)
    linear = poses.linear(moves.start)
    faces, parts = _triangles(nodes, shown, linear)
    if not len(faces):
        raise ValueError("its meshes have no triangles")
    looks = Looks((), (), ()) if moving_alone else read_materials(document)
    return Scene(
        poses,
        moves,
        faces,
        tuple(placed),
        tuple(linear),
        parts,
        looks.materials,
        looks.images,
        NO_METADATA if moving_alone else _metadata(document, moves.name, moves.start),
        () if moving_alone else (*hiding, *looks.notes),
        () if moving_alone else left_behind(document, set(scene_order(document, nodes))),
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
    result, start = [], 0
    for each in kept:
        placed = []
        for one in each.placed:
            placed.append(replace(one, start=start))
            start += len(one.block.positions)
        result.append(replace(each, placed=tuple(placed)))
    n_left, n_passing = len(shown) - len(kept), sum(bool(span.any()) and not span.all() for span in spans)
    left = (f"{n_left} of {len(shown)} meshes are hidden; they were left out",) if n_left else ()
    return result, (*left, *hidden_note(n_passing))


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
