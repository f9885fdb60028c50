"""Principal components of frames, whose coefficients are predicted linearly in time.

Karni and Gotsman, "Compression of Soft-Body Animation Sequences", Computers and Graphics 28(1), 2004. A frame's centre is taken
out; the other coordinates are a sum of principal frames. A coefficient is predicted from the same one in the frames before::

    c_f = a_1 c_(f-1) + a_2 c_(f-2) + r_f

The weights are found by least squares for each component. The residuals r are rounded to the step and range coded::

    segment = basis (`eigenframes`), [(3 + R) x 2 x int16] weights in 1/4096, residuals [columns] of centres, of coefficients

Readings: coefficients are rounded before they are predicted, so that nothing accumulates. The centres' three coordinates are
predicted as coefficients are. ``taps`` is the order of prediction; the paper takes 2. 0 leaves its PCA alone, without LPC.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.eigenframes import code_basis, fit_frames, read_basis, rebuild
from gvbaselines.numbers import STEP, decode_columns, encode_columns, multiples, quantise, read_step
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.arrays import Float64, Int64

MAX_TAPS = 4
ONE = 1 << 12  # weights are multiples of 1/ONE
RIDGE = 1e-9
MOST = 1 << 40  # a coefficient, in steps: beyond, products with weights would not fit
CENTRE_STEP = 0.25  # of the error: a centre's rounding error is one of all points


@dataclass(frozen=True)
class KgLpc(Baseline):
    """Settings of PCA with linear prediction."""

    id: ClassVar[str] = "kglpc"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "principal components of frames, linear prediction in time (Karni and Gotsman 2004)"

    taps: int = 2  # coefficients before that predict one, 0..4

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_range(0, MAX_TAPS, "taps")

    def header(self) -> dict[str, Any]:
        """The order of prediction."""
        return {"taps": self.taps}

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        centre_step = CENTRE_STEP * error
        centres = quantise(frames.mean(axis=1), centre_step)
        centred = frames - multiples(centres, centre_step)[:, None]
        coded = code_basis(centred, mesh, error)
        coefficients = quantise(fit_frames(centred, coded.basis), coded.step)
        return STEP.pack(centre_step) + coded.data + _encode_series(np.column_stack([centres, coefficients]), self.taps)

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        taps = settings.integer("taps", 0, MAX_TAPS)
        centre_step = read_step(cursor)
        basis, step = read_basis(cursor, mesh, n_frames)
        series = _decode_series(cursor, n_frames, 3 + basis.vectors.shape[1], taps)
        cursor.end()
        return rebuild(multiples(series[:, 3:], step), basis) + multiples(series[:, None, :3], centre_step)


def _encode_series(series: Int64, taps: int) -> bytes:
    """Code ``series (n, m)`` by what linear prediction leaves of them."""
    weights = _find_weights(series, taps)
    residuals = series - np.stack([_predict(series[:f], weights) for f in range(len(series))])
    return weights.astype("<i2").tobytes() + encode_columns(residuals)


def _decode_series(cursor: Cursor, n_frames: int, n_columns: int, taps: int) -> Int64:
    """Mirror of `_encode_series`; raises `CorruptFile`."""
    weights = cursor.array("<i2", taps * n_columns).astype(np.int64).reshape(taps, n_columns)
    series = decode_columns(cursor, n_frames, n_columns)
    for f in range(n_frames):
        series[f] += _predict(series[:f], weights)
        if np.abs(series[f]).max(initial=0) > MOST:
            raise cursor.corrupt("a coefficient is out of range")
    return series


def _find_weights(series: Int64, taps: int) -> Int64:
    """Weights ``(taps, m)``, in 1/ONE, that predict each series best; those of too short ones are 0."""
    weights = np.zeros((taps, series.shape[1]), np.int64)
    if not taps or len(series) <= 2 * taps:
        return weights
    wanted = series[taps:].astype(np.float64)
    before = np.stack([series[taps - t - 1 : len(series) - t - 1] for t in range(taps)]).astype(np.float64)  # (taps, n', m)
    gram = np.einsum("afm,bfm->mab", before, before)
    gram += (RIDGE * np.einsum("maa->m", gram) + 1)[:, None, None] * np.eye(taps)
    found = np.linalg.solve(gram, np.einsum("afm,fm->ma", before, wanted)[..., None])[..., 0]
    return np.asarray(np.clip(np.rint(found.T * ONE), -(1 << 15), (1 << 15) - 1), np.int64)


def _predict(before: Int64, weights: Int64) -> Int64:
    """What the last of ``before (f, m)`` predict of the next: ``(m,)``; the frame before it if there are fewer than taps."""
    taps = len(weights)
    if not taps or not len(before):
        return np.zeros(before.shape[1], np.int64)
    if len(before) < taps:
        return np.asarray(before[-1])
    return np.asarray(((weights * before[: -taps - 1 : -1]).sum(axis=0) + ONE // 2) >> 12)
