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
            each decoded component updates, at the price of one matrix-vector product at most. It never degenerates. So it
            can use many more neighbours than the ring, and large components may come first.

One body predicts in encoder and decoder, so that the two cannot differ but by rounding. Rounding moves a value by as little and
never a residual, since these are integers. What decoded values decide is which of two forms of ``kalman`` works out the same
prediction.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.trajectory.causal_order import CausalOrder

PREDICTORS = ("navg", "lsp", "rbf", "kalman")


def predict_vectors(
    causal: CausalOrder,
    step: float,
    residuals: Int64,
    decoded: Float64,
    target: Float64 | None,
    predictor: str,
    beta: float,
    begin: int = 0,
    end: int | None = None,
    noises: Float64 | None = None,
    unit: float = 0.0,
) -> None:
    """Code vectors (``target`` given), filling ``residuals`` and ``decoded``, or fill ``decoded`` from ``residuals``.

    Args:
        causal, step, residuals, decoded: as of `gvpipe.trajectory.prediction_kernels.VectorCoding`; ``kalman`` alone may know
            components.
        target: ``(n, R)`` what to code, or None.
        predictor: one of `PREDICTORS`.
        beta: exponent of the radial function (rbf).
        begin, end: which vectors of the order, those before ``begin`` being done; None: up to the last of ``residuals``.
        noises: ``(R,)`` of `gvpipe.trajectory.prediction_kernels.VectorCoding`; None: the squared step.
        unit: as of the same.
    """
    from gvpipe.trajectory import kalman_kernels, prediction_kernels

    if noises is None:
        noises = np.full(decoded.shape[1], step * step)
    wanted = np.zeros((0, 0)) if target is None else target
    coding = prediction_kernels.VectorCoding(causal, step, residuals, decoded, wanted, noises, unit)
    stop = len(residuals) if end is None else end
    if predictor == "kalman":
        kalman_kernels.predict_kalman(coding, begin, stop)
    elif predictor == "rbf":
        prediction_kernels.predict_rbf(coding, begin, stop, beta)
    else:
        getattr(prediction_kernels, f"predict_{predictor}")(coding, begin, stop)


def start_vectors(shape: tuple[int, ...], given: Float64 | None, known: Float64 | None) -> Float64:
    """Return what is decoded of vectors ``(n, R)`` before they are coded; the rest is 0.

    Args:
        shape: n, R.
        given: ``(n, R)`` vectors that the order leaves out (`gvpipe.trajectory.causal_selection.leave_out`).
        known: ``(n, K)`` the first components of all others.
    """
    decoded = np.zeros(shape) if given is None else given.copy()
    if known is not None:
        decoded[:, : known.shape[1]] = known
    return decoded
