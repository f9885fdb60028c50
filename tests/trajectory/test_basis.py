"""Principal trajectories: the step that meets a wanted error, whatever number of components goes with it."""

from __future__ import annotations

import functools
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gvpipe.trajectory import basis
from gvpipe.trajectory.basis import (
    Basis,
    Principal,
    choose_step,
    count_components,
    expected_error,
    find_principal,
    fit_coefficients,
)

N_POINTS, N_ROWS = 700, 90


def decaying(n: int, decades: float) -> Principal:
    """``n`` components whose energies fall by so many decades, and nothing else."""
    energies = np.logspace(0, -decades, n)
    return Principal(np.zeros(N_ROWS), energies, np.zeros((N_ROWS, n)), 1e-3 * float(energies[-1]))


@given(
    n=st.integers(2, 60),
    decades=st.floats(0, 12),
    part=st.floats(0.001, 0.9),
    point_cost=st.floats(0.05, 0.5),
    entry_cost=st.floats(0.05, 10),
    noise=st.floats(1, 4),
)
def test_any_error_is_met_where_components_leave_too(
    n: int, decades: float, part: float, point_cost: float, entry_cost: float, noise: float
) -> None:
    principal = decaying(n, decades)
    low, high = np.log(2 * principal.rest), np.log(principal.energies.sum())
    error = float(np.exp(low + part * (high - low)))
    left = (noise * N_POINTS + N_ROWS) / 12
    count = functools.partial(count_components, principal, N_POINTS, point_cost=point_cost, entry_cost=entry_cost)
    step, n_kept = choose_step(principal, error, count, left)
    assert 0.998 * error < expected_error(principal, n_kept, step, left) <= error
    # as many as are worth it at that step, or at one a little off where that number's error jumps
    assert count(2 * step) - 1 <= n_kept <= count(step / 2) + 1


def test_steps_fall_with_the_error_but_where_components_leave() -> None:
    principal, left = decaying(30, 4), (N_POINTS + N_ROWS) / 12
    count = functools.partial(count_components, principal, N_POINTS)
    chosen = [choose_step(principal, float(error), count, left) for error in np.geomspace(2, 1e-4, 300)]
    assert len({step for step, _ in chosen}) > 290
    kept = [n for _, n in chosen]
    assert kept == sorted(kept)
    for (before, n_before), (after, n_after) in pairwise(chosen):
        assert after < before or (n_after > n_before and after < 1.5 * before)


def test_steps_do_not_hang_on_the_last_bits_of_eigenvalues() -> None:
    principal, left = decaying(30, 4), (N_POINTS + N_ROWS) / 12
    count = functools.partial(count_components, principal, N_POINTS)
    wobble = 1 + 1e-13 * np.random.default_rng(0).choice([-1, 1], 30)
    other = Principal(principal.mean, principal.energies * wobble, principal.vectors, principal.rest)
    for error in (1.0, 0.1, 0.01, 0.001):
        assert choose_step(principal, error, count, left) == choose_step(
            other, error, functools.partial(count_components, other, N_POINTS), left
        )


def test_blocks_of_points_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    trajectories = np.cumsum(np.random.default_rng(3).standard_normal((200, 30)), axis=1)
    at_once = find_principal(trajectories, 1e-3)
    coefficients = fit_coefficients(trajectories, Basis(at_once.mean, at_once.vectors))
    monkeypatch.setattr(basis, "LARGE_BLOCK", 32)
    by_blocks = find_principal(trajectories, 1e-3)
    np.testing.assert_allclose(by_blocks.energies, at_once.energies, rtol=1e-9)
    np.testing.assert_allclose(np.abs((by_blocks.vectors * at_once.vectors).sum(axis=0)), 1, atol=1e-6)
    np.testing.assert_allclose(fit_coefficients(trajectories, Basis(at_once.mean, at_once.vectors)), coefficients, atol=1e-9)
    assert find_principal(np.zeros((100, 6)), 1e-3).vectors.shape == (6, 0)
