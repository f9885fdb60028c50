"""A blend's transforms over a segment as bytes: principal trajectories.

The transforms of a segment, in coordinates of equal weight (`skinning`), are a matrix of trajectories ``(4K, 3n)``: smooth in
time, and alike from cluster to cluster. They are coded as such: a mean, the principal trajectories that pay
(`gvpipe.trajectory.basis`), and their coefficients. Both with one quantisation step, that of the residual's coefficients: an
error of either kind is an error of positions, and costs the same. The encoder has four means to a smaller section:

- The mean is 0. Rows of equal weight are no points, so that their mean is no motion.
- Principal trajectories are those of the points' displacements (`error_kernels`).
- Both are quantised on a trellis. The rows make up for errors of those before where clusters share points.
- Rows have causal neighbours where that is smaller (`row_neighbours`).

The bitstream, where ``[varint] 0`` stands only before rows that have causal neighbours::

    section = [varint] 0, [varint] length, basis, coefficients (rows of `gvpipe.trajectory.coefficient_coding`, one block)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gvcodecs.mcgv.motion.row_neighbours import row_order
from gvcodecs.mcgv.motion.skinning import Weights
from gvpipe.container.cursor import Cursor, varint
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.trajectory.basis import (
    Basis,
    count_components,
    decode_basis,
    encode_basis,
    find_principal,
    fit_coefficients,
)
from gvpipe.trajectory.causal_order import CausalOrder, independent_order
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors
from gvpipe.trajectory.trellis_search import BASIS_PENALTY, PENALTY

PREDICTED = 0  # before the length of a basis, which is never 0


@dataclass(frozen=True)
class Trajectories:
    """Decoded trajectories: the transforms' rows in frame f are ``mean[f] + coefficients @ vectors[f].T``.

    Args:
        basis: mean and vectors of the segment.
        coefficients: ``(4K, R)``.
    """

    basis: Basis
    coefficients: Float64

    def rows(self, start: int, stop: int) -> Float64:
        """``(4K, 3 (stop - start))`` rows of the segment's frames ``start`` to ``stop``, frame by frame, x y z."""
        from gvpipe.trajectory.product_kernels import weighted_sums

        span = slice(3 * start, 3 * stop)
        sums = weighted_sums(self.coefficients, np.ascontiguousarray(self.basis.vectors[span].T))
        return np.asarray(sums + self.basis.mean[span])


def encode_trajectories(
    rows: Float64, step: float, factor: Float64 | None = None, weights: Weights | None = None
) -> tuple[bytes, Trajectories]:
    """Code ``rows (4K, 3n)`` with a step, model units; return the section and, but for last bits, what the decoder will have.

    Args:
        rows: of equal weight.
        step: of basis and coefficients.
        factor: ``(4K, 4K)`` how errors of the rows add up (`error_kernels.error_factor`); None: each by itself.
        weights: of the points, from which the rows' causal neighbours follow; None: these have none.
    """
    from gvcodecs.mcgv.motion.error_kernels import weigh_rows

    weighted = rows if factor is None else weigh_rows(factor, np.ascontiguousarray(rows))
    principal = find_principal(weighted, rows.size * step * step / 12, is_centred=False)
    n_components = count_components(principal, len(rows), step)
    head, basis = encode_basis(principal, n_components, len(rows), step, penalty=BASIS_PENALTY)
    wanted, orders = fit_coefficients(rows, basis), [(b"", independent_order(len(rows)))]
    if weights:
        orders.append((varint(PREDICTED), row_order(*weights, len(rows) // 4)))
    sections = []
    for mark, order in orders:
        data, decoded = encode_vectors(wanted, step, order, penalty=PENALTY, factor=factor)
        sections.append((mark + varint(len(head)) + head + data, Trajectories(basis, decoded)))
    return min(sections, key=lambda section: len(section[0]))


def decode_trajectories(
    data: bytes,
    find_order: Callable[[], CausalOrder],
    n_clusters: int,
    n_frames: int,
    step: float,
    name: str,
    *,
    budget: Budget = UNLIMITED,
) -> Trajectories:
    """Mirror of `encode_trajectories`; raises `CorruptFile`, or `OverBudget` if they take more than the file may.

    ``find_order`` gives the rows' causal order (`row_neighbours.row_order`), if the section asks for it.
    """
    cursor, n_rows = Cursor(data, name), 4 * n_clusters
    length = cursor.varint(cursor.left, "a length")
    is_predicted = data[:1] == varint(PREDICTED)
    head = cursor.take(cursor.varint(cursor.left, "a length") if is_predicted else length)
    basis = decode_basis(head, n_frames, n_rows, step, name, budget=budget)
    order = find_order() if is_predicted else independent_order(n_rows)
    coefficients = decode_vectors(cursor.rest(), basis.vectors.shape[1], step, order, name)
    return Trajectories(basis, coefficients)


def encode_coefficients(coefficients: Float64, step: float) -> tuple[bytes, Float64]:
    """Code the transforms' ``coefficients (4K, R)`` by plain rounding; return the bytes and what the decoder will have."""
    return encode_vectors(coefficients, step, independent_order(len(coefficients)))


def decode_coefficients(data: bytes, n_clusters: int, n_components: int, step: float, name: str) -> Float64:
    """Mirror of `encode_coefficients`; raises `CorruptFile` if the bytes are not what it writes."""
    return decode_vectors(data, n_components, step, independent_order(4 * n_clusters), name)
