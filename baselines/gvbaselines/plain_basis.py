"""Principal trajectories of a cluster as bytes, each number by itself: what `cpca` and `rlpca` share.

A principal trajectory is scaled by 2 ** (scale / 8), about the square root of its energy. It is then rounded to the step, as
coefficients are. Nothing is predicted in time but the mean::

    basis = [varint] components R, [R x int16] scales, mean [columns]: differences in time, vectors [columns]
"""

from __future__ import annotations

import numpy as np

from gvbaselines.numbers import decode_columns, encode_columns, multiples, quantise
from gvpipe.container.cursor import Cursor, varint
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.trajectory.basis import Basis, Principal

MAX_SCALE, PER_OCTAVE = 8 * 120, 8


def encode_plain(principal: Principal, kept: int, n_points: int, step: float) -> tuple[bytes, Basis]:
    """Code the mean and the first principal trajectories of a cluster, each number by itself.

    Args:
        principal: trajectories of the cluster's points over n frames.
        kept: R, components that are coded.
        n_points: P of the cluster.
        step: of numbers, model units.

    Returns:
        The bytes, and the basis as it is decoded: ``mean (3n,)``, ``vectors (3n, R)``.
    """
    scales = find_scales(principal.energies[:kept])
    mean = quantise(principal.mean * np.sqrt(n_points), step).reshape(-1, 3)
    vectors = quantise(principal.vectors[:, :kept] * 2.0 ** (scales / PER_OCTAVE), step)
    head = varint(kept) + scales.astype("<i2").tobytes()
    data = head + encode_columns(np.diff(mean, axis=0, prepend=0)) + encode_columns(vectors)
    return data, _scaled(mean, vectors, scales, n_points, step)


def decode_plain(cursor: Cursor, n_frames: int, n_points: int, step: float) -> Basis:
    """Mirror of `encode_plain`; raises `CorruptFile`."""
    kept = cursor.varint(min(n_points, 3 * n_frames), "the number of components")
    scales = read_scales(cursor, kept)
    mean = np.cumsum(decode_columns(cursor, n_frames, 3), axis=0)
    vectors = decode_columns(cursor, 3 * n_frames, kept)
    cursor.end()
    return _scaled(mean, vectors, scales, n_points, step)


def find_scales(energies: Float64) -> Int64:
    """Scales ``(R,)`` of principal vectors, in 1 / `PER_OCTAVE` of an octave, from their energies ``(R,)``."""
    scales = np.rint(PER_OCTAVE * np.log2(np.sqrt(energies))).astype(np.int64)
    return np.asarray(np.clip(scales, -MAX_SCALE, MAX_SCALE))


def read_scales(cursor: Cursor, kept: int) -> Int64:
    """Read ``kept`` scales, int16 each; raises `CorruptFile`."""
    scales = cursor.array("<i2", kept).astype(np.int64)
    if (np.abs(scales) > MAX_SCALE).any():
        raise cursor.corrupt("a scale is out of range")
    return scales


def _scaled(mean: Int64, vectors: Int64, scales: Int64, n_points: int, step: float) -> Basis:
    return Basis(multiples(mean.ravel(), step / np.sqrt(n_points)), multiples(vectors, step) / 2.0 ** (scales / PER_OCTAVE))
