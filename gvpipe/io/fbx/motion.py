"""How the meshes of an FBX scene move: ufbx evaluates the scene at a time, once for all its meshes."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.arrays import Array, Float64
from gvpipe.io.fbx.library import hold, listed, numbers


class Evaluator:
    """A scene at the time that was asked for last.

    Args:
        ufbx: the library.
        scene: as loaded.
        anim: the take's animation.
    """

    def __init__(self, ufbx: Any, scene: Any, anim: Any) -> None:
        self._ufbx, self._scene, self._anim = ufbx, scene, anim
        self._time: float | None = None
        self._now: Any = None
        self._nodes: list[Any] = []

    def node(self, index: int, time: float) -> Any:
        """A node of the scene at a time, seconds; it is valid until another time is asked for."""
        if self._time != time:
            if self._now is not None:
                self._nodes, self._time = [], None
                self._now.free()
            options = {"evaluate_skinning": True, "evaluate_caches": True}
            self._now = hold(self._ufbx.evaluate_scene(self._scene, self._anim, time, **options))
            self._nodes, self._time = listed(self._now.nodes), time
        return self._nodes[index]


class FbxMotion:
    """How one node's mesh moves; see `gvpipe.io.scene_frames.Motion`.

    Args:
        evaluator: of its scene.
        index: of the node.
        node: as loaded.
        moves: whether anything may change over time.
    """

    def __init__(self, evaluator: Evaluator, index: int, node: Any, moves: bool) -> None:
        self._evaluator, self.index, self.moves = evaluator, index, moves
        self.name = str(node.name)
        self.n_vertices = int(hold(node.mesh).num_vertices)

    def at(self, time: float) -> Array:
        """Positions ``(n, 3)`` in world space."""
        node = self._evaluator.node(self.index, time)
        mesh = hold(node.mesh)
        positions = numbers(hold(mesh.skinned_position).values, np.float64).reshape(-1, 3)
        return to_world(node, positions) if mesh.skinned_is_local else positions

    def normals(self, time: float) -> tuple[Array, Array] | None:
        """Unit normals ``(N, 3)`` in world space and the index of each corner's, or None."""
        node = self._evaluator.node(self.index, time)
        mesh = hold(node.mesh)
        held = hold(mesh.skinned_normal)
        if not held.exists:
            return None
        values = numbers(held.values, np.float64).reshape(-1, 3)
        if mesh.skinned_is_local:
            turn = np.linalg.pinv(linear(node)).T
            values = values @ turn.T
        length = np.linalg.norm(values, axis=1, keepdims=True)
        unit = np.where(length > 0, values / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
        return unit.astype(np.float32), numbers(held.indices, np.int64)


def linear(node: Any) -> Float64:
    """``(3, 3)`` the part of a node's transform that turns and scales."""
    return _columns(node)[:3].T


def to_world(node: Any, positions: Array) -> Array:
    """Positions ``(n, 3)`` of a node's geometry in world space."""
    columns = _columns(node)
    return np.asarray(positions @ columns[:3] + columns[3])


def _columns(node: Any) -> Float64:
    """``(4, 3)`` the columns of a node's transform."""
    return np.array(hold(node.geometry_to_world), np.float64)
