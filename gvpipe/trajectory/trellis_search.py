"""The encoder's search for residuals on the trellis (`gvpipe.trajectory.trellis`): of all paths the cheapest, vector by vector.

What: Viterbi's algorithm over a vector's components. A path's cost is its squared error, in squared fine steps, and a penalty
for every bit. The loop is closed: each path has the weights of the ``kalman`` predictor that follow from its own residuals.
Their covariances are those of all paths, since they follow from the neighbours alone.

Vectors whose errors add up may make up for one another's: noise is shaped as by the error feedback of sigma-delta converters.

Bits come from the contexts' first tables, contexts from residuals of plain rounding, which hardly differ. A cost must be less
by a margin to win, so that rounding of the input on other machines decides nothing.
"""

from __future__ import annotations

import functools

import numpy as np

from gvpipe.entropy.tokens import N_EXTRA, tokenise
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.foundation.elementary import log2
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.contexts import check_residuals, context_inputs, level_of
from gvpipe.trajectory.prediction import predict_vectors, start_vectors
from gvpipe.trajectory.trellis import FINENESS, PARTS, WHAT, block_steps, find_noises, first_tables

BASIS_PENALTY, PENALTY = 0.25, 0.22  # of a bit that do best: of a basis, of coefficients
N_PRICED = 64  # magnitudes that have a price of their own
PRICE_ONE = 1024  # prices are whole 1 / PRICE_ONE bits


def search(
    target: Float64,
    step: float,
    causal: CausalOrder,
    given: Float64 | None,
    penalty: float,
    factor: Float64 | None = None,
    flags: int = 0,
    known: Float64 | None = None,
    rounds: bool = False,
) -> tuple[Int64, Int64, Float64]:
    """Return the integers k and the residuals r, both ``(m, R - K)`` by rank, and what they decode to ``(n, R)``.

    Args:
        target, causal, given, known: as of `gvpipe.trajectory.coefficient_coding.encode_vectors`.
        step: of plain rounding, in the unit of the components.
        penalty: of a bit, in squared fine steps.
        factor: M ``(m, m)``, lower triangular, by rank. An error e ``(m, R)`` of the vectors counts as ``|M e|^2``, and each
            vector makes up for the errors of those before, as far as it can. None: an error counts as ``|e|^2``.
        flags: of the stream (`gvpipe.trajectory.trellis`).
        rounds: decoded components are rounded to parts of the fine step, by the decoder, too: for orders along which errors
            of sums would grow.
    """
    from gvpipe.trajectory.context_kernels import find_all_contexts
    from gvpipe.trajectory.prediction_kernels import VectorCoding
    from gvpipe.trajectory.trellis_search_kernels import search_paths

    n_known = 0 if known is None else known.shape[1]
    shape = len(causal.order), target.shape[1] - n_known
    plain, residuals = np.zeros(shape, np.int64), np.zeros(shape, np.int64)
    decoded, found = (start_vectors(target.shape, given, known) for _ in range(2))
    bounds = [0, *causal.blocks.tolist()]
    blocks = [*zip(bounds, bounds[1:], bounds[2:], block_steps(step, len(bounds) - 2, flags).tolist(), strict=False)]
    for before, begin, end, own in blocks:
        noises = find_noises(plain[before:begin], own, flags, n_known)
        predict_vectors(causal, own, plain, decoded, target, "kalman", 0.0, begin, end, noises)
    check_residuals(plain)  # what follows holds for smaller ones alone
    ranked = np.rint(plain * (1 / FINENESS)).astype(np.int64)
    check_residuals(ranked)
    what = flags >> WHAT
    inputs = context_inputs(causal, len(target), level_of(ranked), len(causal.blocks) - 1, what)
    contexts, numbers = find_all_contexts(ranked, inputs), np.zeros(shape, np.int64)
    weights = np.zeros((0, 0)) if factor is None else factor
    for before, begin, end, own in blocks:
        noises = find_noises(residuals[before:begin], own * FINENESS, flags, n_known)
        fine = own * FINENESS
        unit = fine / PARTS if rounds else 0.0
        coding = VectorCoding(causal, fine, residuals, found, target, noises, unit)
        search_paths(coding, contexts, _prices(what > 0), penalty, weights, begin, end, numbers)
        if rounds:  # the search's sums have another order
            predict_vectors(causal, fine, residuals, found, None, "kalman", 0.0, begin, end, noises, unit)
    return numbers, residuals, found


@functools.cache
def _prices(follows_trends: bool) -> Float64:
    """Bits ``(54, N_PRICED)`` of magnitudes of k in each context, the sign counted."""
    tables = first_tables(follows_trends)
    tokens, _, _ = tokenise(np.arange(N_PRICED))
    bits = log2(tables.sum(axis=1, keepdims=True)) - log2(tables[:, tokens]) + N_EXTRA[tokens]
    return np.asarray(np.rint(PRICE_ONE * bits) / PRICE_ONE)
