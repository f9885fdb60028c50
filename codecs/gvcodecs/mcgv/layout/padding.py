"""Smooth padding: the pixels that carry no vertex take the values that make each block smoothest.

Mamou, Zaharia and Preteux 2007, section 3.3: a block's roughness sums the squared differences of its neighbouring pixels, in
8-connectivity; the free pixels minimise it (equations 5 and 6)::

    psi(B) = sum over neighbours p, q in B  (B_p - B_q)^2
    for every free p:  n_p B_p - sum over free neighbours q  B_q  =  sum over fixed neighbours h  B_h

The paper writes 8 for n_p, the number of p's neighbours inside the block: it is 8 inside, 5 at an edge and 3 at a corner,
where 8 would pull the border towards zero. The sparse matrix depends on the layout alone and falls apart into one small
system per block; each is factored once (`padding_kernels`), and what is left per frame and axis is two passes over a band.
"""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.padding_kernels import factor_blocks, fill_blocks
from gvpipe.foundation.arrays import Float32, Floats, Int32


class Padding:
    """The linear map from vertex values to whole planes, for one layout."""

    def __init__(self, layout: Layout, block: int) -> None:
        self.layout, self._block = layout, block
        pixels = _pixels_by_block(layout.width, layout.height, block)  # (blocks, block**2)
        is_vertex = np.zeros(layout.width * layout.height, np.bool_)
        is_vertex[layout.pixel] = True
        self._pixels = pixels[is_vertex[pixels].any(axis=1)]
        self._fixed = is_vertex[self._pixels]
        n_free = (~self._fixed).sum(axis=1)
        self._first = np.cumsum(n_free) - n_free
        self._factors = np.empty((int(n_free.sum()), block + 2), np.float32)
        factor_blocks(self._fixed, block, self._first, self._factors)

    def fill(self, values: Floats, background: float) -> Float32:
        """Return planes ``(n, height, width)`` for vertex values ``(n, V)``; blocks without a vertex are ``background``."""
        n = len(values)
        planes = np.full((self.layout.width * self.layout.height, 3 * -(-n // 3)), background, np.float32)
        planes[self.layout.pixel, :n] = values.T
        fill_blocks(planes, self._pixels, self._fixed, self._block, self._first, self._factors)
        return planes.T[:n].reshape(n, self.layout.height, self.layout.width)


def _pixels_by_block(width: int, height: int, block: int) -> Int32:
    """Row-major pixel indices ``(blocks, block**2)``."""
    index = np.arange(width * height, dtype=np.int32).reshape(height // block, block, width // block, block)
    return index.swapaxes(1, 2).reshape(-1, block * block)
