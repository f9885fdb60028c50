"""The inverse DCT is scipy's, for every length."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import dct, idct

from gvcodecs.pdct.cosine_kernels import find_turn, invert_cosines


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 16, 97, 128, 500, 1009])
def test_signals_come_back(n: int) -> None:
    signals = np.random.default_rng(n).normal(size=(2, n, 3))
    coefficients = np.asarray(dct(signals, axis=1, norm="ortho"))
    wanted = np.asarray(idct(coefficients, axis=1, norm="ortho"))
    invert_cosines(coefficients[0], coefficients[1])
    assert np.allclose(coefficients, signals, rtol=0, atol=1e-14)
    assert np.allclose(coefficients, wanted, rtol=0, atol=1e-14)


@pytest.mark.parametrize("denominator", [1, 2, 3, 8, 1000, 4096])
def test_turns_are_on_the_circle(denominator: int) -> None:
    numerators = np.arange(denominator)
    found = np.array([find_turn(int(k), denominator) for k in numerators])
    angles = 2 * np.pi * numerators / denominator
    assert np.allclose(found, np.column_stack([np.cos(angles), np.sin(angles)]), rtol=0, atol=1e-15)
