"""Packing: every vertex gets a pixel of its own, and no block of the image holds two charts.

Mamou, Zaharia and Preteux 2007, section 3.3: the atlas is rearranged so that no block of the image coder's transform (8x8
for JPEG, 16x16 for H.264) includes pixels of different charts. Here each chart is stretched to fill a rectangle of whole
blocks, with a pixel or a little more for each vertex. The blocks that it then occupies are laid into the image as one piece,
largest chart first, in the first free place.

Departure: the paper quantises the parametric coordinates and samples the surface on the lattice. Here a pixel *is* a vertex, so
that decoding needs no resampling and loses nothing; all other pixels are free for the padding.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from gvcodecs.mcgv.layout.chart_parameterization import Atlas
from gvcodecs.mcgv.layout.kd_tree import cut
from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.foundation.elementary import log2
from gvpipe.foundation.errors import InputError

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
    parts = atlas.parts()

    def attempt(density: float) -> Layout | None:
        pieces = [_place(atlas.uv[part], atlas.rectangle(part), block, density) for part in parts]
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
                f"the {atlas.n_charts} charts of {len(atlas.chart)} points do not fit a plane of {size[0]}x{size[1]} pixels in "
                f"blocks of {block}; leave the size out, or give a larger one, or fewer clusters"
            )
            if size
            else AssertionError("an automatic size always fits")
        )
    return best


def _place(uv: Float64, rectangle: Float64, block: int, density: float) -> Int64:
    """Return ``(n, 2)`` distinct integer places (x, y) of one chart, in a rectangle of whole blocks from (0, 0)."""
    size = block * _blocks(rectangle, int(np.ceil(len(uv) * density / block**2)))
    wanted = uv / np.maximum(uv.max(axis=0), 1e-12) * (size - 1)
    return distinct_pixels(wanted, size)


def _blocks(rectangle: Float64, n: int) -> Int64:
    """``(2,)`` columns and rows of blocks, at least n, for a chart of such sides: as few as go with as little stretch."""
    columns = np.arange(1, n + 1)
    rows = -(-n // columns)
    stretch = np.abs(log2(columns / rows) - log2(rectangle[0] / rectangle[1]))
    best = int((log2(columns * rows) + stretch).argmin())
    return np.array([columns[best], rows[best]])


def distinct_pixels(wanted: Float64, size: Int64) -> Int64:
    """Give points distinct pixels near the places that they want.

    A rectangle of pixels is halved across its longer side, down to single ones. Each point goes to the half that it lies in.
    Where one has too little room, the points nearest to the border go to the other.

    Args:
        wanted: ``(n, 2)`` places (x, y), pixels; integers are pixels' middles.
        size: ``(2,)`` width and height of the rectangle, with room for n.

    Returns:
        ``(n, 2)`` x and y.
    """
    order, starts = np.arange(len(wanted)), np.array([0, len(wanted)])
    corner, side = np.zeros((1, 2), np.int64), np.asarray(size)[None]
    while (side > 1).any():
        counts, cells = np.diff(starts), np.arange(len(side))
        axis, longer, across = np.where(side[:, 0] >= side[:, 1], 0, 1), side.max(axis=1), side.min(axis=1)
        first = np.maximum(longer // 2, 1)
        cell = np.repeat(cells, counts)
        along = wanted[order, axis[cell]]
        order = order[np.lexsort((along, cell))]
        before = np.bincount(cell, along < (corner[cells, axis] + first - 0.5)[cell], len(cells)).astype(np.int64)
        kept = np.clip(before, counts - across * (longer - first), across * first)
        starts, corner, side, _ = cut(starts, corner, side, first, kept)
    places = np.empty((len(wanted), 2), np.int64)
    places[order] = corner
    return places


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
