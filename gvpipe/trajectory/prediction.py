"""Closed-loop prediction of feature vectors from their causal neighbours, component after component.

What: vector i (a vertex' coefficients, or a basis' entries of one frame and axis) is predicted as a weighted sum of decoded
vectors, its causal neighbours, and only the difference, in whole steps, is kept. Each decoded component of the vector itself
says more about the right weights for the next one: the motion of a point relative to its neighbours stays what it is.

Predictors, after Vasa and Skala, "Geometry-Driven Local Neighbourhood Based Predictors for Dynamic Mesh Compression", 2010:

``navg``    the prior weights alone (section 3.2, equation 2): the ring's average, the parallelogram in the coarsest mesh.
``lsp``     weights by least squares over the components decoded so far (section 3.4); the prior weights for the first N.
``rbf``     interpolation by radial functions r**beta with a constant and its side condition (section 3.5), distances growing
            with every component; ``lsp`` in the coarsest mesh.
``kalman``  the section's idea as Bayes has it, and the default. Weights have a prior mean (``navg``'s) and covariance, which
            each decoded component updates, at the price of one matrix-vector product. It never degenerates. So it can use many
            more neighbours than the ring, and large components may come first.

One body predicts in encoder and decoder, so that the two cannot differ but by rounding. Rounding moves a value by as little and
never a decision, since residuals are integers and nothing else is decided from decoded values.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.arrays import Bool, Float64, Int32, Int64

PREDICTORS = ("navg", "lsp", "rbf", "kalman")


class CausalOrder(NamedTuple):
    """In which order n vectors are coded, and from which causal neighbours each is predicted; kernels take it as it is.

    Args:
        order: ``(n,)`` vectors.
        starts: ``(n + 1,)`` bounds of each vector's causal neighbours in ``neighbours``.
        neighbours: vectors, each earlier in ``order``, or given (`leave_out`).
        weights, variances: prior means and variances of the neighbours' weights, as long as ``neighbours``.
        ring_sizes: ``(n,)`` how many of the first neighbours ``navg``, ``lsp`` and ``rbf`` use; 0: none of them interpolates.
        blocks: ``(B + 1,)`` bounds in ``order`` of blocks that are entropy coded at once.
        affine: the weights of a vector's neighbours sum to one (points), or not (vectors).
    """

    order: Int32
    starts: Int32
    neighbours: Int32
    weights: Float64
    variances: Float64
    ring_sizes: Int32
    blocks: Int32
    affine: bool


class VectorCoding(NamedTuple):
    """What a predictor codes or decodes, component after component.

    Args:
        causal: the order.
        step: quantisation step of every component.
        residuals: ``(m, R)`` of the first m vectors of the order, in steps.
        decoded: ``(n, R)`` components, by vector, in the order of transmission. Given vectors are there already.
        target: ``(n, R)`` what to code; ``(0, 0)``: decode.
    """

    causal: CausalOrder
    step: float
    residuals: Int64
    decoded: Float64
    target: Float64


def select_vectors(causal: CausalOrder, keep: Bool) -> CausalOrder:
    """Keep the vectors whose rank in the order ``keep (n,)`` marks, and number them by rank; neighbours must be marked too."""
    kept = _keep_ranks(causal, keep)
    number = np.zeros(len(keep), np.int32)
    number[kept.order] = np.arange(len(kept.order), dtype=np.int32)
    return kept._replace(order=np.arange(len(kept.order), dtype=np.int32), neighbours=number[kept.neighbours])


def leave_out(causal: CausalOrder, given: Bool) -> CausalOrder:
    """Leave out the vectors that ``given (n,)`` marks, which are known beforehand; vectors keep their numbers."""
    return _keep_ranks(causal, ~given[causal.order])


def _keep_ranks(causal: CausalOrder, keep: Bool) -> CausalOrder:
    counts = np.diff(causal.starts)
    wanted = np.repeat(keep, counts)
    return CausalOrder(
        order=causal.order[keep],
        starts=np.concatenate([[0], np.cumsum(counts[keep])]).astype(np.int32),
        neighbours=causal.neighbours[wanted],
        weights=causal.weights[wanted],
        variances=causal.variances[wanted],
        ring_sizes=causal.ring_sizes[keep],
        blocks=np.unique(np.concatenate([[0], np.cumsum(keep)])[causal.blocks]).astype(np.int32),
        affine=causal.affine,
    )


def predict_vectors(
    causal: CausalOrder, step: float, residuals: Int64, decoded: Float64, target: Float64 | None, predictor: str, beta: float
) -> None:
    """Code vectors (``target`` given), filling ``residuals`` and ``decoded``, or fill ``decoded`` from ``residuals``.

    Args:
        causal, step, residuals, decoded: as of `VectorCoding`.
        target: ``(n, R)`` what to code, or None.
        predictor: one of `PREDICTORS`.
        beta: exponent of the radial function (rbf).
    """
    from gvpipe.trajectory import prediction_kernels

    coding = VectorCoding(causal, step, residuals, decoded, np.zeros((0, 0)) if target is None else target)
    if predictor == "rbf":
        prediction_kernels.predict_rbf(coding, beta)
    else:
        getattr(prediction_kernels, f"predict_{predictor}")(coding)
