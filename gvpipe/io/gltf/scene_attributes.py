"""A scene's attributes: those of its blocks, moved as the blocks are, and joined."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.gltf.accessors import as_fractions
from gvpipe.io.gltf.poses import Placed
from gvpipe.io.gltf.scene import Scene
from gvpipe.io.gltf.vectors import move_normals, move_tangents, smooth_normals


def scene_attributes(scene: Scene) -> dict[str, Array]:
    """Arrays ``(V, C)`` by name, of all blocks together.

    Normals and tangents are those at the clip's start. What a block lacks is 0. It is white if it is a colour, and the
    surface's own if it is a normal.
    """
    placed = scene.placed
    moved = []
    for one, turns in zip(placed, scene.linear, strict=True):
        arrays = dict(one.block.attributes)
        if "normal" in arrays:
            arrays["normal"] = move_normals(_morphed_normals(one), turns)
        if "tangent" in arrays:
            arrays["tangent"] = move_tangents(arrays["tangent"], turns)
        moved.append(arrays)
    names = dict.fromkeys(name for arrays in moved for name in arrays)
    sizes = [len(one.block.positions) for one in placed]
    joined = {name: _join(name, [arrays.get(name) for arrays in moved], sizes) for name in names}
    _add_normals(joined, scene)
    return joined


def attribute_names(scene: Scene) -> list[str]:
    """Names of the scene's attributes."""
    return list(dict.fromkeys(name for one in scene.placed for name in one.block.attributes))


def _morphed_normals(one: Placed) -> Array:
    """A block's normals with its morph targets at rest."""
    normals = one.block.attributes["normal"]
    for morph, weight in zip(one.block.morphs, one.weights, strict=False):
        if weight and morph.normals is not None:
            normals = normals.astype(np.float32)  # a copy
            normals[slice(None) if morph.turned is None else morph.turned] += np.float32(weight) * morph.normals
    return normals


def _join(name: str, blocks: list[Array | None], sizes: list[int]) -> Array:
    there = [block for block in blocks if block is not None]
    dtypes = {block.dtype for block in there}
    is_color = name.startswith("color")
    if len(dtypes) > 1:
        blocks = [None if block is None else as_fractions(block) if is_color else block.astype(np.float32) for block in blocks]
    dtype: np.dtype[Any] = dtypes.pop() if len(dtypes) == 1 else np.dtype(np.float32)
    full = 1 if dtype.kind == "f" else np.iinfo(dtype).max
    width = max(block.shape[1] for block in there)
    result = np.full((sum(sizes), width), full if is_color else 0, dtype)
    start = 0
    for block, size in zip(blocks, sizes, strict=True):
        if block is not None:
            result[start : start + size, : block.shape[1]] = block
        start += size
    return result


def _add_normals(attributes: dict[str, Array], scene: Scene) -> None:
    lacking = [one for one in scene.placed if "normal" not in one.block.attributes]
    if "normal" not in attributes or not lacking:
        return
    computed = smooth_normals(scene.poses.at(np.array([scene.clip.start]))[0], scene.faces)
    for one in lacking:
        span = slice(one.start, one.start + len(one.block.positions))
        attributes["normal"][span] = computed[span]
