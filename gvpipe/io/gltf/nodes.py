"""The tree of nodes: its scene in order, and the transforms of nodes to the world, at rest and at many times.

World transforms are products along the tree. They are computed level by level, all nodes of a level and all times at once.
Nodes that no animation reaches keep their transform at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.io.gltf.document import Document
from gvpipe.io.gltf.json_fields import Json, indices, numbers, text
from gvpipe.io.gltf.pointers import is_visible


@dataclass(frozen=True, eq=False)
class Nodes:
    """The nodes of a file, N of them.

    Args:
        parents: ``(N,)`` number of each node's parent, -1 for none.
        levels: the nodes by depth, parents first; all nodes are in one of them.
        translations: ``(N, 3)`` at rest.
        rotations: ``(N, 4)`` quaternions x, y, z, w.
        scales: ``(N, 3)``.
        matrices: ``(N, 4, 4)``, local transforms at rest.
        names: of the nodes, ``""`` for none.
        visible: ``(N,)`` whether each is at rest; a node that is not hides what hangs on it.
    """

    parents: Int64
    levels: tuple[Int64, ...]
    translations: Float64
    rotations: Float64
    scales: Float64
    matrices: Float64
    names: tuple[str, ...]
    visible: Bool

    def world(self, local: Float64) -> Float64:
        """World transforms ``(N, 4, 4)`` from local ones."""
        world = local.copy()
        for level in self.levels[1:]:
            world[level] = world[self.parents[level]] @ local[level]
        return world

    def chain(self, node: int) -> list[int]:
        """A node and all those above it."""
        result = [node]
        while self.parents[result[-1]] >= 0:
            result.append(int(self.parents[result[-1]]))
        return result

    def below(self, moved: Bool) -> Bool:
        """Which nodes are moved ``(N,)`` themselves or hang on one that is."""
        result = moved.copy()
        for level in self.levels[1:]:
            result[level] |= result[self.parents[level]]
        return result


def read_nodes(document: Document) -> Nodes:
    """The nodes of a file; raises `ValueError` if they are no tree."""
    items = document.items("nodes")
    n = len(items)
    parents = np.full(n, -1, np.int64)
    for number, node in enumerate(items):
        for child in indices(node, "children", f"node {number}", n):
            if parents[child] >= 0:
                raise ValueError(f"node {child} hangs on nodes {parents[child]} and {number}; a node has one parent")
            parents[child] = number
    translations = np.empty((n, 3))
    rotations, scales, matrices = np.empty((n, 4)), np.empty((n, 3)), np.empty((n, 4, 4))
    for number, node in enumerate(items):
        where = f"node {number}"
        translations[number] = numbers(node, "translation", where, [0.0, 0.0, 0.0])
        rotations[number] = numbers(node, "rotation", where, [0.0, 0.0, 0.0, 1.0])
        scales[number] = numbers(node, "scale", where, [1.0, 1.0, 1.0])
        if "matrix" in node:
            matrices[number] = numbers(node, "matrix", where, [0.0] * 16).reshape(4, 4).T  # stored by columns
    composed = compose(translations, rotations, scales)
    is_composed = np.array(["matrix" not in node for node in items], bool)
    matrices[is_composed] = composed[is_composed]
    names = tuple(text(node, "name") for node in items)
    visible = np.array([is_visible(node, f"node {number}") for number, node in enumerate(items)], bool)
    return Nodes(parents, _levels(parents), translations, rotations, scales, matrices, names, visible)


def scene_order(document: Document, nodes: Nodes) -> list[int]:
    """The nodes of the scene that the file shows, each before its children, children in the order given."""
    items = document.items("nodes")
    pending = _roots(document, nodes)[::-1]
    order: list[int] = []
    is_met = np.zeros(len(items), bool)
    while pending:
        number = pending.pop()
        if is_met[number]:
            raise ValueError(f"node {number} is in the scene twice")
        is_met[number] = True
        order.append(number)
        pending += items[number].get("children", [])[::-1]
    return order


def _roots(document: Document, nodes: Nodes) -> list[int]:
    scenes = document.items("scenes")
    if not scenes:
        return [int(number) for number in np.flatnonzero(nodes.parents < 0)]
    chosen = document.tree.get("scene", 0)
    if not isinstance(chosen, int) or not 0 <= chosen < len(scenes):
        raise ValueError(f"its scene is {chosen!r}, but there are scenes 0 to {len(scenes) - 1}")
    scene: Json = scenes[chosen]
    return indices(scene, "nodes", f"scene {chosen}", len(nodes.parents))


def _levels(parents: Int64) -> tuple[Int64, ...]:
    """All nodes by depth; raises `ValueError` for a circle."""
    order = np.argsort(parents, kind="stable")
    starts = np.searchsorted(parents[order], np.arange(-1, len(parents) + 1))
    levels = []
    level = order[: starts[1]] if len(parents) else order
    n_met = 0
    while len(level):
        levels.append(level)
        n_met += len(level)
        first, stop = starts[level + 1], starts[level + 2]
        counts = stop - first
        level = order[np.repeat(first - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())]
    if n_met < len(parents):
        raise ValueError(f"{len(parents) - n_met} of its nodes are their own ancestors; nodes must be a tree")
    return tuple(levels)


def compose(translations: Float64, rotations: Float64, scales: Float64) -> Float64:
    """Transforms ``(..., 4, 4)`` from translations ``(..., 3)``, quaternions ``(..., 4)`` and scales ``(..., 3)``."""
    x, y, z, w = np.moveaxis(rotations, -1, 0)
    result = np.zeros((*x.shape, 4, 4))
    result[..., 0, 0] = 1 - 2 * (y * y + z * z)
    result[..., 0, 1] = 2 * (x * y - z * w)
    result[..., 0, 2] = 2 * (x * z + y * w)
    result[..., 1, 0] = 2 * (x * y + z * w)
    result[..., 1, 1] = 1 - 2 * (x * x + z * z)
    result[..., 1, 2] = 2 * (y * z - x * w)
    result[..., 2, 0] = 2 * (x * z - y * w)
    result[..., 2, 1] = 2 * (y * z + x * w)
    result[..., 2, 2] = 1 - 2 * (x * x + y * y)
    result[..., :3, :3] *= scales[..., None, :]
    result[..., :3, 3] = translations
    result[..., 3, 3] = 1
    return result


def normalized(vectors: Float64) -> Float64:
    """Vectors ``(..., n)`` of length 1; those of length 0 stay."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    result: Float64 = vectors / np.where(length > 0, length, 1)
    return result
