"""Meshes that take turns: at each frame those of one group are shown, and the others hidden, as captures in glTF files are.

A mesh is hidden where KHR_node_visibility says so, or where the scale of its node, or of one above it, is 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64
from gvpipe.io.gltf.clips import Clip
from gvpipe.io.gltf.nodes import Nodes
from gvpipe.io.gltf.poses import find_hidden


@dataclass(frozen=True, eq=False)
class Turns:
    """Which meshes are shown when.

    Args:
        times: ``(F,)`` seconds of the frames.
        groups: ``(M,)`` the group of each mesh; -1: it is never shown.
        shown: ``(F,)`` the group of each frame.
    """

    times: Float64
    groups: tuple[int, ...]
    shown: tuple[int, ...]

    def run(self, first: int, stop: int) -> int:
        """The frame, up to ``stop``, before which the turn of the first frame's group ends."""
        return next((frame for frame in range(first, stop) if self.shown[frame] != self.shown[first]), stop)


def find_turns(nodes: Nodes, clip: Clip, meshes: list[int], times: Float64) -> Turns | None:
    """Return whose turn it is at each frame; None if meshes of two groups are ever shown together, or there is one group.

    Args:
        nodes: of the file.
        clip: what moves them.
        meshes: the node of each mesh.
        times: ``(F,)`` seconds of the frames.
    """
    known: dict[int, bytes] = {}
    for node in set(meshes):
        known[node] = (~_hidden(nodes, clip, node, times)).tobytes()
    groups: dict[bytes, int] = {}
    for pattern in dict.fromkeys(known[node] for node in meshes):
        if any(pattern):
            groups[pattern] = len(groups)
    if len(groups) < 2:
        return None
    shown: Bool = np.stack([np.frombuffer(pattern, bool) for pattern in groups])  # (G, F)
    if not (shown.sum(axis=0) == 1).all():
        return None
    return Turns(times, tuple(groups.get(known[node], -1) for node in meshes), tuple(shown.argmax(axis=0).tolist()))


def _hidden(nodes: Nodes, clip: Clip, node: int, times: Float64) -> Bool:
    """``(F,)`` whether a node is hidden."""
    switched = find_hidden(nodes, clip, node)
    hidden: Bool = np.zeros(len(times), bool) if switched is None else switched(times)
    for one in nodes.chain(node):
        curve = clip.curves.get((one, "scale"))
        if curve is not None:
            hidden = hidden | (curve.at(times) == 0).all(axis=1)
        elif not nodes.scales[one].any():
            hidden = np.ones(len(times), bool)
    return hidden
