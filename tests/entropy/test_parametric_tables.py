"""Tables of two parameters fit Laplacian residuals."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.entropy import parametric_tables


@pytest.mark.parametrize("mean", [0.15, 0.3, 1.0, 7.0, 60.0])
def test_tables_told_by_two_numbers_fit_laplacian_residuals(mean: float) -> None:
    values = np.rint(np.random.default_rng(1).laplace(0, mean, 20000)).astype(int)
    magnitudes = np.bincount(np.where(values >= 0, 2 * values, -2 * values - 1))[:16]
    counts = np.pad(magnitudes, (0, parametric_tables.N_TOKENS - len(magnitudes)))
    zero, ratio, bits = parametric_tables.best(counts)
    shares = counts[counts > 0] / counts.sum()
    entropy = -(counts.sum() * shares * np.log2(shares)).sum()
    if mean < 2:  # above, the counts cut at token 16 are not a Laplacian
        assert bits < 1.03 * entropy + 100
    table = parametric_tables.table(zero, ratio)
    assert (table > 0).all() and abs(table.sum() - parametric_tables.TOTAL) < 0.01 * parametric_tables.TOTAL
