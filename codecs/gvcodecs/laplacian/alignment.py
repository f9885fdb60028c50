"""Rigid alignment of points that correspond: turning groups of them so that they come closest to given ones."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Integers


class Groups:
    """A partition of the vertices, say into connected components.

    Args:
        labels: ``(V,)`` the group of each vertex, 0..K-1, none empty.
    """

    def __init__(self, labels: Integers) -> None:
        self.labels = labels
        self._order = np.argsort(labels, kind="stable")
        self.sizes = np.bincount(labels)
        self._starts = np.cumsum(self.sizes) - self.sizes

    def total(self, values: Float64) -> Float64:
        """Sums over the vertices of each group: ``(n, V, ...)`` to ``(n, K, ...)``."""
        return np.asarray(np.add.reduceat(values[:, self._order], self._starts, axis=1))

    def centres(self, frames: Float64) -> Float64:
        """Mean points ``(n, K, 3)`` of groups."""
        return np.asarray(self.total(frames) / self.sizes[:, None])

    def turned(self, frames: Float64, target: Float64) -> Float64:
        """Turn each group of ``frames (n, V, 3)`` about its centre, so that its shape comes closest to ``target (V, 3)``."""
        centres = self.centres(frames)[:, self.labels]
        offsets = frames - centres
        wanted = target - self.centres(target[None])[0, self.labels]
        turns = np.broadcast_to(np.eye(3), (len(frames), len(self.sizes), 3, 3)).copy()
        solid = self.sizes >= 3
        turns[:, solid] = rotations(self.total(offsets[..., :, None] * wanted[:, None, :])[:, solid])
        own = turns[:, self.labels]  # (n, V, 3, 3)
        x, y, z = (offsets[..., i, None] * own[..., i, :] for i in range(3))
        return np.asarray(x + y + z + centres)


def rotations(covariances: Float64) -> Float64:
    """The rotations ``(..., 3, 3)`` R that make ``x @ R`` closest to y, given sums of x outer y."""
    from gvcodecs.laplacian.alignment_kernels import find_rotations

    return find_rotations(np.ascontiguousarray(covariances.reshape(-1, 3, 3))).reshape(covariances.shape)
