"""Smooth padding: the pixels that carry no vertex take the values that make each block smoothest.

Mamou, Zaharia and Preteux 2007, section 3.3: a block's roughness sums the squared differences of its neighbouring pixels, in
8-connectivity; the free pixels minimise it (equations 5 and 6)::

    psi(B) = sum over neighbours p, q in B  (B_p - B_q)^2
    for every free p:  n_p B_p - sum over free neighbours q  B_q  =  sum over fixed neighbours h  B_h

The paper writes 8 for n_p, the number of p's neighbours inside the block: it is 8 inside, 5 at an edge and 3 at a corner,
where 8 would pull the border towards zero. The sparse matrix depends on the layout alone and falls apart into one small
system per block; each is inverted once, and what is left per frame and axis is one product per block.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.arrays import Float64, Floats, Int64


class Padding:
    """The linear map from vertex values to whole planes, for one layout."""

    def __init__(self, layout: Layout, block: int) -> None:
        self.layout = layout
        laplacian = _laplacian(block)
        pixels = _pixels_by_block(layout.width, layout.height, block)  # (blocks, block**2)
        vertex = np.full(layout.width * layout.height, -1)
        vertex[layout.pixel] = np.arange(len(layout.pixel))
        self._blocks = []
        for own in pixels[(vertex[pixels] >= 0).any(axis=1)]:
            fixed = vertex[own] >= 0
            weights = -np.linalg.solve(laplacian[np.ix_(~fixed, ~fixed)], laplacian[np.ix_(~fixed, fixed)])
            self._blocks.append((own[~fixed], vertex[own[fixed]], weights))

    def fill(self, values: Floats, background: float) -> Float64:
        """Return planes ``(n, height, width)`` for vertex values ``(n, V)``; blocks without a vertex are ``background``."""
        columns = np.ascontiguousarray(values.T, dtype=np.float64)  # (V, n): a block's vertices are rows
        planes = np.full((self.layout.width * self.layout.height, len(values)), background)
        planes[self.layout.pixel] = columns
        for free, vertices, weights in self._blocks:
            planes[free] = weights @ columns[vertices]
        return planes.T.reshape(len(values), self.layout.height, self.layout.width)


def _pixels_by_block(width: int, height: int, block: int) -> Int64:
    """Row-major pixel indices ``(blocks, block**2)``."""
    index = np.arange(width * height).reshape(height // block, block, width // block, block)
    return index.swapaxes(1, 2).reshape(-1, block * block)


def _laplacian(block: int) -> Float64:
    """The matrix ``(block**2, block**2)`` of psi: neighbour counts on the diagonal, -1 for neighbours."""
    y, x = np.divmod(np.arange(block * block), block)
    near = np.maximum(np.abs(y[:, None] - y), np.abs(x[:, None] - x)) == 1  # 8-connectivity
    return np.asarray(np.diag(near.sum(axis=1)) - near.astype(np.float64))
