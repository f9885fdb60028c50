"""Trellis coded quantisation of residuals: two quantisers of double steps, and a state machine that says which comes next.

A residual r counts fine steps, each `FINENESS` of the step asked for. In a state of quantiser 0 it is even, ``r = 2 k``. In a
state of quantiser 1 it is odd or 0, ``r = 2 k - sign(k)``. The integer k is what is coded. Its parity leads to the next state,
and the quantiser of a state is its lowest bit. Each vector starts in state 0; its components follow in order. So an integer
costs what double steps cost, and a path of residuals comes closer than these would. The encoder searches for the path
(`gvpipe.trajectory.trellis_search`).

Sources: M. W. Marcellin and T. R. Fischer, "Trellis Coded Quantization of Memoryless and Gauss-Markov Sources", 1990, with both
quantisers holding 0 as in the dependent quantisation of VVC (H. Schwarz et al., "Hybrid Video Coding with Trellis-Coded
Quantization", 2019). The code of eight states is that of G. Ungerboeck, "Channel Coding with Multilevel/Phase Signals", 1982,
table I (parity checks 13 and 04, octal).
"""

from __future__ import annotations

import functools

import numpy as np

from gvpipe.entropy import parametric_tables
from gvpipe.entropy.tokens import MAX_TOKENS
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.trajectory.contexts import N_CONTEXTS

FINENESS = 21 / 32  # of a step
PARTS = 16  # of a fine step, to which decoded components are rounded along orders where rounding of sums would grow
GRADES, FINDS_NOISES = 1, 2  # flags of a stream: steps by block (`block_steps`), noises by component (`find_noises`)
WHAT = 2  # bits of flags below what is coded (`gvpipe.trajectory.contexts.TREND_POWERS`)
FALL, LEAST_GRADE = 0.96, 5 / 8  # of a block's step, in that of the next; in that of the last
N_STATES, N_QUANTISERS = 8, 2
FEEDBACK, PARITY = 5, 2  # of the code: state s leads to ``(s >> 1) ^ FEEDBACK (s & 1) ^ PARITY (k & 1)``
ZEROS = (  # first tables (`parametric_tables.table`): of each quantiser, by the context of the forecast
    (255, 255, 254, 252, 247, 242, 235, 224, 206, 184, 152, 118, 88, 66, 49, 35, 26, 19, 14, 10, 8, 7, 6, 5, 4, 3, 2),
    (255, 254, 249, 240, 226, 211, 193, 172, 146, 119, 90, 69, 51, 37, 28, 20, 15, 11, 8, 7, 5, 4, 4, 3, 2, 2, 1),
)
SHAPES = (0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 4, 6, 8, 10, 12, 14, 17, 19, 21, 23, 24, 25, 26, 27, 28, 29)
TREND_ZEROS = (  # the same where contexts follow trends
    (255, 254, 252, 249, 243, 236, 228, 213, 190, 163, 130, 101, 77, 58, 43, 32, 24, 17, 12, 9, 7, 5, 4, 4, 3, 3, 2),
    (254, 246, 238, 224, 207, 185, 159, 134, 108, 83, 66, 50, 39, 28, 21, 15, 12, 9, 6, 5, 4, 3, 2, 2, 2, 2, 1),
)
TREND_SHAPES = (0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 3, 5, 6, 8, 10, 13, 15, 18, 20, 22, 23, 25, 26, 27, 27, 28, 29)


def block_steps(step: float, n_blocks: int, flags: int) -> Float64:
    """Steps ``(B,)`` of blocks.

    With `GRADES`, earlier blocks have finer steps: later vectors are predicted from theirs, and their errors go on.

    Examples:
        >>> block_steps(1.0, 3, GRADES)
        array([0.9216, 0.96  , 1.    ])
    """
    steps, grade = np.full(n_blocks, step), 1.0
    for b in range(n_blocks - 1, -1, -1) if flags & GRADES else ():
        steps[b] = step * grade
        grade = max(LEAST_GRADE, FALL * grade)
    return steps


def find_noises(before: Int64, step: float, flags: int, n_known: int = 0) -> Float64:
    """Variances ``(K + R,)`` of what the weights of ``kalman`` do not explain, squared units of the components.

    With `FINDS_NOISES`, what a component came out at in the block before adds to that of rounding.

    Args:
        before: ``(m, R)`` residuals of the block before, in fine steps; m is 0 before the first.
        step: the fine one.
        flags: of the stream.
        n_known: K, components before those of the stream, which are known.
    """
    noises = np.full(n_known + before.shape[1], step * step)
    if flags & FINDS_NOISES and len(before):
        means = np.abs(before).sum(axis=0) / len(before)
        noises[n_known:] *= 1 + np.square(means / 4)
    return noises


@functools.cache
def _first_tables(follows_trends: bool) -> Int64:
    tables = np.ones((N_CONTEXTS, N_QUANTISERS, MAX_TOKENS), np.int64)
    for context, shape in enumerate(TREND_SHAPES if follows_trends else SHAPES):
        for quantiser, zeros in enumerate(TREND_ZEROS if follows_trends else ZEROS):
            tables[context, quantiser, : parametric_tables.N_TOKENS] = parametric_tables.table(zeros[context], shape)
    return tables.reshape(N_CONTEXTS * N_QUANTISERS, MAX_TOKENS)


def first_tables(follows_trends: bool) -> Int64:
    """Frequencies ``(54, MAX_TOKENS)`` that contexts, by spans or trends, begin with; context 2 c + q is c with quantiser q."""
    return _first_tables(follows_trends).copy()
