"""Lattices that divide the spacing of what is regular."""

from __future__ import annotations

import numpy as np
import pytest

from gvcodecs.mcgv.base.regular_spacing import align_step


@pytest.mark.parametrize("step", [0.0031, 0.01, 0.017])
def test_a_step_divides_the_spacing_of_a_grid(step: float) -> None:
    columns = np.arange(40) * 0.25
    points = np.stack(np.meshgrid(columns, columns, [0.0, 0.1]), axis=-1).reshape(-1, 3).astype(np.float32)
    aligned = align_step(points, step)
    assert 0.25 / aligned == pytest.approx(round(0.25 / aligned), abs=1e-4)
    assert aligned == pytest.approx(step, rel=0.05)


def test_a_step_stays_where_nothing_is_regular() -> None:
    points = np.random.default_rng(3).random((500, 3)).astype(np.float32)
    assert align_step(points, 0.01) == 0.01
    assert align_step(np.zeros((5, 3), np.float32), 0.01) == 0.01
