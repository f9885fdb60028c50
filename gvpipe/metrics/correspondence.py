"""Which vertex is which, when a sequence came back with its vertices in another order (`--reorder`).

Vertices of the reference that always coincide are one *point*. A first guess gives every vertex the point whose path through a
few frames lies nearest. Where that is wrong, triangles correct it. Once the corners a and b of a triangle (a, b, c) have their
points, c must be the third corner of the reference's triangle over the same directed edge. Vertices follow the votes of their
triangles until the triangles agree. Triangles over equal points are then paired, and with them their corners.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from gvpipe.foundation.arrays import Bool, Float64, Int32, Int64, Integers
from gvpipe.mesh.unique_rows import row_ids, smallest_first
from gvpipe.model.sequence import MeshSequence

FRAMES = 24  # evenly spaced frames whose positions make a vertex' path
ROUNDS = 50
OWN_VOTE = 0.5  # of the present point, against one per triangle

Index = NDArray[np.intp]


def match_vertices(reference: MeshSequence, distorted: MeshSequence) -> Index | None:
    """Return ``(V,)`` the reference's vertex for each vertex of ``distorted``, or None if no pairing makes the triangles agree.

    Both must have equal numbers of frames, vertices and triangles.
    """
    ours, theirs = _paths(reference), _paths(distorted, distorted.origin - reference.origin)
    first, point = np.unique(ours, axis=0, return_index=True, return_inverse=True)[1:]
    point = point.ravel()
    guess = np.asarray(cKDTree(ours[first]).query(theirs)[1], np.intp)
    wanted = canonical_triangles(point[reference.faces])
    for _ in range(ROUNDS):
        if np.array_equal(canonical_triangles(guess[distorted.faces]), wanted):
            return _pair_corners(point, reference.faces, guess, distorted.faces)
        guess = _follow_votes(guess, point[reference.faces], distorted.faces, len(first))
    return None


def canonical_triangles(faces: Integers) -> Integers:
    """Triangles turned so that the smallest index leads (winding kept), in lexicographic order."""
    turned: Integers = smallest_first(faces)
    return turned[np.lexsort(turned.T[::-1])]


def match_corners(faces: Integers, others: Integers) -> Int64:
    """Return ``(3T,)`` the corner of ``faces (T, 3)`` for each corner of ``others (T, 3)``.

    Both are the same triangles over the same vertices, in any order and rotation. Those that occur several times are paired in
    order.

    Examples:
        >>> match_corners(np.array([[0, 1, 2], [0, 2, 3]]), np.array([[2, 3, 0], [0, 1, 2]])).tolist()
        [4, 5, 3, 0, 1, 2]
    """
    result = np.empty((len(faces), 3), np.int64)
    (ours, turn), (theirs, other_turn) = _turned(faces), _turned(others)
    order, other = (np.lexsort(turned.T[::-1]) for turned in (ours, theirs))
    corners = 3 * order[:, None] + turn[order]
    result[other[:, None], other_turn[other]] = corners
    return result.reshape(-1)


def _paths(sequence: MeshSequence, shift: Float64 | float = 0.0) -> Float64:
    return (sequence.sample(FRAMES) + shift).swapaxes(0, 1).reshape(sequence.n_vertices, -1)


def _turned(faces: Integers) -> tuple[Integers, NDArray[np.intp]]:
    """Triangles ``(T, 3)`` from their smallest index on, and the column that each corner came from ``(T, 3)``."""
    turn = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3 if len(faces) else np.zeros((0, 3), np.intp)
    return np.take_along_axis(faces, turn, axis=1), turn


def _follow_votes(guess: Index, ours: Integers, theirs: Int32, n_points: int) -> Index:
    """One round; corners that already lie in the reference's triangles vote strongest."""
    agreeing = _occurs_in(guess[theirs], ours)
    triangles = np.bincount(theirs.ravel(), minlength=len(guess))
    good = np.bincount(theirs[agreeing].ravel(), minlength=len(guess))
    certainty = good / np.maximum(triangles, 1)
    edges, third = _directed_edges(ours, n_points)
    by_edge = np.argsort(edges)
    edges, third = edges[by_edge], third[by_edge]
    asked, _ = _directed_edges(guess[theirs], n_points)
    start, end, corner = (theirs[:, turn].T.ravel() for turn in ([0, 1, 2], [1, 2, 0], [2, 0, 1]))
    at = np.minimum(np.searchsorted(edges, asked), len(edges) - 1)
    found = edges[at] == asked
    weights = np.concatenate([(certainty[start] * certainty[end])[found], OWN_VOTE * certainty])
    rows, columns = np.concatenate([corner[found], np.arange(len(guess))]), np.concatenate([third[at[found]], guess])
    votes = sparse.csr_array((weights + 1e-9, (rows, columns)), shape=(len(guess), n_points))
    return np.asarray(votes.argmax(axis=1), np.intp).ravel()


def _occurs_in(faces: Integers, others: Integers) -> Bool:
    """Which triangles are among the others, ``(T,)``."""
    ids = row_ids(np.concatenate([smallest_first(others), smallest_first(faces)]))[0]
    return np.isin(ids[len(others) :], ids[: len(others)])


def _directed_edges(faces: Integers, n_points: int) -> tuple[Int64, Int64]:
    """Keys of the directed edges ``(3T,)``, and the corner opposite each."""
    start, end, third = (faces[:, turn].T.ravel().astype(np.int64) for turn in ([0, 1, 2], [1, 2, 0], [2, 0, 1]))
    return start * n_points + end, third


def _pair_corners(point: Index, ours: Int32, guess: Index, theirs: Int32) -> Index | None:
    """Pair vertices through triangles over equal points, then those that no triangle uses, in order; None if that fails."""
    paired = []
    for faces, where in ((ours, point), (theirs, guess)):
        turned, turn = _turned(where[faces])
        order = np.lexsort((*faces.T[::-1], *turned.T[::-1]))  # equal triangles of points: by vertex order
        paired.append(np.take_along_axis(faces, turn, axis=1)[order])
    pairing = np.full(len(guess), -1, np.intp)
    pairing[paired[1].ravel()] = paired[0].ravel()
    free, left = np.flatnonzero(pairing < 0), np.setdiff1d(np.arange(len(guess)), pairing)
    if len(free) != len(left):
        return None
    pairing[free[np.argsort(guess[free], kind="stable")]] = left[np.argsort(point[left], kind="stable")]
    agree = np.array_equal(canonical_triangles(pairing[theirs]), canonical_triangles(ours))
    return pairing if agree else None
