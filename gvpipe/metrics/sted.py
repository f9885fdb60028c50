"""STED, the spatio-temporal edge difference, streamed over blocks of frames.

The eye notices how lengths around a vertex change rather than where the vertex is. STED therefore looks at relative length
differences of edges, and at how much they *vary* locally: a uniform change costs nothing.

Source: L. Vasa and V. Skala, A perception correlated comparison method for dynamic meshes, 2011. The paper was not at
hand: this follows second-hand descriptions, the four parameters are this module's own choice, and values are not
claimed to equal those printed in papers. See ``docs/metrics.md``.
"""

from __future__ import annotations

import math

import numpy as np
from scipy import sparse

from gvpipe.foundation.arrays import Float64, Int32

RING_DISTANCE = 1  # d: an edge belongs to vertex v if both its ends are at most this many edges from v
WINDOW = 5  # w: consecutive temporal edges whose deviation is taken together (6 frames: 0.2 s at 30 fps)
TIME_STEP = 0.002  # dt: length of the temporal edge of a vertex at rest, as a fraction of the diagonal
TEMPORAL_WEIGHT = 1.0  # c: weight of the temporal part beside the spatial part
SHORTEST = 1e-7  # edges below this fraction of the diagonal are rounding noise in float32 and are left out


class Sted:
    """Accumulates both parts of STED; blocks of frames are added in order.

    Args:
        edges: ``(E, 2)`` vertex indices, each edge once.
        n_vertices: V.
        diagonal: bounding-box diagonal of the reference's frame 0, model units.
    """

    def __init__(self, edges: Int32, n_vertices: int, diagonal: float) -> None:
        self._edges = edges
        self._diagonal = diagonal
        self._near = _edges_near_vertices(edges, n_vertices, RING_DISTANCE)
        self._spatial_sum, self._spatial_count = 0.0, 0
        self._temporal_sum, self._temporal_count = 0.0, 0
        self._identical = True
        self._last: tuple[Float64, Float64] | None = None  # the previous frame of each side, (V, 1, 3)
        self._pending: Float64 = np.zeros((3, n_vertices, 0))  # weight moments of the last < WINDOW temporal edges

    def add(self, a: Float64, b: Float64) -> None:
        """Take the next frames: reference ``a`` and distorted ``b``, ``(n, V, 3)``, model units."""
        self._identical &= bool(np.array_equal(a, b))
        a, b = (np.ascontiguousarray(side.transpose(1, 0, 2)) for side in (a, b))  # (n, V, 3) -> (V, n, 3)
        self._add_spatial(a, b)
        self._add_temporal(a, b)

    def spatial(self) -> float | None:
        """Mean over vertices and frames of the weighted deviation of relative edge-length differences."""
        return self._spatial_sum / self._spatial_count if self._spatial_count else None

    def temporal(self) -> float | None:
        """The same over windows of temporal edges; a sequence of one frame has none, so 0."""
        if self._diagonal == 0:
            return 0.0 if self._identical else None
        if self._temporal_count:
            return self._temporal_sum / self._temporal_count
        if self._pending.shape[2] == 0:
            return 0.0
        return float(_deviation(self._pending.sum(axis=2)).mean())  # fewer temporal edges than a window: all of them

    def combined(self) -> float | None:
        """Both parts together: ``sqrt(s^2 + c^2 t^2)``."""
        spatial, temporal = self.spatial(), self.temporal()
        if spatial is None or temporal is None:
            return None
        return math.hypot(spatial, TEMPORAL_WEIGHT * temporal)

    def _add_spatial(self, a: Float64, b: Float64) -> None:
        length, other = (_lengths(side[self._edges[:, 0]] - side[self._edges[:, 1]]) for side in (a, b))  # (E, n)
        length[length <= SHORTEST * self._diagonal] = 0.0
        moments = np.stack([self._near @ moment for moment in _moments(length, other)])  # (3, V, n)
        counted = moments[0] > 0
        self._spatial_sum += float(_deviation(moments[:, counted]).sum())
        self._spatial_count += int(counted.sum())

    def _add_temporal(self, a: Float64, b: Float64) -> None:
        if self._diagonal == 0:
            return
        if self._last is not None:
            before_a, before_b = self._last
            a, b = np.concatenate([before_a, a], axis=1), np.concatenate([before_b, b], axis=1)
        self._last = a[:, -1:].copy(), b[:, -1:].copy()
        length, other = (np.hypot(_lengths(np.diff(side, axis=1)) / self._diagonal, TIME_STEP) for side in (a, b))  # (V, n)
        moments = np.concatenate([self._pending, np.stack(_moments(length, other))], axis=2)
        n_windows = moments.shape[2] - WINDOW + 1
        if n_windows > 0:
            sliding = np.zeros((*moments.shape[:2], n_windows))
            for start in range(WINDOW):
                sliding += moments[:, :, start : start + n_windows]
            deviation = _deviation(sliding)
            self._temporal_sum += float(deviation.sum())
            self._temporal_count += deviation.size
        self._pending = moments[:, :, max(0, n_windows) :].copy()


def _edges_near_vertices(edges: Int32, n_vertices: int, distance: int) -> sparse.csr_array:
    """``(V, E)``: 1 where both ends of the edge are at most ``distance`` edges from the vertex."""
    columns = np.arange(len(edges)).repeat(2)
    ends = sparse.csr_array((np.ones(2 * len(edges)), (edges.ravel(), columns)), shape=(n_vertices, len(edges)))
    ring = sparse.eye_array(n_vertices, format="csr")
    for _ in range(distance):
        ring = ring + ends @ (ends.T @ ring)
        ring.data[:] = 1.0
    near = sparse.csr_array(ring @ ends)
    near.data = (near.data == 2).astype(np.float64)
    near.eliminate_zeros()
    return near


def _lengths(vectors: Float64) -> Float64:
    squared: Float64 = np.einsum("...c,...c->...", vectors, vectors)
    return np.sqrt(squared)


def _moments(length: Float64, other: Float64) -> tuple[Float64, Float64, Float64]:
    """Weight l, l r and l r^2 of the relative differences r = |l - l'| / l; a length of 0 weighs nothing."""
    difference = np.abs(length - other)
    relative = np.divide(difference, length, out=np.zeros_like(length), where=length > 0)
    return length, length * relative, length * relative * relative


def _deviation(moments: Float64) -> Float64:
    """Standard deviation of r weighted by l, from summed `_moments` ``(3, ...)`` whose weight is not 0."""
    weight, first, second = moments
    mean = first / weight
    variance: Float64 = np.maximum(second / weight - mean * mean, 0.0)
    return np.sqrt(variance)
