"""Piecewise affine prediction of every frame from the decoded base frame.

For cluster k and frame i, the affine transform that best carries the cluster's base points to frame i, and the
prediction that follows (Mamou, Zaharia and Preteux 2007, section 3.2, equations 2 to 4)::

    H_i^k = arg min_A  sum over v in cluster k  |A x_0^v - x_i^v|^2          (2)
    prediction of x_i^v = H_i^k(v) x_0^v                                      (3)
    residual   e_i^v = x_i^v - prediction                                     (4)

A transform is four rows in model units: the images of three axes, as long as the cluster's radius r and drawn from its
centre c, and the image of the centre itself; ``x = ((x_0 - c) / r, 1) @ rows``. The affine map is the paper's; these rows all
have the size of the motion that they cause, so that one quantisation step suits all twelve numbers.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Floats, Int32
from gvpipe.runtime.forks import kept
from gvpipe.trajectory.basis import row_blocks
from gvpipe.trajectory.gram import descending_eigenvectors, gram_of_columns, product

ROWS = 1 << 14  # vertices whose products with all transforms are held at a time
FLAT = 1e-4  # a cluster thinner than this part of its radius counts as flat: that direction stays unused


class AffinePredictor:
    """The clusters' base points, prepared once: fits and predicts any number of frames.

    Args:
        base: ``(V, 3)`` decoded base frame, model units.
        clusters: ``(V,)`` cluster of each vertex, 0..K-1.
        n_clusters: K; a cluster may be empty.
    """

    def __init__(self, base: Float64, clusters: Int32, n_clusters: int) -> None:
        self.n_clusters = n_clusters
        self._base = base
        self._order = np.argsort(clusters, kind="stable")  # vertices, cluster after cluster
        ends = np.cumsum(np.bincount(clusters, minlength=n_clusters))
        self._slices = [slice(int(a), int(b)) for a, b in zip(np.r_[0, ends[:-1]], ends, strict=True)]
        self._coordinates = np.ones((len(base), 4))
        self._frame = np.zeros((n_clusters, 4))  # centre and radius of each cluster
        self._rest = np.zeros((n_clusters, 4, 3))
        for k, part in enumerate(self._slices):
            points = base[self._order[part]]
            if len(points):
                centre = (points.min(axis=0) + points.max(axis=0)) / 2
                radius = float(np.linalg.norm(points - centre, axis=1).max())
                self._frame[k] = *centre, radius
                self._coordinates[part] = self._local(k, points)
                self._rest[k, :3], self._rest[k, 3] = radius * np.eye(3), centre
        self._columns = np.ascontiguousarray(self._coordinates.T)
        self._rank = np.empty(len(base), np.intp)
        self._rank[self._order] = np.arange(len(base))

    @kept
    def coordinates(self) -> Float64:
        """``(V, 3)`` base points in their cluster's frame, in the given order."""
        return np.ascontiguousarray(self._coordinates[self._rank, :3])

    @property
    def rest(self) -> Float64:
        """``(K, 4, 3)`` the transforms that leave the base frame as it is."""
        return self._rest

    def fit(self, frames: Floats) -> Float64:
        """Equation 2 by pseudo-inverse: ``(n, K, 4, 3)`` transforms for ``frames (n, V, 3)``, model units."""
        result = np.repeat(self._rest[None], len(frames), axis=0)
        moved = np.moveaxis(frames, 1, 0)[self._order].reshape(len(self._order), -1)  # (V, 3n), cluster after cluster
        for k, part in enumerate(self._slices):
            if part.stop > part.start:
                still = np.tile(product(self._coordinates[part], self._rest[k]), len(frames))
                result[:, k] += product(self._inverses[k], moved[part] - still).reshape(4, len(frames), 3).swapaxes(0, 1)
        return result

    @kept
    def _inverses(self) -> list[Float64]:
        """Pseudo-inverses ``(4, m)`` of the clusters' coordinates."""
        return [_invert(self._coordinates[part]) for part in self._slices]

    def predict(self, transforms: Float64) -> Float64:
        """Equation 3: ``(n, V, 3)`` predicted positions for ``transforms (n, K, 4, 3)``, model units."""
        from gvpipe.trajectory.product_kernels import weighted_sums

        n = len(transforms)
        planes = np.empty((3 * n, len(self._order)))  # vertices cluster after cluster
        for k, part in enumerate(self._slices):
            rows = transforms[:, k].swapaxes(1, 2).reshape(3 * n, 4)
            planes[:, part] = weighted_sums(rows, np.ascontiguousarray(self._columns[:, part]))
        return np.asarray(planes.reshape(n, 3, -1).swapaxes(1, 2)[:, self._rank])

    def squared_errors(self, frames: Float64, transforms: Float64) -> Float64:
        """Return ``(V, K)``: each vertex's squared error over ``frames (n, V, 3)`` if it followed each cluster.

        ``|x - Y h|^2`` is expanded, so that the cost is one product of all positions with all transforms.
        """
        rows = transforms.transpose(1, 2, 0, 3).reshape(4 * self.n_clusters, -1)  # (4K, 3n)
        blocks = np.split(rows, self.n_clusters)
        squares = [product(block, block.T) for block in blocks]
        errors = np.empty((frames.shape[1], self.n_clusters))
        for some in row_blocks(len(errors), ROWS):
            moved = np.moveaxis(frames[:, some], 1, 0).reshape(len(errors[some]), -1)  # (m, 3n)
            products = product(moved, rows.T).reshape(len(moved), self.n_clusters, 4)
            for k, square in enumerate(squares):
                local = self._local(k, self._base[some])
                errors[some, k] = ((product(local, square) - 2 * products[:, k]) * local).sum(axis=1)
            errors[some] += np.square(moved).sum(axis=1)[:, None]
        return np.asarray(np.maximum(errors, 0))

    def _local(self, k: int, points: Float64) -> Float64:
        """Homogeneous coordinates ``(m, 4)`` in the cluster's frame."""
        radius = self._frame[k, 3]
        return np.column_stack([(points - self._frame[k, :3]) / (radius if radius > 0 else 1.0), np.ones(len(points))])


def _invert(coordinates: Float64) -> Float64:
    """The pseudo-inverse ``(4, m)`` of a cluster's coordinates ``(m, 4)``, without directions in which they are flat."""
    energies, vectors = descending_eigenvectors(gram_of_columns(coordinates))
    used = energies > FLAT * FLAT * energies[0]
    axes = vectors[:, used]
    return product(axes / energies[used], product(axes.T, coordinates.T))
