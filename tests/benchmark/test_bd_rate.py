"""Bjontegaard differences of curves that are known."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gvpipe.benchmark.bd_rate import average_rate_difference, rate_at


def power_law(scale: float, power: float, errors: tuple[float, ...]) -> list[dict[str, Any]]:
    return [{"bpvf": scale * e**-power, "kg": e} for e in errors]


@given(st.floats(0.2, 5), st.floats(0.2, 3), st.floats(0.2, 2))
def test_known_differences(factor: float, scale: float, power: float) -> None:
    """Twice the rate at every error is 100 % more, wherever the points lie; the other way round, the inverse."""
    a = power_law(scale, power, (1.0, 0.31, 0.1))
    b = power_law(factor * scale, power, (2.0, 0.5, 0.22, 0.03))
    found, back = average_rate_difference(a, b, "kg"), average_rate_difference(b, a, "kg")
    assert found is not None and back is not None
    assert found == pytest.approx(100 * (factor - 1), abs=1e-6)
    assert (1 + found / 100) * (1 + back / 100) == pytest.approx(1)
    at = rate_at(b, "kg", 0.4)
    assert at == pytest.approx(factor * scale * 0.4**-power)


def test_nothing_is_extrapolated() -> None:
    a, b = power_law(1, 1, (1.0, 0.5)), power_law(1, 1, (0.4, 0.1))
    assert average_rate_difference(a, b, "kg") is None
    assert rate_at(a, "kg", 0.4) is None and rate_at(a, "kg", 1.1) is None
    assert average_rate_difference(a, [], "kg") is None
    assert average_rate_difference(a, [{"bpvf": 3.0, "kg": None}, {"bpvf": 3.0, "kg": 0.0}], "kg") is None


def test_points_that_others_beat_do_not_count() -> None:
    """A coarser file that is larger says nothing of what the codec can do."""
    points = power_law(1, 1, (1.0, 0.5, 0.25))
    assert rate_at([*points, {"bpvf": 9.0, "kg": 0.7}], "kg", 0.7) == rate_at(points, "kg", 0.7)
