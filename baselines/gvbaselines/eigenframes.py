"""Principal frames of a segment, chosen for an error and coded: what `pcaanim` and `kglpc` share.

A frame is one vector of 3 P coordinates. The mean frame and the leading eigenvectors of the frames' covariance span a space in
which a frame is a few coefficients. Frames of the basis are meshes, so their coordinates are predicted by the parallelogram::

    basis = [float64] step D, [varint] components R, [R x int16] scales, columns of the mean frame, of each principal one

A principal frame k is scaled before it is rounded to D: by 2 ** (scale / 8), which is about the square root of its energy, so
that a rounding error in it costs as much as one in its coefficients. How many components pay, and the step that leaves an
error, are worked out as for `gvpipe.trajectory.basis`. Neither paper says how it quantises.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvbaselines.numbers import STEP, decode_columns, encode_columns, multiples, quantise, read_step
from gvbaselines.parallelogram import residuals_of, traversal_of, values_of
from gvbaselines.plain_basis import PER_OCTAVE, find_scales, read_scales
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, varint
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.trajectory.basis import Basis, choose_step, count_components, find_principal, fit_coefficients

MAX_COMPONENTS = 4096


@dataclass(frozen=True)
class CodedBasis:
    """A basis as its bytes and as it is decoded: ``mean (3P,)``, ``vectors (3P, R)``; the step of its numbers, model units."""

    data: bytes
    basis: Basis
    step: float


def code_basis(frames: Float64, mesh: Topology, error: float) -> CodedBasis:
    """Choose and code a basis for ``frames (n, P, 3)``, so that about the root mean square ``error`` of a point is left."""
    rows = frames.reshape(len(frames), -1)
    squared = error * error * len(frames) * mesh.n_points
    principal = find_principal(rows, squared)
    step, kept = choose_step(
        principal, squared, lambda step: count_components(principal, len(frames), step), sum(rows.shape) / 12
    )
    kept = min(kept, MAX_COMPONENTS)
    scales = find_scales(principal.energies[:kept])
    columns = np.column_stack([principal.mean, principal.vectors[:, :kept]]) * _factors(scales, len(frames))
    values = quantise(columns, step)
    residuals = residuals_of(values.reshape(mesh.n_points, -1), traversal_of(mesh))  # (3P, 1 + R) -> (P, 3 (1 + R))
    head = STEP.pack(step) + varint(kept) + scales.astype("<i2").tobytes()
    return CodedBasis(head + encode_columns(residuals), _basis(multiples(values, step), scales, len(frames)), step)


def read_basis(cursor: Cursor, mesh: Topology, n_frames: int) -> tuple[Basis, float]:
    """Mirror of `code_basis`: the basis and its step; raises `CorruptFile`."""
    step = read_step(cursor)
    kept = cursor.varint(min(MAX_COMPONENTS, n_frames), "the number of components")
    scales = read_scales(cursor, kept)
    residuals = decode_columns(cursor, mesh.n_points, 3 * (1 + kept))
    values = values_of(residuals, traversal_of(mesh)).reshape(3 * mesh.n_points, 1 + kept)
    return _basis(multiples(values, step), scales, n_frames), step


def fit_frames(frames: Float64, basis: Basis) -> Float64:
    """Coefficients ``(n, R)`` of ``frames (n, P, 3)`` that fit the decoded basis best."""
    return fit_coefficients(frames.reshape(len(frames), -1), basis)


def rebuild(coefficients: Float64, basis: Basis) -> Float64:
    """Frames ``(n, P, 3)`` of ``coefficients (n, R)``."""
    return (basis.mean + coefficients @ basis.vectors.T).reshape(len(coefficients), -1, 3)


def _factors(scales: Int64, n_frames: int) -> Float64:
    """What the mean and the principal frames are multiplied by."""
    return np.concatenate([[np.sqrt(n_frames)], 2.0 ** (scales / PER_OCTAVE)])


def _basis(columns: Float64, scales: Int64, n_frames: int) -> Basis:
    columns = columns / _factors(scales, n_frames)
    return Basis(columns[:, 0], np.ascontiguousarray(columns[:, 1:]))
