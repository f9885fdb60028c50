"""Logarithms, powers and angles: near those of the C library, and exact where that is to be expected."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gvpipe.foundation.elementary import arctan2, exp, exp2, log, log2, power

RNG = np.random.default_rng(7)
POSITIVE = np.concatenate([np.exp(RNG.uniform(-700, 700, 500)), 1 + RNG.uniform(-1e-6, 1e-6, 100), [5e-324, 1.7e308]])


def test_logarithms() -> None:
    assert np.allclose(log2(POSITIVE), np.log2(POSITIVE), rtol=1e-15, atol=1e-22)
    assert [float(log2(2.0**k)) for k in range(-60, 60)] == [*range(-60, 60)]
    assert log(10.0) == pytest.approx(math.log(10.0), rel=1e-15)


def test_powers() -> None:
    for value in RNG.uniform(-300, 300, 300):
        assert exp2(value) == pytest.approx(2.0**value, rel=1e-14)
        assert exp(value) == pytest.approx(math.exp(value), rel=1e-13)
    assert [exp2(float(k)) for k in range(-60, 60)] == [2.0**k for k in range(-60, 60)]
    assert power(3.0, 4.0) == pytest.approx(81.0, rel=1e-14) and power(0.0, 0.5) == 0.0


@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan])
def test_what_has_no_logarithm_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="positive and finite"):
        log(value)


def test_what_is_too_large_is_refused() -> None:
    with pytest.raises(OverflowError):
        exp(1000.0)


def test_angles() -> None:
    sines, cosines = RNG.standard_normal((2, 500)) * np.exp(RNG.uniform(-20, 20, (2, 500)))
    assert np.allclose(arctan2(sines, cosines), np.arctan2(sines, cosines), rtol=1e-14, atol=1e-300)
    corners = [(0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, -1.0), (0.0, 0.0), (1.0, 1.0), (-1.0, -1.0)]
    given = np.array(corners).T
    assert np.array_equal(arctan2(*given), np.arctan2(*given))
