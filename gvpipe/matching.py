"""Which vertex is which, when a sequence came back with its vertices in another order (`--reorder`).

A first guess pairs vertices whose paths through a few frames lie nearest. Where that is wrong, the triangles tell: if the
corners a and b of a triangle (a, b, c) are paired, c must be the third corner of the reference's triangle over the same directed
edge. Vertices follow the votes of their triangles until the triangles agree.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import cKDTree

from gvpipe.sequence import Int32, MeshSequence

FRAMES = 8  # evenly spaced frames whose positions make a vertex' path
ROUNDS = 50
OWN_VOTE = 0.5  # of the present pairing, against one per triangle

Index = NDArray[np.intp]


def match_vertices(reference: MeshSequence, distorted: MeshSequence) -> Index | None:
    """Return ``(V,)`` the reference's vertex for each vertex of ``distorted``, or None if no pairing makes the triangles agree.

    Both must have equal numbers of frames, vertices and triangles.
    """
    wanted = canonical_triangles(reference.faces)
    pairing = _nearest_paths(reference, distorted)
    for _ in range(ROUNDS):
        if np.array_equal(canonical_triangles(pairing[distorted.faces]), wanted):
            break
        pairing = _follow_votes(pairing, reference.faces, distorted.faces)
    else:
        return None
    return pairing if len(np.unique(pairing)) == len(pairing) else None


def canonical_triangles(faces: NDArray[np.integer]) -> NDArray[np.integer]:
    """Triangles turned so that the smallest index leads (winding kept), in lexicographic order."""
    turn = (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3 if len(faces) else np.zeros((0, 3), np.intp)
    turned = np.take_along_axis(faces, turn, axis=1)
    return turned[np.lexsort(turned.T[::-1])]


def _nearest_paths(reference: MeshSequence, distorted: MeshSequence) -> Index:
    picked = np.unique(np.linspace(0, reference.n_frames - 1, FRAMES).astype(int)).tolist()
    ours, theirs = (
        np.concatenate([s.read(i, i + 1)[0] for i in picked], axis=1).astype(np.float64) for s in (reference, distorted)
    )
    # points that always coincide are told apart by their number among equals, on both sides alike
    near = cKDTree(ours).query(theirs, k=1)[1]
    same = np.unique(ours, axis=0, return_inverse=True)[1].ravel()
    order, at = np.argsort(same, kind="stable"), np.argsort(same[near], kind="stable")
    pairing = near.copy()
    if np.array_equal(same[order], same[near][at]):
        pairing[at] = order
    return pairing.astype(np.intp)


def _follow_votes(pairing: Index, ours: Int32, theirs: Int32) -> Index:
    n = len(pairing)
    edges, third = _directed_edges(ours, n)
    by_edge = np.argsort(edges)
    edges, third = edges[by_edge], third[by_edge]
    asked, corner = _directed_edges(pairing[theirs], n)[0], theirs[:, [2, 0, 1]].T.ravel()
    at = np.minimum(np.searchsorted(edges, asked), len(edges) - 1)
    found = edges[at] == asked
    rows, columns = np.concatenate([corner[found], np.arange(n)]), np.concatenate([third[at[found]], pairing])
    weights = np.concatenate([np.ones(int(found.sum())), np.full(n, OWN_VOTE)])
    votes = sparse.csr_array((weights, (rows, columns)), shape=(n, n))
    return np.asarray(votes.argmax(axis=1), np.intp)


def _directed_edges(faces: NDArray[np.integer], n_vertices: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Keys of the directed edges ``(3T,)``, and the corner opposite each."""
    start, end, third = (faces[:, turn].T.ravel().astype(np.int64) for turn in ([0, 1, 2], [1, 2, 0], [2, 0, 1]))
    return start * n_vertices + end, third
