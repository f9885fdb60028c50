"""Who leads: curves of known differences."""

from __future__ import annotations

import pytest

from gvpipe.benchmark.leaderboard import differences, leaders, matrix, mean_difference, points_by, ranked, rates
from gvpipe.benchmark.report import Curve


def curve(sequence: str, codec: str, factor: float) -> Curve:
    """Rate is ``factor / error``."""
    points = [{"kg": error, "bpvf": factor / error} for error in (0.1, 0.3, 1.0)]
    return Curve(sequence, 4, 2, 3, codec, {}, None, points)


FOUND = points_by([curve("a", "x", 1), curve("a", "y", 2), curve("b", "x", 1), curve("b", "y", 8), curve("b", "z", 0.5)])


def test_means_are_of_logarithms_over_what_both_have() -> None:
    assert mean_difference(FOUND, "x", "y", "kg") == pytest.approx(300)
    assert mean_difference(FOUND, "x", "z", "kg") == pytest.approx(-50)
    assert mean_difference(FOUND, "x", "none", "kg") is None
    assert ranked(FOUND, "x", "kg") == ["z", "x", "y"]


def test_tables_have_a_row_for_each_codec() -> None:
    assert rates(FOUND, "x", "kg", 0.3)[2:] == ["| `z` | - | 1.667 |", "| `x` | 3.333 | 3.333 |", "| `y` | 6.667 | 26.667 |"]
    assert differences(FOUND, "x", "kg")[2:] == [
        "| `z` | - | -50 % | -50 % |",
        "| `x` | +0 % | +0 % | +0 % |",
        "| `y` | +100 % | +700 % | +300 % |",
    ]
    assert matrix(FOUND, "x", "kg")[2:] == [
        "| 1. `z` | - | -50 | -94 |",
        "| 2. `x` | +100 | - | -75 |",
        "| 3. `y` | +1500 | +300 | - |",
    ]
    assert leaders(FOUND, "x", {"kg": "KG"})[2:] == ["| a | `x` +0 %, `y` +100 % |", "| b | `z` -50 %, `x` +0 %, `y` +700 % |"]
