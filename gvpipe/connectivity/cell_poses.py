"""How a cell may stand on a face: for each type, which of its nodes are the face's, and which are the others."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int64
from gvpipe.grids.cells import SIZES, VOLUMES

KINDS = (10, 12, 13, 14)  # tetrahedra, hexahedra, wedges, pyramids: VTK's numbers
MOST_POSES, MOST_NODES, MOST_FACES = 24, 8, 6


class Poses(NamedTuple):
    """Tables by kind (an index into `KINDS`) and by corners of the face less 3; kernels take them as they are. int64.

    Args:
        nodes: ``(4, 2, 24, 8)`` of each pose, the nodes of the face in order, seen from outside, then the others.
        counts: ``(4, 2)`` number of poses.
        alike: ``(4, 2, 24)`` the first pose that differs in the cell's numbers alone.
        sizes: ``(4,)`` nodes of a cell.
        edges: ``(4, 8, 8)`` 1 for nodes with an edge between them.
        faces: ``(4, 6, 4)`` nodes of the faces, seen from outside.
        face_sizes: ``(4, 6)`` their corners; 0 behind the last.
    """

    nodes: Int64
    counts: Int64
    alike: Int64
    sizes: Int64
    edges: Int64
    faces: Int64
    face_sizes: Int64


def make_poses() -> Poses:
    """The tables."""
    made = Poses(
        np.zeros((len(KINDS), 2, MOST_POSES, MOST_NODES), np.int64),
        np.zeros((len(KINDS), 2), np.int64),
        np.zeros((len(KINDS), 2, MOST_POSES), np.int64),
        np.array([SIZES[kind] for kind in KINDS], np.int64),
        np.zeros((len(KINDS), MOST_NODES, MOST_NODES), np.int64),
        np.zeros((len(KINDS), MOST_FACES, 4), np.int64),
        np.zeros((len(KINDS), MOST_FACES), np.int64),
    )
    for number, kind in enumerate(KINDS):
        faces = VOLUMES[kind]
        looks: dict[tuple[int, frozenset[frozenset[int]]], int] = {}
        for f, face in enumerate(faces):
            made.faces[number, f, : len(face)], made.face_sizes[number, f] = face, len(face)
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                made.edges[number, a, b] = made.edges[number, b, a] = 1
        for face in faces:
            for turn in range(len(face)):
                front = face[turn:] + face[:turn]
                others = [node for node in range(SIZES[kind]) if node not in front]
                near = {node: [i for i, each in enumerate(front) if made.edges[number, node, each]] for node in others}
                nodes = (*front, *sorted(others, key=near.__getitem__))
                size = len(face) - 3
                pose = int(made.counts[number, size])
                made.nodes[number, size, pose, : len(nodes)] = nodes
                look = size, frozenset(frozenset(nodes.index(node) for node in each) for each in faces)
                made.alike[number, size, pose] = looks.setdefault(look, pose)
                made.counts[number, size] += 1
    return made
