"""Kernels of `gvpipe.trajectory.prediction`: one loop over rows and components, in encoder and decoder alike."""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Array, Float64
from gvpipe.compiled import compiled

LSP, RBF, KALMAN = 1, 2, 3  # places in PREDICTORS

ROUND_UP = 0.42  # added before a residual's magnitude is cut to whole steps: 0.5 would cost 1.5 % more at equal error
DOUBT = 1e-4  # of kalman: part of a weight's variance that a component leaves at least, so that rounding cannot grow
RIDGE, COARSE_RIDGE = 4.0, 64.0  # of lsp, in squared steps: draws weights that are left open to the prior ones
NUGGET = 16  # of rbf, in units of step**beta: what quantisation adds to the radial function between two rows
EVERY = 4  # rbf's weights are solved for each of the first components, then for every fourth: distances hardly change
FIRST = 12


@compiled
def solve(a: Float64, b: Float64, n: int) -> None:
    """Solve the positive definite system of the first n unknowns in place (Cholesky)."""
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            if i == j:
                a[i, i] = np.sqrt(max(total, 1e-300))
            else:
                a[i, j] = total / a[j, j]
    for i in range(n):
        total = b[i]
        for k in range(i):
            total -= a[i, k] * b[k]
        b[i] = total / a[i, i]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for k in range(i + 1, n):
            total -= a[k, i] * b[k]
        b[i] = total / a[i, i]


@compiled
def radial_weights(squared: Float64, own: Float64, n: int, beta: float, nugget: float, a: Float64, w: Float64) -> None:
    """Weights of rbf interpolation: equation 11 with its side condition used to eliminate the first row.

    With lambda_1 = -(lambda_2 + ...) the system in the others is positive definite, for 0 < beta < 2, and so is its sum with
    a nugget; the interpolated value is then a sum of the known ones whose weights add up to one.
    """
    half = beta / 2
    total = 1.0
    for i in range(1, n):
        to_first = squared[i, 0] ** half
        for j in range(1, i + 1):
            between = squared[i, j] ** half if i != j else 0.0
            a[i - 1, j - 1] = to_first + squared[j, 0] ** half - between + nugget
        a[i - 1, i - 1] += nugget
        w[i] = to_first + own[0] ** half - own[i] ** half + nugget
    solve(a, w[1:], n - 1)
    for i in range(1, n):
        total -= w[i]
    w[0] = total


@compiled
def predict(
    order: Array,
    starts: Array,
    near: Array,
    weights: Float64,
    variances: Float64,
    rings: Array,
    affine: bool,
    step: float,
    predictor: int,
    beta: float,
    residuals: Array,
    decoded: Float64,
    target: Float64,
) -> None:
    """See `gvpipe.trajectory.prediction.predict_rows`.

    ``cov`` is the weights' covariance (kalman), the normal matrix (lsp) or squared distances between the known rows (rbf).
    """
    n_components = decoded.shape[1]
    widest = 1
    for i in range(len(order)):
        widest = max(widest, starts[i + 1] - starts[i])
    w, y, p = np.zeros(widest), np.zeros(widest), np.zeros(widest)
    right, own = np.zeros(widest), np.zeros(widest)
    cov, a = np.zeros((widest, widest)), np.zeros((widest, widest))
    nugget = NUGGET * step**beta
    noise = step * step
    for i in range(len(order)):
        row = order[i]
        first = starts[i]
        n = starts[i + 1] - first
        method = predictor
        if method != KALMAN and rings[i] != 0:
            n = rings[i]
        if method == RBF and (rings[i] == 0 or n < 2):
            method = LSP
        ridge = noise * (RIDGE if rings[i] != 0 else COARSE_RIDGE)
        total = 0.0
        for j in range(n):
            w[j] = weights[first + j]
            total += variances[first + j]
            own[j] = 0.0
            right[j] = ridge * w[j]
        for j in range(n):
            for k in range(n):
                cov[j, k] = 0.0
            if method == KALMAN:
                cov[j, j] = variances[first + j]
                if affine:
                    for k in range(n):
                        cov[j, k] -= variances[first + j] * variances[first + k] / total
            elif method == LSP:
                cov[j, j] = ridge
        for c in range(n_components):
            for j in range(n):
                y[j] = decoded[near[first + j], c]
            if method == RBF and c > 0 and (c < FIRST or c % EVERY == 0):
                radial_weights(cov, own, n, beta, nugget, a, w)
            if method == LSP and c >= n and n > 0:
                for j in range(n):
                    w[j] = right[j]
                    for k in range(j + 1):
                        a[j, k] = cov[j, k]
                solve(a, w, n)
            guess = 0.0
            for j in range(n):
                guess += w[j] * y[j]
            if len(target):
                wish = (target[row, c] - guess) / step
                whole = np.floor(abs(wish) + ROUND_UP)
                residuals[i, c] = whole if wish > 0 else -whole
            change = residuals[i, c] * step
            value = guess + change
            decoded[row, c] = value
            if method == KALMAN:
                gain = noise
                for j in range(n):
                    total = 0.0
                    for k in range(n):
                        total += cov[j, k] * y[k]
                    p[j] = total
                    gain += (1 + DOUBT) * total * y[j]
                for j in range(n):
                    scaled = p[j] / gain
                    w[j] += scaled * change
                    for k in range(n):
                        cov[j, k] -= scaled * p[k]
            elif method == LSP:
                for j in range(n):
                    right[j] += y[j] * value
                    for k in range(j + 1):
                        cov[j, k] += y[j] * y[k]
            elif method == RBF:
                for j in range(n):
                    own[j] += (value - y[j]) ** 2
                    for k in range(n):
                        cov[j, k] += (y[j] - y[k]) ** 2
