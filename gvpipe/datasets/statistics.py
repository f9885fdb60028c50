"""What a sample's JSON has of a sequence's positions: enough to normalise it, and to group samples by their triangles.

Lengths are model units, relative to the sequence's origin, as `gvpipe.datasets.Dataset.read` gives positions.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from gvpipe.coding.codec import ClosableReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.shared_parts import SharedParts
from gvpipe.foundation.arrays import Float32, Int32

BLOCK_BYTES = 32 << 20  # positions that are decoded at a time
DIGITS = 6  # that are kept of a number
KEYS = ("box", "mean", "scale", "topology")


def describe_positions(bitstream: Bitstream, shared: SharedParts | None = None) -> dict[str, Any]:
    """Decode a sequence; return ``box`` (least and largest x, y, z of all frames), ``mean``, ``scale`` and ``topology``.

        ``scale`` is the root mean square of all vertices' distances from ``mean``, in all frames. ``topology`` is the same for
    sequences of the same triangles.

        Args:
            bitstream: of the sequence.
            shared: decoded parts that files of one connectivity share; None: nothing.

        Raises:
            FormatError: it cannot be decoded.
    """
    reader = open_reader(replace(bitstream, shared=shared))
    step = max(1, BLOCK_BYTES // (12 * bitstream.n_vertices))
    try:
        blocks = (reader.read(k, min(k + step, bitstream.n_frames)) for k in range(0, bitstream.n_frames, step))
        return {**measure(blocks), "topology": name_topology(reader.faces)}
    finally:
        if isinstance(reader, ClosableReader):
            reader.close()


def measure(blocks: Iterable[Float32]) -> dict[str, Any]:
    """``box``, ``mean`` and ``scale`` of positions, blocks of ``(n, V, 3)``, each number rounded to `DIGITS` digits.

    Examples:
        >>> measure([np.array([[[0, 0, 0], [2, 0, 0]]], np.float32)])
        {'box': [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], 'mean': [1.0, 0.0, 0.0], 'scale': 1.0}
    """
    n, total, squared = 0, np.zeros(3), 0.0
    low, high, centre = np.full(3, np.inf), np.full(3, -np.inf), np.zeros(3)
    for block in blocks:
        points = np.array(block.reshape(-1, 3).T, np.float64, order="C")  # (3, n V): sums of rows are fast
        low, high = np.minimum(low, points.min(axis=1)), np.maximum(high, points.max(axis=1))
        centre = centre if n else points.mean(axis=1)
        points -= centre[:, None]  # squares of large coordinates would cancel
        n, total, squared = n + points.shape[1], total + points.sum(axis=1), squared + float(np.square(points).sum())
    shift = total / n
    scale = max(0.0, squared / n - float(shift @ shift)) ** 0.5
    return {"box": [_rounded(low), _rounded(high)], "mean": _rounded(shift + centre), "scale": _rounded([scale])[0]}


def name_topology(faces: Int32) -> str:
    """A hash of triangles ``(T, 3)``, 16 hexadecimal digits: the same whatever their order and wherever each begins.

    Examples:
        >>> name_topology(np.array([[0, 1, 2], [2, 1, 3]])) == name_topology(np.array([[3, 2, 1], [0, 1, 2]]))
        True
    """
    first = np.argmin(faces, axis=1)[:, None] if len(faces) else np.zeros((0, 1), np.int64)
    turned = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1)
    ordered = turned[np.lexsort(turned.T[::-1])]
    return hashlib.sha256(np.ascontiguousarray(ordered, "<i4").tobytes()).hexdigest()[:16]


def _rounded(values: Any) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values]
