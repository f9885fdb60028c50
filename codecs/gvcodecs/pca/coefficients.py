"""The coefficients of a segment, to and from bytes: some components first, along triangles; the others along the hierarchy.

What: the first components of a point are its place on the surface, hardly its motion. A surface is rougher than its motion, so
these are predicted best from close by: point after point along a traversal, from all parallelograms
(`gvpipe.trajectory.spatial_neighbours.parallelogram_order`). The other components follow along the hierarchy, with weights that
have learned from the first ones. Each segment has as many first components as take fewer bits that way.

Along a traversal, errors of rounding would grow. So first components are rounded to parts of their step, as they are decoded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.elementary import log2
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors
from gvpipe.trajectory.contexts import FIRST, REST
from gvpipe.trajectory.prediction import predict_vectors, start_vectors
from gvpipe.trajectory.trellis import GRADES, WHAT
from gvpipe.trajectory.trellis_search import PENALTY

MOST_FIRST = 16  # components
# of first components, in D: as fine as steps of blocks are on average (`gvpipe.trajectory.trellis.block_steps`)
FIRST_STEP = 0.9
MARGIN = 0.1  # bits of a first component of a point that must be saved


class Orders(NamedTuple):
    """Two orders of the points that are coded.

    Args:
        first: along a traversal.
        causal: along the hierarchy.
    """

    first: CausalOrder
    causal: CausalOrder


def encode_coefficients(wanted: Float64, step: float, orders: Orders, given: Float64 | None) -> bytes:
    """Return the bytes of ``wanted (n, R)``, residuals on a trellis.

    Args:
        wanted: coefficients of all points, model units.
        step: D, model units.
        orders: of the points that are coded.
        given: ``(n, R)`` of points that the orders leave out.

    Raises:
        InputError: a value is too large for the step.
    """
    n_first = _choose(wanted, step, orders, given)
    flags = GRADES | REST << WHAT
    if not n_first:
        return varint(0) + encode_vectors(wanted, step, orders.causal, "kalman", 0.0, given, PENALTY, flags=flags)[0]
    first_wanted, first_given = _columns(wanted, n_first), _given(given, n_first)
    how = "kalman", 0.0, first_given, PENALTY
    data, known = encode_vectors(first_wanted, FIRST_STEP * step, orders.first, *how, flags=FIRST << WHAT, rounds=True)
    rest, _ = encode_vectors(wanted, step, orders.causal, "kalman", 0.0, given, PENALTY, flags=flags, known=known)
    return varint(n_first) + pack_block(data) + rest


def decode_coefficients(
    data: bytes,
    n_components: int,
    step: float,
    causal: CausalOrder,
    find_first: Callable[[], CausalOrder],
    *,
    name: str,
    n_blocks: int | None,
    given: Float64 | None,
) -> Float64:
    """Mirror of `encode_coefficients`; returns coefficients ``(n, R)`` of all points.

    Args:
        data, step, given: as there.
        n_components: R.
        causal: the order along the hierarchy.
        find_first: makes that along a traversal, which is kept no longer than it is needed.
        name: of the section, for messages.
        n_blocks: as of `gvpipe.trajectory.coefficient_coding.decode_vectors`.

    Raises:
        CorruptFile: the bytes are not what it writes.
    """
    cursor, known = Cursor(data, name), None
    n_first = cursor.varint(min(MOST_FIRST, n_components), "the number of first components")
    if n_first:
        first_given = _given(given, n_first)
        known = decode_vectors(cursor.block(), n_first, FIRST_STEP * step, find_first(), name, given=first_given, rounds=True)
    return decode_vectors(cursor.rest(), n_components, step, causal, name, n_blocks, given=given, known=known)


def _choose(wanted: Float64, step: float, orders: Orders, given: Float64 | None) -> int:
    """How many first components take fewest bits, about, by residuals of plain rounding."""
    n = min(MOST_FIRST, wanted.shape[1])
    target, bits = _columns(wanted, n), []
    for order in orders:
        residuals, decoded = np.zeros((len(order.order), n), np.int64), start_vectors(target.shape, _given(given, n), None)
        predict_vectors(order, step, residuals, decoded, target, "kalman", 0.0)
        bits.append(np.cumsum(log2(1.0 + np.abs(residuals)).sum(axis=0)))
    saved = np.concatenate([[0.0], bits[1] - bits[0]]) - MARGIN * len(orders.first.order) * np.arange(n + 1)
    return int(np.argmax(saved))


def _columns(vectors: Float64, n: int) -> Float64:
    return np.ascontiguousarray(vectors[:, :n])


def _given(vectors: Float64 | None, n: int) -> Float64 | None:
    return None if vectors is None else _columns(vectors, n)
