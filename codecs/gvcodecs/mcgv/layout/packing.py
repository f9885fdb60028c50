"""Packing: every vertex gets a pixel of its own, and no block of the image holds two charts.

Mamou, Zaharia and Preteux 2007, section 3.3: the atlas is rearranged so that no block of the image coder's transform (8x8
for JPEG, 16x16 for H.264) includes pixels of different charts. Here each chart is stretched to fill a rectangle of whole
blocks, its vertices are assigned distinct pixels at the least total squared displacement (a sparse assignment problem), and the
blocks that it then occupies are laid into the image as one piece, largest chart first, in the first free place.

Departure: the paper quantises the parametric coordinates and samples the surface on the lattice. Here a pixel *is* a vertex, so
that decoding needs no resampling and loses nothing; all other pixels are free for the padding.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from gvcodecs.mcgv.layout.chart_parameterization import Atlas
from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.arrays import Bool, Float64, Int64
from gvpipe.errors import InputError

WINDOWS = (1, 2, 4, 8, 16)  # half-widths of the window of pixels that a vertex may take, tried in turn
SQUARES = (1, 2, 4, 8, 16, 32)  # sides of squares whose points are counted
CROWDED = 0.9  # points on so many pixels are too many
SLACK = 0.35  # part of a block that a chart gives up rather than open another row of blocks
FIT_ROUNDS = 8  # densities tried to fit a given image size


def pack(atlas: Atlas, block: int, density: float, size: tuple[int, int] | None) -> Layout:
    """Lay out the points.

    Args:
        atlas: charts of the points.
        block: side of a block, pixels.
        density: pixels per point inside the charts, >= 1.
        size: ``(width, height)`` of a plane, or None for the smallest near-square one.

    Raises:
        InputError: the charts do not fit the size given.
    """
    chart, uv = atlas.chart, atlas.uv
    parts = np.split(np.argsort(chart, kind="stable"), np.cumsum(np.bincount(chart))[:-1])

    def attempt(density: float) -> Layout | None:
        pieces = [_place(uv[part], fill, block, density) for part, fill in zip(parts, atlas.fill, strict=True)]
        return _lay(pieces, parts, block, size)

    best = attempt(density)
    if best is None:  # only a given size can fail: look for the largest density that fits it
        low, high = 1.0, density
        best = attempt(low)
        for _ in range(FIT_ROUNDS if best else 0):
            middle = (low + high) / 2
            layout = attempt(middle)
            low, high, best = (middle, high, layout) if layout else (low, middle, best)
    if best is None:
        raise (
            InputError(
                f"the {atlas.n_charts} charts of {len(chart)} points do not fit a plane of {size[0]}x{size[1]} pixels in "
                f"blocks of {block}; leave the size out, or give a larger one, or fewer clusters"
            )
            if size
            else AssertionError("an automatic size always fits")
        )
    return best


def _place(uv: Float64, fill: float, block: int, density: float) -> Int64:
    """Return ``(n, 2)`` distinct integer places (x, y) of one chart, in a rectangle of whole blocks from (0, 0)."""
    sides = np.maximum(uv.max(axis=0), 1e-12)
    sides = np.maximum(sides, sides.max() / len(uv))  # no chart is thinner than one pixel
    scale = np.sqrt(density * len(uv) / fill / sides.prod())
    size = block * np.maximum(1, np.ceil(scale * sides / block - SLACK)).astype(np.int64)
    while size.prod() < len(uv):
        size[size.argmin()] += block
    wanted = uv / sides * (size - 1)
    for half in WINDOWS:
        places = _assign(wanted, size, half)
        if places is not None:
            return places
    # far too crowded for windows: rows of equal count by rank along y, then by rank along x
    rows = np.empty(len(uv), np.int64)
    rows[np.lexsort((uv[:, 0], uv[:, 1]))] = np.arange(len(uv)) // size[0]
    columns = np.empty(len(uv), np.int64)
    columns[np.lexsort((uv[:, 0], rows))] = np.arange(len(uv)) % size[0]
    return np.column_stack([columns, rows])


def _assign(wanted: Float64, size: Int64, half: int) -> Int64 | None:
    """Assign ``wanted (n, 2)`` to distinct pixels inside ``size``; None if windows of ``half`` are too crowded.

    The choice is made among windows of ``2 half``, the widest at most: just wide enough takes up to a hundred times as long.
    """
    if not _is_roomy(wanted, size, half):
        return None
    columns, graph = _choices(wanted, size, min(2 * half, WINDOWS[-1]))
    if len(columns) < len(wanted):  # SciPy would match the pixels instead
        return None
    try:
        rows, matched = csgraph.min_weight_full_bipartite_matching(graph)
    except ValueError:  # there is none
        return None
    result = np.empty((len(wanted), 2), np.int64)
    result[rows] = np.column_stack([columns[matched] % size[0], columns[matched] // size[0]])
    return result


def _is_roomy(wanted: Float64, size: Int64, half: int) -> bool:
    """Whether the points of every square have pixels enough within ``half`` of it, so that most likely all find one."""
    nearest = np.rint(wanted).astype(np.int64)
    counts = np.zeros((size[1] + 1, size[0] + 1), np.int64)
    np.add.at(counts, (nearest[:, 1] + 1, nearest[:, 0] + 1), 1)
    sums = counts.cumsum(axis=0).cumsum(axis=1)
    for side in SQUARES:
        low = [np.arange(max(1, length - side + 1)) for length in size]
        high = [np.minimum(first + side, length) for first, length in zip(low, size, strict=True)]
        reach = [np.minimum(b + half, n) - np.maximum(a - half, 0) for a, b, n in zip(low, high, size, strict=True)]
        (left, top), (right, bottom) = low, high
        inside = sums[bottom][:, right] - sums[bottom][:, left] - sums[top][:, right] + sums[top][:, left]
        if (inside > CROWDED * np.outer(reach[1], reach[0])).any():
            return False
    return True


def _choices(wanted: Float64, size: Int64, half: int) -> tuple[Int64, sparse.csr_array]:
    """The pixels within ``half`` of the nearest of any, ``(m,)``, and the cost ``(n, m)`` of each that may be taken."""
    nearest = np.rint(wanted).astype(np.int64)
    offsets = np.stack(np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1)), axis=-1).reshape(-1, 2)
    candidates = nearest[:, None] + offsets
    inside = ((candidates >= 0) & (candidates < size)).all(axis=2)
    vertex, choice = np.nonzero(inside)
    pixel = candidates[vertex, choice]
    cost = ((pixel - wanted[vertex]) ** 2).sum(axis=1) + 1e-3  # a stored zero would count as no edge
    columns, column = np.unique(pixel[:, 1] * size[0] + pixel[:, 0], return_inverse=True)
    return columns, sparse.csr_array((cost, (vertex, column.ravel())), shape=(len(wanted), len(columns)))


def _lay(pieces: list[Int64], parts: list[NDArray[np.intp]], block: int, size: tuple[int, int] | None) -> Layout | None:
    """Put the charts' occupied blocks into the image, largest first, each in the first free place; None if they do not fit."""
    stamps = [_stamp(piece // block) for piece in pieces]
    total = sum(int(stamp.sum()) for stamp in stamps)
    if size is None:
        width = max(int(np.ceil(np.sqrt(total))), *(stamp.shape[1] for stamp in stamps))
        height = width + sum(stamp.shape[0] for stamp in stamps)
    else:
        width, height = size[0] // block, size[1] // block
    taken = np.zeros((height, width), bool)
    pixel = np.zeros(sum(map(len, parts)), np.int64)
    for k in sorted(range(len(pieces)), key=lambda k: (-int(stamps[k].sum()), k)):
        stamp = stamps[k]
        if stamp.shape[0] > height or stamp.shape[1] > width:
            return None
        free = ~(sliding_window_view(taken, stamp.shape) & stamp).any(axis=(2, 3))
        if not free.any():
            return None
        y, x = np.unravel_index(int(free.argmax()), free.shape)
        taken[y : y + stamp.shape[0], x : x + stamp.shape[1]] |= stamp
        place = pieces[k] + block * np.array([x, y])
        pixel[parts[k]] = place[:, 1] * width * block + place[:, 0]
    if size is None:
        height = int(np.flatnonzero(taken.any(axis=1))[-1]) + 1
    return Layout(width * block, height * block, pixel)


def _stamp(blocks: Int64) -> Bool:
    stamp = np.zeros((int(blocks[:, 1].max()) + 1, int(blocks[:, 0].max()) + 1), bool)
    stamp[blocks[:, 1], blocks[:, 0]] = True
    return stamp
