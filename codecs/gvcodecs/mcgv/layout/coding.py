"""The sections ``pixels`` and ``clusters``: where the slots' pixels are, and which cluster each block or slot belongs to."""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.foundation.errors import CorruptFile

CONTEXTS = 4  # of a pixel's y: 0, 1, 2..3 or more columns from the slot before


def encode_pixels(layout: Layout) -> bytes:
    """Return the section ``pixels``."""
    y, x = np.divmod(layout.pixel, layout.width)
    dx, dy = np.diff(x, prepend=0), np.diff(y, prepend=0)
    columns = encode_integers(dx)
    return pack_block(columns) + encode_integers(dy, _context(dx))


def decode_pixels(data: bytes, n_slots: int, width: int, height: int) -> Layout:
    """Mirror of `encode_pixels`.

    Raises:
        CorruptFile: a slot has no pixel of its own inside the plane.
    """
    cursor = Cursor(data, "pixels")
    columns = cursor.block()
    dx = decode_integers(columns, n_slots, name="pixels")
    dy = decode_integers(cursor.rest(), n_slots, _context(dx), "pixels")
    x, y = np.cumsum(dx), np.cumsum(dy)
    if ((x < 0) | (x >= width) | (y < 0) | (y >= height)).any():
        raise cursor.corrupt("a pixel lies outside the plane")
    pixel = np.asarray(y * width + x, np.int64)
    if np.bincount(pixel).max(initial=0) > 1:
        raise cursor.corrupt("two slots share a pixel")
    return Layout(width, height, pixel)


def encode_clusters(clusters: Int32, layout: Layout, block: int) -> bytes:
    """Return the section ``clusters`` for ``clusters (S,)``, which must be constant inside each block."""
    _, first = np.unique(_blocks(layout, block), return_index=True)
    return encode_integers(np.diff(clusters[first], prepend=np.int32(0)))


def decode_clusters(data: bytes, layout: Layout, block: int, n_clusters: int) -> Int32:
    """Mirror of `encode_clusters`: ``(S,) int32``; raises `CorruptFile` for a cluster out of range."""
    used, block_of = np.unique(_blocks(layout, block), return_inverse=True)
    by_block = np.cumsum(decode_integers(data, len(used), name="clusters"))
    if ((by_block < 0) | (by_block >= n_clusters)).any():
        raise CorruptFile(f"section 'clusters' is corrupt: a cluster is not in 0..{n_clusters - 1}")
    return np.asarray(by_block[block_of.ravel()], np.int32)


def encode_slot_clusters(clusters: Int32) -> bytes:
    """Return the section ``clusters (S,)`` of placement halves."""
    return encode_integers(np.diff(clusters, prepend=np.int32(0)))


def decode_slot_clusters(data: bytes, n_slots: int, n_clusters: int) -> Int32:
    """Mirror of `encode_slot_clusters`; raises `CorruptFile` if a cluster is out of range."""
    clusters = np.cumsum(decode_integers(data, n_slots, name="clusters"))
    if ((clusters < 0) | (clusters >= n_clusters)).any():
        raise CorruptFile(f"section 'clusters' is corrupt: a cluster is not in 0..{n_clusters - 1}")
    return clusters.astype(np.int32)


def _context(dx: Int64) -> Int64:
    return np.asarray(np.minimum(np.abs(dx), CONTEXTS - 1))


def _blocks(layout: Layout, block: int) -> Int64:
    y, x = np.divmod(layout.pixel, layout.width)
    return np.asarray((y // block) * (layout.width // block) + x // block)
