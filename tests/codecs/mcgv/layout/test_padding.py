"""Free pixels minimise psi (equations 5 and 6), against one sparse system of all blocks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import spsolve

from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.padding import Padding

CLOSE = 1e-4  # factors are float32; levels of pictures are 1 apart


@pytest.mark.parametrize("block", [8, 16])
def test_padding_minimises_psi(block: int) -> None:
    """One sparse system of all blocks gives the same planes; psi's gradient is zero at free pixels; vertices keep theirs."""
    random = np.random.default_rng(block)
    width, height = 3 * block, 2 * block
    used = random.permutation(width * height)
    used = used[(used // width // block != 1) | (used % width // block != 2)]  # one block stays empty
    pixel = np.concatenate([used[:40], [0, width - 1]])
    pixel = pixel[np.sort(np.unique(pixel, return_index=True)[1])]
    values = random.normal(0, 50, (4, len(pixel))).astype(np.float32)
    planes = Padding(Layout(width, height, pixel), block).fill(values, 7.25).reshape(4, -1)
    assert np.array_equal(planes[:, pixel], values)
    y, x = np.divmod(np.arange(width * height), width)
    pairs = []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        inside = (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        p = np.flatnonzero(inside)
        q = p + dy * width + dx
        same = (y[p] // block == y[q] // block) & (x[p] // block == x[q] // block)
        pairs.append(np.c_[p[same], q[same]])
    p, q = np.concatenate(pairs).T
    assert len(p) == 6 * (4 * block**2 - 6 * block + 2)
    rows = np.arange(len(p))
    difference = sparse.csr_array((np.r_[np.ones(len(p)), -np.ones(len(p))], (np.r_[rows, rows], np.r_[p, q])))
    laplacian = sparse.csr_array(difference.T @ difference)
    block_of = y // block * 3 + x // block
    empty = ~np.isin(block_of, block_of[pixel])
    assert empty.any() and (planes[:, empty] == 7.25).all()
    free = ~empty
    free[pixel] = False
    free_at = np.flatnonzero(free)
    system = sparse.csc_array(laplacian[free_at][:, free_at])
    wanted = spsolve(system, -(laplacian[free_at][:, pixel] @ values.T)).T
    np.testing.assert_allclose(planes[:, free_at], wanted, atol=CLOSE)
    assert np.abs((laplacian @ planes.T)[free_at]).max() < 10 * CLOSE  # of 8 neighbours
    assert planes[:, ~empty].max() <= values.max() + CLOSE and planes[:, ~empty].min() >= values.min() - CLOSE


def test_padding_of_full_and_single_blocks() -> None:
    """A block full of vertices is passed on; one vertex fills its block evenly."""
    full = Padding(Layout(8, 8, np.random.default_rng(0).permutation(64)), 8)
    values = np.arange(64.0)[None]
    assert np.array_equal(np.sort(full.fill(values, 0.0).ravel()), values[0])
    np.testing.assert_allclose(Padding(Layout(16, 8, np.array([5])), 8).fill(np.array([[3.5]]), -1.0)[0, :, :8], 3.5, rtol=1e-6)
