"""Closed-loop prediction of rows of coefficients from rows known already, component after component.

What: row i (a vertex's feature vector, or a frame's row of the basis) is predicted as a weighted sum of the decoded rows near
it, and only the difference, in whole steps, is kept. Each decoded component of the row itself tells more about the right
weights for the next one: the motion of a point relative to its neighbours stays what it is.

Predictors, after Vasa and Skala, "Geometry-Driven Local Neighbourhood Based Predictors for Dynamic Mesh Compression", 2010:

``navg``    the prior weights alone (section 3.2, equation 2): the ring's average, the parallelogram in the coarse mesh.
``lsp``     weights by least squares over the components known so far (section 3.4); the ring's average for the first N.
``rbf``     interpolation by radial functions r**beta with a constant and its side condition (section 3.5), distances growing
            with every component; ``lsp`` in the coarse mesh.
``kalman``  the section's idea as Bayes has it, and the default: weights have a prior mean (``navg``'s) and covariance, which
            each decoded component updates, at the price of one matrix-vector product. It never degenerates, so that it can use
            many more known rows than the ring, and it sends large components first without harm.

One body predicts in encoder and decoder, so that the two cannot differ but by rounding; rounding moves a value by as little and
never a decision, since residuals are integers and nothing else is decided from decoded values.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Bool, Float64, Int32, Int64

PREDICTORS = ("navg", "lsp", "rbf", "kalman")


@dataclass(frozen=True)
class Rows:
    """In which order n rows are coded, and from what each is predicted.

    Args:
        order: ``(n,)`` rows.
        starts: ``(n + 1,)`` bounds of each row's known rows in ``near``.
        near: known rows, each earlier in ``order``, or given (`rows_left`).
        weights, variances: prior means and variances of the weights, as long as ``near``.
        rings: ``(n,)`` how many of the first known rows ``navg``, ``lsp`` and ``rbf`` use; 0: none of them interpolates here.
        blocks: ``(B + 1,)`` bounds in ``order`` of blocks that are entropy coded at once.
        affine: the weights of a row sum to one (points), or not (vectors).
    """

    order: Int32
    starts: Int32
    near: Int32
    weights: Float64
    variances: Float64
    rings: Int32
    blocks: Int32
    affine: bool


def select_rows(rows: Rows, keep: Bool) -> Rows:
    """The rows whose place in the order ``keep (n,)`` marks, renumbered by place; what they know must be marked, too."""
    left = _keep_places(rows, keep)
    number = np.zeros(len(keep), np.int32)
    number[left.order] = np.arange(len(left.order), dtype=np.int32)
    return dataclasses.replace(left, order=np.arange(len(left.order), dtype=np.int32), near=number[left.near])


def rows_left(rows: Rows, given: Bool) -> Rows:
    """The rows that are left to be coded if those that ``given (n,)`` marks are known beforehand; rows keep their numbers."""
    return _keep_places(rows, ~given[rows.order])


def _keep_places(rows: Rows, keep: Bool) -> Rows:
    counts = np.diff(rows.starts)
    wanted = np.repeat(keep, counts)
    return Rows(
        order=rows.order[keep],
        starts=np.concatenate([[0], np.cumsum(counts[keep])]).astype(np.int32),
        near=rows.near[wanted],
        weights=rows.weights[wanted],
        variances=rows.variances[wanted],
        rings=rows.rings[keep],
        blocks=np.unique(np.concatenate([[0], np.cumsum(keep)])[rows.blocks]).astype(np.int32),
        affine=rows.affine,
    )


def predict_rows(
    rows: Rows, step: float, residuals: Int64, decoded: Float64, target: Float64 | None, predictor: str, beta: float
) -> None:
    """Code (``target`` given) or decode rows: fill ``residuals`` and ``decoded``, or ``decoded`` from ``residuals``.

    Args:
        rows: of any number n.
        step: quantisation step of every component.
        residuals: ``(m, R)`` for the first m rows of the order, in steps.
        decoded: ``(n, R)`` components, by row; in the order of transmission. Given rows are there already.
        target: ``(n, R)`` what to code, or None.
    """
    from gvpipe.trajectory.prediction_kernels import predict

    predict(
        rows.order[: len(residuals)],
        rows.starts,
        rows.near,
        rows.weights,
        rows.variances,
        rows.rings,
        rows.affine,
        step,
        PREDICTORS.index(predictor),
        beta,
        residuals,
        decoded,
        np.zeros((0, 0)) if target is None else target,
    )
