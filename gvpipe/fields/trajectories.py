"""Values of a field from principal trajectories, as codec `pca` codes positions: for fields of few degrees of freedom.

A segment is a matrix of trajectories, one per row. Its basis is coded along time (`gvpipe.trajectory.basis`), the
coefficients along the mesh (`gvpipe.trajectory.prediction`); both leave the same error by reverse water-filling. What exceeds
the bound is corrected by residuals in steps of twice the bound, as `gvpipe.fields.residual_coding` codes them; most are 0::

    trajectories = [float64] step of coefficients, [block] basis, [block] residuals of coefficients, residuals of values

The largest error of a value is what counts, and it grows slower than the mean: a root mean square error of 0.3 to 0.5 of the
bound leaves the fewest bytes. The encoder tries some (`SHARES`).
"""

from __future__ import annotations

import struct

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.segments import LARGEST_STEP, SMALLEST_STEP
from gvpipe.fields.residual_coding import LARGEST, decode_residuals, encode_residuals
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.trajectory.basis import Basis, decode_basis, reduce_trajectories
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.prediction import predict_vectors

STEP = struct.Struct("<d")
SHARES = (0.4, 0.3, 0.5)  # root mean square error, in half steps; the first is tried first
WORTH = 1.15  # other shares are tried if the first is at most so much larger than what there is


def encode_trajectories(target: Float64, n_frames: int, causal: CausalOrder, share: float) -> bytes | None:
    """Return the bytes of ``target (R, N)``, N = C F columns, in steps; None if a residual is too large.

    Args:
        target: values in steps, component after component.
        n_frames: F.
        causal: the order of the R rows.
        share: root mean square error that coefficients leave, in half steps.
    """
    rows = _by_frame(target, n_frames)
    reduced = reduce_trajectories(rows, (share / 2) ** 2 * rows.size, n_axes=target.shape[1] // n_frames)
    n_components = reduced.coefficients.shape[1]
    ranked, decoded = np.zeros(reduced.coefficients.shape, np.int64), np.zeros(reduced.coefficients.shape)
    predict_vectors(causal, reduced.step, ranked, decoded, reduced.coefficients, "kalman", 1.8)
    base = _rebuild(decoded, reduced.decoded)
    left = np.rint(target - _by_component(base, n_frames))
    if max(np.abs(left).max(initial=0), np.abs(ranked).max(initial=0)) >= LARGEST:
        return None
    residuals = np.empty_like(ranked)
    residuals[causal.order] = ranked
    coefficients = encode_residuals(residuals, max(1, n_components), causal)
    corrections = encode_residuals(left.astype(np.int64), n_frames, causal)
    return STEP.pack(reduced.step) + pack_block(reduced.basis) + pack_block(coefficients) + corrections


def decode_trajectories(
    data: bytes, shape: tuple[int, int], causal: CausalOrder, name: str, budget: Budget = UNLIMITED
) -> Float64:
    """Mirror of `encode_trajectories`: values ``(R, N)`` in steps.

    Args:
        data: the bytes.
        shape: F and C.
        causal: the order of the R rows.
        name: of the section, for messages.
        budget: of the file.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
    """
    n_frames, n_axes = shape
    cursor = Cursor(data, name)
    (step,) = cursor.struct(STEP)
    if not SMALLEST_STEP <= step <= LARGEST_STEP:  # NaN neither; the square of a smaller one may be 0, by which weights divide
        raise cursor.corrupt(f"a step of coefficients is {step}")
    n_rows = len(causal.order)
    basis = decode_basis(cursor.block(), n_frames, n_rows, step, name, n_axes, budget=budget)
    n_components = basis.vectors.shape[1]
    residuals = decode_residuals(cursor.block(), n_components, max(1, n_components), causal, name)
    decoded = np.zeros(residuals.shape)
    predict_vectors(causal, step, np.ascontiguousarray(residuals[causal.order]), decoded, None, "kalman", 1.8)
    left = decode_residuals(cursor.rest(), n_axes * n_frames, n_frames, causal, name)
    return _by_component(_rebuild(decoded, basis), n_frames) + left


def _rebuild(decoded: Float64, basis: Basis) -> Float64:
    """``(R, F C)`` values of rows with coefficients ``decoded (R, K)``."""
    from gvpipe.trajectory.product_kernels import weighted_sums

    return weighted_sums(decoded, np.ascontiguousarray(basis.vectors.T)) + basis.mean


def _by_frame(columns: Float64, n_frames: int) -> Float64:
    """``(R, C F) -> (R, F C)``."""
    n_rows = len(columns)
    return np.ascontiguousarray(columns.reshape(n_rows, -1, n_frames).transpose(0, 2, 1).reshape(n_rows, -1))


def _by_component(columns: Float64, n_frames: int) -> Float64:
    """``(R, F C) -> (R, C F)``."""
    n_rows = len(columns)
    return np.ascontiguousarray(columns.reshape(n_rows, n_frames, -1).transpose(0, 2, 1).reshape(n_rows, -1))
