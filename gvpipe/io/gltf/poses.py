"""Vertices of a scene at any times: morph targets, then skins or nodes, evaluated for a bounded number of frames at once.

A vertex of a skinned mesh is moved by the mean of its joints' transforms. The means of all vertices and frames are a product: a
sparse matrix (vertices x joints) times the joints' transforms. A skinned mesh ignores its own node, as the specification says.

Source: Khronos, glTF 2.0 specification, sections 3.7.2.2 (morph targets), 3.7.3 (skins) and 3.11 (animations).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Bool, Float32, Float64, Int64
from gvpipe.io.gltf.clips import Clip
from gvpipe.io.gltf.geometry import Block
from gvpipe.io.gltf.nodes import Nodes, compose
from gvpipe.io.gltf.skins import Skin
from gvpipe.io.scene.hiding import collapse

BLOCK_BYTES = 32 << 20  # transforms and positions worked on at a time
BYTES_MATRIX = 128  # 4 x 4 float64


@dataclass(frozen=True, eq=False)
class Placed:
    """A block of vertices where a node shows it.

    Args:
        node: that shows it.
        block: the vertices, V of them.
        skin: or None.
        weights: ``(M,)`` of the morph targets at rest.
        start: number of its first vertex in the scene.
        instance: ``(4, 4)`` what is done before the node's transform, of a mesh that is repeated; None: nothing.
    """

    node: int
    block: Block
    skin: Skin | None
    weights: Float64
    start: int
    instance: Float64 | None = None


class Poses:
    """The scene's vertices, posed.

    Args:
        nodes: of the file.
        clip: what moves them.
        placed: the blocks of vertices, which follow each other.
    """

    def __init__(self, nodes: Nodes, clip: Clip, placed: list[Placed]) -> None:
        self._nodes, self._clip, self._placed = nodes, clip, placed
        self._rest = nodes.world(nodes.matrices)
        self._tracks = _Tracks(nodes, clip, self._rest, _needed(nodes, placed))
        self._skins = [None if one.skin is None else _influence_matrix(one) for one in placed]
        self._is_hidden = {node: hidden for node in {one.node for one in placed} if (hidden := find_hidden(nodes, clip, node))}
        self.n_vertices = placed[-1].start + len(placed[-1].block.positions)
        skinned = max((len(one.block.positions) for one in placed if one.skin), default=0)
        self._bytes_frame = BYTES_MATRIX * (len(nodes.parents) + skinned) + 48 * self.n_vertices

    def at(self, times: Float64) -> Float64:
        """Positions ``(n, V, 3)`` in world space at times ``(n,)``, seconds of the clip."""
        result = np.empty((len(times), self.n_vertices, 3))
        step = max(1, BLOCK_BYTES // self._bytes_frame)
        for first in range(0, len(times), step):
            self._fill(times[first : first + step], result[first : first + step])
        return result

    def as_stored(self) -> Float32 | None:
        """Positions ``(V, 3)`` as the file has them, None if anything moves them."""
        moves = (
            self._tracks.count
            or self._is_hidden
            or one.skin
            or one.weights.any()
            or one.instance is not None
            or not _is_identity(self._rest[one.node])
            for one in self._placed
        )
        morphs = any((one.node, "weights") in self._clip.curves for one in self._placed)
        if morphs or any(moves):
            return None
        return np.concatenate([one.block.positions for one in self._placed])

    def linear(self, time: float) -> list[Float64]:
        """What turns each block's vectors at a time: ``(3, 3)``, or ``(V, 3, 3)`` of a skin."""
        world = self._tracks.world(np.array([time]))
        return [
            _placing(one, world)[0, :3, :3] if one.skin is None else self._blended(one, i, world)[:, 0, :, :3]
            for i, one in enumerate(self._placed)
        ]

    def morph_weights(self, one: Placed, times: Float64) -> Float64:
        """Weights ``(n, M)`` of a block's morph targets."""
        curve = self._clip.curves.get((one.node, "weights"))
        n_morphs = len(one.block.morphs)
        if curve is None:
            return np.tile(one.weights[:n_morphs], (len(times), 1))
        return curve.at(times)[:, :n_morphs]

    def _fill(self, times: Float64, out: Float64) -> None:
        world = self._tracks.world(times)
        for i, one in enumerate(self._placed):
            span = out[:, one.start : one.start + len(one.block.positions)]
            span[:] = one.block.positions
            with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is refused later
                self._morph(one, times, span)
                if one.skin is not None:
                    blended = self._blended(one, i, world).transpose(1, 0, 2, 3)  # (n, V, 3, 4)
                    span[:] = np.einsum("nvij,nvj->nvi", blended[..., :3], span) + blended[..., 3]
                else:
                    matrices = _placing(one, world)
                    if len(matrices) > 1 or not _is_identity(matrices[0]):  # float32 passes exactly where nothing moves it
                        span[:] = span @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]
                if one.node in self._is_hidden:
                    collapse(span, self._is_hidden[one.node](times))

    def _morph(self, one: Placed, times: Float64, span: Float64) -> None:
        if not one.block.morphs:
            return
        weights = self.morph_weights(one, times)
        for number in np.flatnonzero(weights.any(axis=0)):
            morph = one.block.morphs[number]
            for frame in np.flatnonzero(weights[:, number]):
                if morph.vertices is None:
                    span[frame] += weights[frame, number] * morph.positions
                else:
                    span[frame, morph.vertices] += weights[frame, number] * morph.positions

    def _blended(self, one: Placed, number: int, world: _World) -> Float64:
        """The transforms ``(V, n, 3, 4)`` of a skinned block's vertices."""
        assert one.skin is not None
        joints = np.stack([world.of(int(joint)) for joint in one.skin.joints])  # (J, 1 or n, 4, 4)
        palette = (joints @ one.skin.inverse_binds[:, None])[:, :, :3]
        matrix: Any = self._skins[number]
        product = matrix @ palette.reshape(len(palette), -1)
        return np.asarray(product.reshape(len(one.block.positions), -1, 3, 4))


def find_hidden(nodes: Nodes, clip: Clip, node: int) -> Callable[[Float64], Bool] | None:
    """What says at which times ``(n,)`` a node is hidden, itself or by one above it; None if it never is."""
    chain = nodes.chain(node)
    curves = [clip.curves[one, "visible"] for one in chain if (one, "visible") in clip.curves]
    is_off = any(not nodes.visible[one] for one in chain if (one, "visible") not in clip.curves)
    if not curves and not is_off:
        return None

    def at(times: Float64) -> Bool:
        hidden = np.full(len(times), is_off)
        for curve in curves:
            hidden |= curve.at(times)[:, 0] < 0.5
        return hidden

    return at


def _placing(one: Placed, world: _World) -> Float64:
    """``(1 or n, 4, 4)`` that take a block without a skin to the world."""
    matrices = world.of(one.node)
    return matrices if one.instance is None else np.asarray(matrices @ one.instance)


class _World:
    """World transforms of nodes at n times.

    Args:
        moving: ``(A, n, 4, 4)`` of those that move.
        rows: ``(N,)`` row in ``moving`` of each node, -1 for none.
        rest: ``(N, 4, 4)`` of the others.
    """

    def __init__(self, moving: Float64, rows: Int64, rest: Float64) -> None:
        self._moving, self._rows, self._rest = moving, rows, rest

    def of(self, node: int) -> Float64:
        """``(n, 4, 4)`` of a node; ``(1, 4, 4)`` if nothing of the scene moves."""
        row = self._rows[node]
        if row < 0:
            return np.broadcast_to(self._rest[node], (self._moving.shape[1], 4, 4))
        return np.asarray(self._moving[row])


class _Tracks:
    """World transforms of the nodes that a clip moves, A of them."""

    def __init__(self, nodes: Nodes, clip: Clip, rest: Float64, needed: Bool) -> None:
        animated = np.zeros(len(nodes.parents), bool)
        animated[[node for node, path in clip.curves if path != "weights"]] = True
        moving = nodes.below(animated) & needed
        self._nodes, self._clip, self._rest = nodes, clip, rest
        self._members = np.flatnonzero(moving)
        self._rows = np.full(len(nodes.parents), -1, np.int64)
        self._rows[self._members] = np.arange(len(self._members))
        self._animated = [int(node) for node in self._members if animated[node]]
        self._levels = [level[moving[level]] for level in nodes.levels if moving[level].any()]
        self.count = len(self._members)

    def world(self, times: Float64) -> _World:
        """Their world transforms at times ``(n,)``."""
        n = len(times) if self.count else 1
        local = np.empty((self.count, n, 4, 4))
        local[:] = self._nodes.matrices[self._members][:, None]
        for node in self._animated:
            local[self._rows[node]] = self._local(node, times)
        for level in self._levels:
            rows, parents = self._rows[level], self._nodes.parents[level]
            above = self._rows[parents]
            is_moved = (parents >= 0) & (above >= 0)
            is_fixed = (parents >= 0) & ~is_moved
            local[rows[is_moved]] = local[above[is_moved]] @ local[rows[is_moved]]
            local[rows[is_fixed]] = self._rest[parents[is_fixed]][:, None] @ local[rows[is_fixed]]
        return _World(local, self._rows, self._rest)

    def _local(self, node: int, times: Float64) -> Float64:
        rest = {"translation": self._nodes.translations, "rotation": self._nodes.rotations, "scale": self._nodes.scales}
        values = []
        for path, at_rest in rest.items():
            curve = self._clip.curves.get((node, path))
            values.append(np.broadcast_to(at_rest[node], (len(times), at_rest.shape[1])) if curve is None else curve.at(times))
        return compose(values[0], values[1], values[2])


def _needed(nodes: Nodes, placed: list[Placed]) -> Bool:
    """The nodes that show meshes or are joints, and all those above them."""
    result = np.zeros(len(nodes.parents), bool)
    for one in placed:
        result[one.node] = True
        if one.skin is not None:
            result[one.skin.joints] = True
    for level in nodes.levels[:0:-1]:
        result[nodes.parents[level[result[level]]]] = True
    return result


def _influence_matrix(one: Placed) -> Any:
    """The sparse matrix of skinning weights, ``(V, J)``."""
    from scipy.sparse import csr_array

    joints, weights = one.block.joints, one.block.weights
    assert joints is not None and weights is not None and one.skin is not None
    n_joints = len(one.skin.joints)
    used = joints[weights != 0]
    if len(used) and used.max() >= n_joints:
        raise ValueError(f"node {one.node} shows a mesh that uses joint {used.max()}, but its skin has {n_joints}")
    rows = np.repeat(np.arange(len(joints)), joints.shape[1])
    columns = np.where(weights != 0, joints, 0).reshape(-1)
    return csr_array((weights.reshape(-1), (rows, columns)), shape=(len(joints), n_joints))


def _is_identity(matrix: Float64) -> bool:
    return bool(np.array_equal(matrix, np.eye(4)))
