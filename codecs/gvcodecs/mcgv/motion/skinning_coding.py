"""A blend's transforms over a segment as bytes: principal trajectories.

The transforms of a segment, in coordinates of equal weight (`skinning`), are a matrix of trajectories ``(4K, 3n)``: smooth in
time, and alike from cluster to cluster. They are coded as such: a mean, the principal trajectories that pay
(`gvpipe.trajectory.basis`), and their coefficients. Both with one quantisation step, that of the residual's coefficients: an
error of either kind is an error of positions, and costs the same. The encoder has three means to a smaller section:

- The mean is 0. Rows of equal weight are no points, so that their mean is no motion.
- Principal trajectories are those of the points' displacements (`error_kernels`).
- Both are quantised on a trellis. The rows make up for errors of those before where clusters share points.

The bitstream::

    section = [varint] length, basis, coefficients (rows of `gvpipe.trajectory.coefficient_coding`, one block, none predicted
    from another)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors
from gvpipe.trajectory.trellis_search import BASIS_PENALTY, PENALTY


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


def encode_trajectories(rows: Float64, step: float, factor: Float64 | None = None) -> tuple[bytes, Trajectories]:
    """Code ``rows (4K, 3n)`` with a step, model units; return the section and, but for last bits, what the decoder will have.

    ``factor (4K, 4K)`` says how errors of the rows add up (`error_kernels.error_factor`); None: each by itself.
    """
    from gvcodecs.mcgv.motion.error_kernels import weigh_rows

    weighted = rows if factor is None else weigh_rows(factor, np.ascontiguousarray(rows))
    principal = find_principal(weighted, rows.size * step * step / 12, is_centred=False)
    n_components = count_components(principal, len(rows), step)
    head, basis = encode_basis(principal, n_components, len(rows), step, penalty=BASIS_PENALTY)
    wanted, order = fit_coefficients(rows, basis), _unpredicted(len(rows))
    data, decoded = encode_vectors(wanted, step, order, penalty=PENALTY, factor=factor)
    return varint(len(head)) + head + data, Trajectories(basis, decoded)


def decode_trajectories(
    data: bytes, n_clusters: int, n_frames: int, step: float, name: str, budget: Budget = UNLIMITED
) -> Trajectories:
    """Mirror of `encode_trajectories`; raises `CorruptFile`, or `OverBudget` if they take more than the file may."""
    cursor = Cursor(data, name)
    head = cursor.take(cursor.varint(cursor.left, "a length"))
    basis = decode_basis(head, n_frames, 4 * n_clusters, step, name, budget=budget)
    coefficients = decode_coefficients(cursor.rest(), n_clusters, basis.vectors.shape[1], step, name)
    return Trajectories(basis, coefficients)


def encode_coefficients(coefficients: Float64, step: float) -> tuple[bytes, Float64]:
    """Code the transforms' ``coefficients (4K, R)`` by plain rounding; return the bytes and what the decoder will have."""
    return encode_vectors(coefficients, step, _unpredicted(len(coefficients)))


def decode_coefficients(data: bytes, n_clusters: int, n_components: int, step: float, name: str) -> Float64:
    """Mirror of `encode_coefficients`; raises `CorruptFile` if the bytes are not what it writes."""
    return decode_vectors(data, n_components, step, _unpredicted(4 * n_clusters), name)


def _unpredicted(n_vectors: int) -> CausalOrder:
    """Vectors in their own order, each predicted as zero: contexts follow from the vector's earlier components."""
    nothing = np.zeros(0)
    return CausalOrder(
        order=np.arange(n_vectors, dtype=np.int32),
        starts=np.zeros(n_vectors + 1, np.int32),
        neighbours=nothing.astype(np.int32),
        weights=nothing,
        variances=nothing,
        ring_sizes=np.zeros(n_vectors, np.int32),
        blocks=np.array([0, n_vectors], np.int32),
        affine=False,
    )
