"""The context model of feature vectors' residuals: its constants, its inputs and its tables of logarithms."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32, Int64, Integers
from gvpipe.foundation.errors import InputError
from gvpipe.trajectory.causal_order import CausalOrder

SHORT = (16, 10, 6, 4)  # weights of a vector's earlier components, the latest first
LONG = (16, 14, 13, 12, 11, 10, 9, 8, 7, 6, 6, 5, 5, 4, 4, 3)
ONE = 64  # fixed point of magnitudes
ENTRY_BITS = ONE.bit_length()  # by which a magnitude is shifted to stand above a sign, in 1 / ONE
PER_OCTAVE = 16  # of integer logarithms
MAX_LEVEL = 160
LARGEST = 1 << 36  # magnitude of a residual, in steps; sums of its forecasts stay below 2**58
FLOOR_SPAN, FLOOR_NEAR = 128, 16  # added to sums of magnitudes: what nothing is taken for
POWERS = (12, 4, 4, 8, 7)  # of the component's mean, the block before, the neighbours, the short and the long span
POWER_ONE = 20
LOWEST, HIGHEST = -10, 16  # contexts, half octaves above magnitude one
N_CONTEXTS = HIGHEST - LOWEST + 1
N_NEAR = 6  # causal neighbours that count
BASIS, FIRST, REST = 1, 2, 3  # what is coded, each with powers of its own: a basis, first components, those that follow
TREND_POWERS = (  # of the mean, what is left of it, the block before, the neighbours, the short, the long, the relative trend
    (),  # contexts by spans, as above
    (6, 6, 4, 7, 9, -2, 11),
    (11, 3, 4, 2, 9, -4, 4),
    (11, 5, 1, 4, 2, 12, 4),
)
TREND_SHIFTS = (2, 5, 3)  # a trend comes nearer to what is new by 1 / 2 ** shift: the short, the long, the relative one
TREND_BITS = 6  # of trends, beyond those of magnitudes
FLOOR_TREND = 128  # added to trends
LEAST_USUAL = 8  # mean magnitude that a relative one counts from, in 1 / ONE
MIDDLE = 279  # of a level, which is rounded down: 2 ** (1 / 8), in 1 / 256
LEAST_LEFT = 4  # what is left of a mean is at least 1 / 2 ** LEAST_LEFT of it
MOST_LEFT = 1 << 48  # what a hostile file may have


class ContextInputs(NamedTuple):
    """What contexts depend on beside residuals; kernels take it as it is.

    Args:
        blocks: ``(B + 1,) int32`` bounds of the blocks that are coded.
        rank: ``(n,) int32`` of each vector in the order.
        starts, neighbours, ring_sizes: of `gvpipe.trajectory.causal_order.CausalOrder`, whose memory they share.
        usual: ``(R,) int64`` mean magnitudes of the components, in 1 / ONE.
        roots: int64, ``2 ** (i / 16)`` rounded down.
        logs: int64, of the smallest numbers, in 1 / PER_OCTAVE: looked up, not searched for.
        powers: int64, one of `TREND_POWERS`.
    """

    blocks: Int32
    rank: Int32
    starts: Int32
    neighbours: Int32
    ring_sizes: Int32
    usual: Int64
    roots: Int64
    logs: Int64
    powers: Int64


class Residuals(NamedTuple):
    """Residuals as far as they are decoded; kernels fill it block by block. All are int64, and 0 to begin with.

    Args:
        ranked: ``(m, R)`` by rank, for predictors.
        rows: ``(R, m)`` for contexts, which read one component at a time: magnitudes in 1 / ONE, above a bit for the sign.
        means: ``(2, R)`` in 1 / ONE (`first_means`): mean magnitudes of the last block, and sums of those of all blocks.
    """

    ranked: Int64
    rows: Int64
    means: Int64


def first_means(inputs: ContextInputs) -> Int64:
    """`Residuals.means` before the first block: `ContextInputs.usual`, and zeros."""
    return np.stack([inputs.usual, np.zeros_like(inputs.usual)])


def context_inputs(causal: CausalOrder, n_vectors: int, levels: Int64, n_blocks: int, what: int = 0) -> ContextInputs:
    """Return the inputs for the first ``n_blocks`` blocks.

    Args:
        causal: the order, of which given vectors may be left out.
        n_vectors: n, given vectors counted.
        levels: ``(R,)`` levels of the components' mean magnitudes (`level_bounds`).
        n_blocks: 0..B.
        what: is coded: 0, or `BASIS`, `FIRST` or `REST`.
    """
    rank = np.full(n_vectors, len(causal.order), np.int32)  # given vectors: behind all blocks, so that they count for 0
    rank[causal.order] = np.arange(len(causal.order), dtype=np.int32)
    given = (causal.blocks[: n_blocks + 1], causal.starts, causal.neighbours, causal.ring_sizes)
    blocks, starts, neighbours, ring_sizes = (np.ascontiguousarray(array, np.int32) for array in given)
    usual, powers = level_bounds()[levels], np.array(TREND_POWERS[what], np.int64)
    return ContextInputs(blocks, rank, starts, neighbours, ring_sizes, usual, _roots(), _logs(), powers)


@functools.cache
def _roots() -> Int64:
    """2 ** (i / 16) rounded down, exactly: four nested integer square roots."""
    roots = [math.isqrt(math.isqrt(math.isqrt(math.isqrt(1 << i)))) for i in range(PER_OCTAVE * 62)]
    return np.array(roots, np.int64)


@functools.cache
def _logs() -> Int64:
    """Logarithms of 0 to 2**14 to base two, in 1 / PER_OCTAVE, rounded down; of 0 as of 1/64."""
    logs: Int64 = np.searchsorted(_roots(), 64 * np.arange(1 << 14) + 1, side="right") - 1 - 6 * PER_OCTAVE
    return logs


@functools.cache
def level_bounds() -> Int64:
    """``(MAX_LEVEL + 1,)``: 2 ** (level / 4) rounded down, exactly."""
    return np.array([math.isqrt(math.isqrt(1 << level)) for level in range(MAX_LEVEL + 1)], np.int64)


def check_residuals(residuals: Int64) -> int:
    """Return the largest magnitude of ``residuals (m, R)``; raises `InputError` where it does not fit."""
    largest = max(int(residuals.max(initial=0)), -int(residuals.min(initial=0)))
    if largest >= LARGEST:
        raise InputError(f"a residual has {largest} quantisation steps, at most {LARGEST} fit; ask for a lower quality")
    return largest


def level_of(residuals: Integers) -> Int64:
    """Levels ``(R,)`` of the components' mean magnitudes in ``residuals (m, R)`` (`level_bounds`)."""
    sums = np.array([np.abs(column).sum() for column in residuals.T], np.int64)  # one at a time: a copy may be large
    means = sums * ONE // max(1, len(residuals))
    return np.searchsorted(level_bounds(), means + 1, side="right").astype(np.int64) - 1
