"""Welded points: vertices that share a trajectory, as those along seams and of triangle soups do."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float32, Int64
from gvpipe.mesh.topology import components
from gvpipe.model.sequence import MeshSequence
from gvpipe.runtime.ahead import AHEAD

ROUNDS = 64  # groups that leave a group one by one, in one chunk; what is left then is compared exactly
NEAREST = 8  # distinct positions searched around each, itself among them


def find_points(sequence: MeshSequence, tolerance: float = 0.0) -> Int64:
    """Return ``(V,)`` the point of each vertex, 0..P-1, numbered as their first vertices are.

    Vertices of one point start at one position, or within the tolerance of others of it. They stay within the tolerance of the
    point's first vertex, or within twice the tolerance if they leave another vertex together in a later chunk. Vertices with
    one trajectory are always one point.

    Args:
        sequence: the animation.
        tolerance: largest distance, model units.
    """
    groups = _group_nearby(sequence.read(0, 1)[0], tolerance)
    shared = np.flatnonzero(np.bincount(groups)[groups] > 1)  # vertices that are not alone
    for _, block in sequence.chunks():
        if not len(shared):
            break
        groups[shared] = _split(block[:, shared], groups[shared], tolerance, int(groups.max()) + 1)
        shared = shared[np.bincount(groups)[groups[shared]] > 1]
    _, first, number = np.unique(groups, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[number.ravel()], np.int64)


def _group_nearby(positions: Float32, tolerance: float) -> Int64:
    """A number for each of ``positions (n, 3)``, equal where they are, and where positions within the tolerance join them."""
    groups = _group_equal(positions)
    if not tolerance > 0:
        return groups
    from scipy import sparse
    from scipy.spatial import KDTree

    distinct = positions[np.unique(groups, return_index=True)[1]].astype(np.float64)
    found = KDTree(distinct).query(distinct, k=np.arange(1, min(NEAREST, len(distinct)) + 1), workers=AHEAD)
    distance, other = np.asarray(found[0]), np.asarray(found[1])
    start, end = np.nonzero(distance <= tolerance)
    links = sparse.csr_array((np.ones(len(start)), (start, other[start, end])), shape=(len(distinct),) * 2)
    return np.asarray(components(sparse.csr_array(links + links.T))[1][groups], np.int64)


def _split(frames: Float32, groups: Int64, tolerance: float, free: int) -> Int64:
    """Groups ``(n,)`` of vertices that also stay together in ``frames (F, n, 3)``; new ones are numbered from ``free``."""
    groups = groups.copy()
    left = np.arange(len(groups))
    for _ in range(ROUNDS):
        _, leader, member = np.unique(groups[left], return_index=True, return_inverse=True)
        apart = frames[:, left].astype(np.float64) - frames[:, left[leader]][:, member.ravel()]
        left = left[np.square(apart).sum(axis=2).max(axis=0) > tolerance**2]
        if not len(left):
            return groups
        together = np.unique(groups[left], return_inverse=True)[1].ravel()  # those that leave one group together stay together
        groups[left] = free + together
        free += int(together.max()) + 1
    own = _group_equal(np.ascontiguousarray(frames[:, left].swapaxes(0, 1)).reshape(len(left), -1))
    pair = np.unique(np.stack([groups[left], own], axis=1), axis=0, return_inverse=True)[1]
    groups[left] = free + pair.ravel()
    return groups


def _group_equal(vectors: Float32) -> Int64:
    """A number for each of ``vectors (n, m)``, equal where they are; minus zero is zero."""
    keys = np.ascontiguousarray(vectors + np.float32(0))
    return np.asarray(
        np.unique(keys.view(np.dtype((np.void, 4 * keys.shape[1]))).ravel(), return_inverse=True)[1], np.int64
    ).ravel()
