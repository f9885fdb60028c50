"""The systems of smooth padding, one for each block, as banded Cholesky factors.

Free pixels of a block are numbered row by row, so two neighbours are at most ``block + 1`` apart: that is the band's width.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool, Float32, Int32, Int64
from gvpipe.runtime.compiled import compiled


@compiled
def factor_blocks(fixed: Bool, block: int, first: Int64, factors: Float32) -> None:
    """Factor the matrix of each block's free pixels: ``L L' = n_p on the diagonal, -1 for free neighbours``.

    Args:
        fixed: ``(B, block**2)`` whether a pixel carries a vertex; one in each block does.
        block: pixels of a block's side.
        first: ``(B,)`` each block's first row of ``factors``.
        factors: ``(n, block + 2)``, filled: a row for each free pixel, column j the entry j pixels before it, 0 its inverse.
            Worked out in float64, and kept as float32: they take most of the memory, and pictures have 10 bits at most.
    """
    width = block + 2
    number, rows = np.empty(block * block, np.int64), np.empty((block * block, width))
    for k in range(len(fixed)):
        count = 0
        for p in range(block * block):
            number[p] = -1
            if fixed[k, p]:
                continue
            y, x = p // block, p % block
            row = rows[count]
            for j in range(width):
                row[j] = 0.0
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    if (dy or dx) and 0 <= y + dy < block and 0 <= x + dx < block:
                        row[0] += 1.0
                        q = p + dy * block + dx
                        if q < p and number[q] >= 0:
                            row[count - number[q]] = -1.0
            number[p] = count
            for j in range(min(width - 1, count), 0, -1):  # the entry at column count - j
                other = rows[count - j]
                total = row[j]
                for i in range(j + 1, min(width, count + 1)):
                    if i - j < width:
                        total -= row[i] * other[i - j]
                row[j] = total * other[0]
            total = row[0]
            for i in range(1, min(width, count + 1)):
                total -= row[i] * row[i]
            row[0] = 1.0 / np.sqrt(total)
            for j in range(width):
                factors[first[k] + count, j] = row[j]
            count += 1


@compiled
def fill_blocks(planes: Float32, pixels: Int32, fixed: Bool, block: int, first: Int64, factors: Float32) -> None:
    """Give free pixels the values that minimise psi.

    Args:
        planes: ``(pixels of a plane, n)``, a column for each plane, n a multiple of 3; those of fixed pixels are given.
        pixels: ``(B, block**2)`` the rows of each block's pixels.
        fixed, block, first, factors: as in `factor_blocks`.
    """
    width, n = block + 2, planes.shape[1]
    place, near = np.empty(block * block, np.int64), np.empty((block * block, 8), np.int64)
    n_near = np.empty(block * block, np.int64)
    solved = np.empty((block * block, 3))  # three columns at a time stay in registers
    for k in range(len(pixels)):
        rows = factors[first[k] :]
        count = 0
        for p in range(block * block):
            if fixed[k, p]:
                continue
            y, x = p // block, p % block
            n_near[count] = 0
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    if 0 <= y + dy < block and 0 <= x + dx < block and fixed[k, p + dy * block + dx]:
                        near[count, n_near[count]] = pixels[k, p + dy * block + dx]
                        n_near[count] += 1
            place[count] = pixels[k, p]
            count += 1
        for column in range(0, n, 3):
            for number in range(count):
                a = b = c = 0.0
                for i in range(n_near[number]):
                    source = near[number, i]
                    a += planes[source, column]
                    b += planes[source, column + 1]
                    c += planes[source, column + 2]
                for j in range(1, min(width, number + 1)):
                    weight = rows[number, j]
                    a -= weight * solved[number - j, 0]
                    b -= weight * solved[number - j, 1]
                    c -= weight * solved[number - j, 2]
                scale = rows[number, 0]
                solved[number, 0], solved[number, 1], solved[number, 2] = a * scale, b * scale, c * scale
            for number in range(count - 1, -1, -1):
                scale, target = rows[number, 0], place[number]
                a, b, c = solved[number, 0] * scale, solved[number, 1] * scale, solved[number, 2] * scale
                planes[target, column], planes[target, column + 1], planes[target, column + 2] = a, b, c
                for j in range(1, min(width, number + 1)):
                    weight = rows[number, j]
                    solved[number - j, 0] -= weight * a
                    solved[number - j, 1] -= weight * b
                    solved[number - j, 2] -= weight * c
