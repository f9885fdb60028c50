"""Polyhedra among the cells of a grid, by their faces: as VTK's files list them, or as its streams of faces.

A stream is, for each polyhedron, its number of faces, then for each face its number of corners and these.
Source: Kitware, VTK 9.7, vtkUnstructuredGrid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Int64

LEAST_CORNERS = 3
MOST_SHARED, LEAST_SHARED = 8, 1 << 16  # of a list of faces: times its corners, or of so many


@dataclass(frozen=True, eq=False)
class Polyhedra:
    """Faces of n polyhedra.

    Args:
        counts: ``(n,)`` how many faces each has.
        sizes: ``(S,)`` corners of each face, polyhedron after polyhedron.
        nodes: ``(K,)`` points, face after face.

    Raises:
        ValueError: counts that do not fit each other, or a face with less than three corners.
    """

    counts: Int64
    sizes: Int64
    nodes: Int64

    def __post_init__(self) -> None:
        if not (_are_bounds(self.counts, len(self.sizes)) and _are_bounds(self.sizes, len(self.nodes))):
            raise ValueError(f"its {len(self.counts)} polyhedra have other numbers of faces or corners than they say")
        if self.sizes.min(initial=LEAST_CORNERS) < LEAST_CORNERS:
            raise ValueError(f"a polyhedron has a face with {self.sizes.min()} corners")

    def select(self, rows: Int64) -> Polyhedra:
        """Some of them, in the order of ``rows``."""
        faces = ranges(_starts(self.counts)[rows], self.counts[rows])
        nodes = ranges(_starts(self.sizes)[faces], self.sizes[faces])
        return Polyhedra(self.counts[rows], self.sizes[faces], self.nodes[nodes])

    def renumbered(self, number: Int64) -> Polyhedra:
        """The same with point ``number[p]`` in place of p."""
        return Polyhedra(self.counts, self.sizes, number[self.nodes])

    def points(self) -> tuple[Int64, Int64]:
        """How many points each polyhedron has ``(n,)``, and these, each once, as they first occur, one after the other."""
        owners = np.repeat(np.repeat(np.arange(len(self.counts)), self.counts), self.sizes)
        _, firsts = np.unique(np.stack([owners, self.nodes], axis=1), axis=0, return_index=True)
        firsts.sort()
        return np.bincount(owners[firsts], minlength=len(self.counts)), self.nodes[firsts]

    def edges(self) -> Int64:
        """``(K, 2)`` pairs of points that follow each other around a face."""
        ends = np.cumsum(self.sizes)
        following = np.arange(1, len(self.nodes) + 1)
        following[ends - 1] = ends - self.sizes
        return np.stack([self.nodes, self.nodes[following]], axis=1)

    def streams(self) -> tuple[Int64, Int64]:
        """The mirror of `from_streams`: the streams, one after the other, and ``(n,)`` where each ends."""
        rows = np.insert(self.nodes, np.cumsum(self.sizes) - self.sizes, self.sizes)  # each face with its number of corners
        owners = np.repeat(np.arange(len(self.counts)), self.counts)
        per_cell = np.bincount(owners, self.sizes + 1, len(self.counts)).astype(np.int64)
        starts = np.cumsum(per_cell) - per_cell
        return np.insert(rows, starts, self.counts), np.cumsum(per_cell + 1)

    def equals(self, other: Polyhedra) -> bool:
        """Whether both are the same."""
        pairs = ((self.counts, other.counts), (self.sizes, other.sizes), (self.nodes, other.nodes))
        return all(np.array_equal(a, b) for a, b in pairs)


def join_polyhedra(pieces: list[Polyhedra]) -> Polyhedra:
    """Those of several grids, whose points are numbered together by now."""
    none = np.zeros(0, np.int64)
    return Polyhedra(
        np.concatenate([none, *(each.counts for each in pieces)]),
        np.concatenate([none, *(each.sizes for each in pieces)]),
        np.concatenate([none, *(each.nodes for each in pieces)]),
    )


def from_faces(offsets: Int64, faces: Int64, face_offsets: Int64, nodes: Int64) -> Polyhedra:
    """Polyhedra by numbers of faces, which several may share.

    Args:
        offsets: ``(n + 1,)`` bounds of each polyhedron's faces in ``faces``.
        faces: numbers of faces.
        face_offsets: ``(S + 1,)`` bounds of each face's corners in ``nodes``.
        nodes: points.

    Raises:
        ValueError: bounds that fall or end elsewhere, a number that is no face's.
    """
    for bounds, end in ((offsets, len(faces)), (face_offsets, len(nodes))):
        if not len(bounds) or bounds[0] < 0 or bounds[-1] > end or (bounds[1:] < bounds[:-1]).any():  # differences may wrap
            raise ValueError("the bounds of its polyhedra's faces do not rise, or end elsewhere")
    if len(faces) and not 0 <= int(faces.min()) <= int(faces.max()) < len(face_offsets) - 1:
        raise ValueError("a polyhedron has a face that is not there")
    own = faces[offsets[0] : offsets[-1]]
    sizes = np.diff(face_offsets)[own]
    if sizes.sum(dtype=np.float64) > MOST_SHARED * max(len(nodes), LEAST_SHARED):
        raise ValueError("many of its polyhedra share large faces; at most two can have each")
    return Polyhedra(np.diff(offsets), sizes, nodes[ranges(face_offsets[own], sizes)])


def from_streams(stream: Int64, starts: Int64, stops: Int64) -> Polyhedra:
    """Polyhedra whose streams lie between these bounds.

    Raises:
        ValueError: a stream ends before its faces do, or behind them.
    """
    if len(starts) and not (int(starts.min()) >= 0 and int(stops.max()) <= len(stream) and (starts < stops).all()):
        raise ValueError("the faces of its polyhedra end elsewhere")
    counts = stream[starts]
    at, found = starts + 1, []  # rows of polyhedron, rank, first corner, corners
    for rank in range(int(counts.max(initial=0))):
        active = np.flatnonzero(counts > rank)
        if (at[active] >= stops[active]).any():
            raise ValueError("the faces of its polyhedra are cut short")
        sizes = stream[at[active]]
        if (sizes < LEAST_CORNERS).any():
            raise ValueError(f"a polyhedron has a face with {sizes.min()} corners")
        if (sizes >= stops[active] - at[active]).any():  # before a sum, which may wrap
            raise ValueError("the faces of its polyhedra are cut short")
        found.append(np.stack([active, np.full(len(active), rank), at[active] + 1, sizes], axis=1))
        at[active] += sizes + 1
    if (at != stops).any():
        raise ValueError("the faces of its polyhedra end elsewhere")
    rows = np.concatenate([np.zeros((0, 4), np.int64), *found])
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    return Polyhedra(counts, rows[:, 3], stream[ranges(rows[:, 2], rows[:, 3])])


def ranges(starts: Int64, sizes: Int64) -> Int64:
    """Numbers from each start on, so many of each, one after the other."""
    return np.repeat(starts, sizes) + np.arange(sizes.sum()) - np.repeat(_starts(sizes), sizes)


def _are_bounds(sizes: Int64, end: int) -> bool:
    """Whether sizes are those of so many in all; sums of hostile ones wrap."""
    return bool(sizes.min(initial=0) >= 0 and sizes.max(initial=0) <= end and sizes.sum() == end)


def _starts(sizes: Int64) -> Int64:
    return np.asarray(np.cumsum(sizes) - sizes)
