"""The average mesh as bytes: positions in mean edge lengths, quantised, predicted along the vertex hierarchy.

Place and size do not matter to the operators, so that they are left out, and the step is relative to the edges: what the weights
need is measured in docs/codecs/laplacian.md. Interpolation from both sides beats the paper's high-pass coding of it, as it does
for trajectories.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.errors import CorruptFile
from gvpipe.row_coding import decode_rows, encode_rows
from gvpipe.row_prediction import Rows
from gvpipe.sequence import Int32

NAME = "average"
FARTHEST = 1e9  # mean edge lengths: what a decoded coordinate may have

Float64 = NDArray[np.float64]


def encode_average(points: Float64, edges: Int32, rows: Rows, step: float) -> tuple[bytes, Float64]:
    """Code ``points (P, 3)``, model units; return the bytes and the decoded points in mean edge lengths.

    Args:
        edges: ``(E, 2)``.
        rows: of all points.
        step: mean edge lengths.
    """
    lengths = edge_lengths(points, edges)
    unit = float(lengths.mean()) if len(lengths) else 0.0
    unit = unit or float(np.abs(points).max(initial=0)) or 1.0
    return encode_rows((points - points.mean(axis=0)) / unit, step, rows)


def decode_average(data: bytes, rows: Rows, step: float) -> Float64:
    """Mirror of `encode_average`; raises `CorruptFile` if the bytes are not what it writes."""
    points = decode_rows(data, 3, step, rows, NAME)
    if not np.abs(points).max(initial=0) < FARTHEST:
        raise CorruptFile(f"section {NAME!r} is corrupt: a position is out of range; get the file again from its source")
    return points


def edge_lengths(points: Float64, edges: Int32) -> Float64:
    """Lengths ``(E,)``."""
    return np.asarray(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1))


def fineness(points: Float64, edges: Int32, power: float) -> Float64:
    """How much finer than usual each point's deltas are quantised: its mean edge length to the power ``-power``, ``(P,)``.

    The eye, and STED, see errors relative to the edges around them. Lengths are held to within a factor of `SPAN` of the mean.
    """
    lengths = edge_lengths(points, edges)
    count = np.bincount(edges.ravel(), minlength=len(points))
    around = np.bincount(edges.ravel(), np.repeat(lengths, 2), len(points)) / np.maximum(count, 1)
    return np.asarray(np.clip(np.where(count > 0, around, 1.0), 1 / SPAN, SPAN) ** -power)


SPAN = 20.0
