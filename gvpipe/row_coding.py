"""Rows of coefficients <-> bytes: closed-loop residuals (`row_prediction`), range coded in contexts of their expected
magnitude.

A residual's magnitude is forecast from integers alone, all decoded before: the mean magnitude of its component (sent), how
large the row's earlier components came out against theirs (over a short and a long span), how large the same component was in
the block before and in the rows near. The forecast is a product of powers of these, worked out as a sum of integer
logarithms; in half octaves it is the context, which picks one of `N_CONTEXTS` frequency tables::

    rows  = [varint] bytes of the levels, levels: R integers (`gvpipe.entropy`), differences; then blocks (`gvpipe.blocks`): for
            every block of rows, every component's residuals of those rows
    level = of the component's mean magnitude m: the largest with 2 ** (level / 4) <= 64 m + 1
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gvpipe.binary import Cursor, varint
from gvpipe.blocks import BlockDecoder, BlockEncoder
from gvpipe.entropy import decode_integers, encode_integers
from gvpipe.errors import CorruptFile, InputError
from gvpipe.row_prediction import Rows, predict_rows

SHORT = np.array([16, 10, 6, 4], np.int64)  # weights of a row's earlier components, the latest first
LONG = np.array([16, 14, 13, 12, 11, 10, 9, 8, 7, 6, 6, 5, 5, 4, 4, 3], np.int64)
ONE = 64  # fixed point of magnitudes
PER_OCTAVE = 16  # of integer logarithms
MAX_LEVEL = 160
FLOOR_SPAN, FLOOR_NEAR = 128, 16  # added to sums of magnitudes: what nothing is taken for
POWERS = (12, 4, 4, 8, 7)  # of the component's mean, the block before, the rows near, the short and the long span
POWER_ONE = 20
LOWEST, HIGHEST = -10, 16  # contexts, half octaves above magnitude one
N_CONTEXTS = HIGHEST - LOWEST + 1
N_NEAR = 6  # rows near that count
LARGEST = 1 << 36  # magnitude of a residual, in steps; sums of its forecasts stay below 2**58
MAX_VALUES = 1 << 27  # of a section: rows times components

Int64 = NDArray[np.int64]
Float64 = NDArray[np.float64]
Take = Callable[[slice, int, Int64], Int64]


def encode_rows(
    target: Float64, step: float, rows: Rows, predictor: str = "kalman", beta: float = 1.8
) -> tuple[bytes, Float64]:
    """Code ``target (n, R)`` with a quantisation step; return the bytes and what the decoder will have.

    Raises:
        InputError: a value is too large for the step.
    """
    residuals = np.zeros(target.shape, np.int64)
    decoded = np.zeros(target.shape)
    predict_rows(rows, step, residuals, decoded, target, predictor, beta)
    largest = int(np.abs(residuals).max(initial=0))
    if largest >= LARGEST:
        raise InputError(f"a residual has {largest} quantisation steps, at most {LARGEST} fit; ask for a lower quality")
    means = np.abs(residuals).sum(axis=0) * ONE // max(1, len(residuals))
    levels = np.searchsorted(_level_bounds(), means + 1, side="right") - 1
    coder = BlockEncoder(N_CONTEXTS)

    def add(block: slice, component: int, contexts: Int64) -> Int64:
        coder.add(residuals[block, component], contexts)
        return residuals[block, component]

    _visit(rows, levels, len(rows.blocks) - 1, add)
    head = encode_integers(np.diff(levels, prepend=0))
    return varint(len(head)) + head + coder.finish(), decoded


def decode_rows(
    data: bytes,
    n_components: int,
    step: float,
    rows: Rows,
    name: str,
    n_blocks: int | None = None,
    predictor: str = "kalman",
    beta: float = 1.8,
) -> Float64:
    """Mirror of `encode_rows`: ``(n, R)``; of the first ``n_blocks`` blocks only if given, other rows stay 0.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
    """
    cursor = Cursor(data, name)
    if len(rows.order) * n_components > MAX_VALUES:  # zeros may cost no bits: believe no counts beyond this
        raise cursor.corrupt(f"{len(rows.order)} rows of {n_components} components")
    head = cursor.take(cursor.varint(cursor.left, "a length"))
    levels = np.cumsum(decode_integers(head, n_components, name=name))
    if ((levels < 0) | (levels > MAX_LEVEL)).any():
        raise cursor.corrupt("a magnitude level is out of range")
    coder = BlockDecoder(cursor.rest(), N_CONTEXTS, name)
    wanted = len(rows.blocks) - 1 if n_blocks is None else n_blocks
    residuals = _visit(rows, levels, wanted, lambda _block, _component, contexts: coder.take(contexts))
    if n_blocks is None:
        coder.end()
    if np.abs(residuals).max(initial=0) >= LARGEST:
        raise CorruptFile(f"section {name!r} is corrupt: a residual is out of range; get the file again from its source")
    decoded = np.zeros((len(rows.order), n_components))
    predict_rows(rows, step, residuals, decoded, None, predictor, beta)
    return decoded


def _visit(rows: Rows, levels: Int64, n_blocks: int, take: Take) -> Int64:
    """Walk over blocks and components, work out contexts and take the residuals: ``(m, R)`` of all rows visited."""
    n_components = len(levels)
    end = int(rows.blocks[n_blocks])
    usual = _level_bounds()[levels]  # magnitude of each component, in 1 / ONE
    residuals = np.zeros((end, n_components), np.int64)
    magnitudes = np.zeros((len(rows.order) + 1, n_components), np.int64)  # by row, in 1 / ONE; the last row stands for "none"
    before = usual
    for b in range(n_blocks):
        block = slice(int(rows.blocks[b]), int(rows.blocks[b + 1]))
        around, count = _around(rows, block)
        now = np.zeros((block.stop - block.start, n_components), np.int64)
        for c in range(n_components):
            near = magnitudes[around, c].sum(axis=1) // count if b else usual[c]
            forecast = POWERS[0] * _log(usual[c]) + POWERS[1] * _log(before[c]) + POWERS[2] * _log(near + FLOOR_NEAR)
            for taps, power in ((SHORT, POWERS[3]), (LONG, POWERS[4])):
                first = max(0, c - len(taps))
                weights = taps[: c - first][::-1]
                found, expected = now[:, first:c] @ weights, usual[first:c] @ weights
                forecast = forecast + power * (_log(found + FLOOR_SPAN) - _log(expected + FLOOR_SPAN))
            octaves = forecast // POWER_ONE - PER_OCTAVE * (ONE.bit_length() - 1)
            contexts = np.clip(octaves // (PER_OCTAVE // 2), LOWEST, HIGHEST) - LOWEST
            residuals[block, c] = take(block, c, np.broadcast_to(contexts, len(now)))
            now[:, c] = ONE * np.abs(residuals[block, c])
        magnitudes[rows.order[block]] = now
        before = now.sum(axis=0) // len(now) + 1
    return residuals


def _around(rows: Rows, block: slice) -> tuple[Int64, Int64]:
    """Rows whose magnitudes count for each row of a block ``(n, N_NEAR)``, padded with "none"; how many there are, at least
    1."""
    starts = rows.starts[block].astype(np.int64)
    known = rows.starts[block.start + 1 : block.stop + 1] - starts
    counts = np.minimum(np.minimum(rows.rings[block], known), N_NEAR)
    place = np.arange(N_NEAR)
    padded = np.append(rows.near, len(rows.order)).astype(np.int64)
    around = padded[np.where(place < counts[:, None], starts[:, None] + place, len(rows.near))]
    return around, np.maximum(counts, 1).astype(np.int64)


def _log(values: Int64) -> Int64:
    """Logarithms of integers to base two, in 1 / PER_OCTAVE, rounded down; of 0 as of 1/64."""
    logs: Int64 = np.searchsorted(_powers(), 64 * np.maximum(values, 0) + 1, side="right") - 1 - 6 * PER_OCTAVE
    return logs


@functools.cache
def _powers() -> Int64:
    """2 ** (i / 16) rounded down, exactly: four nested integer square roots."""
    roots = [math.isqrt(math.isqrt(math.isqrt(math.isqrt(1 << i)))) for i in range(PER_OCTAVE * 58)]
    return np.array(roots, np.int64)


@functools.cache
def _level_bounds() -> Int64:
    """2 ** (level / 4) rounded down, exactly."""
    return np.array([math.isqrt(math.isqrt(1 << level)) for level in range(MAX_LEVEL + 1)], np.int64)
