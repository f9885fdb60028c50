"""Rows of eight numbers in kernels: each number as numpy has it."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64
from gvpipe.runtime.compiled import compiled
from gvpipe.runtime.lanes import LANES, load, same, store
from gvpipe.trajectory.prediction import predict_vectors
from gvpipe.trajectory.temporal_neighbours import temporal_order


@compiled
def combine(a: Float64, b: Float64, at: int, results: Float64) -> None:
    """Sums, differences, products, quotients, and three times the first numbers less one."""
    one, two = load(a, at), load(b, at)
    store(results, 0, one + two)
    store(results, LANES, one - two)
    store(results, 2 * LANES, one * two)
    store(results, 3 * LANES, one / two)
    store(results, 4 * LANES, same(3.0) * one - same(1.0))


@pytest.mark.parametrize("at", [0, 1, 3, 8])  # rows may begin anywhere
def test_each_lane_is_worked_out_as_numpy_does(at: int) -> None:
    rng = np.random.default_rng(at)
    a, b, results = rng.normal(size=20), rng.normal(size=20) * 1e6, np.zeros(5 * LANES + 1)
    combine(a, b, at, results)
    one, two = a[at : at + LANES], b[at : at + LANES]
    expected = np.concatenate([one + two, one - two, one * two, one / two, 3 * one - 1, [0]])
    assert np.array_equal(results, expected)


def digest() -> str:
    """A hash of vectors that the Kalman predictor codes in both of its forms, and of integers that come back."""
    random, whole = np.random.default_rng(1), hashlib.sha256()
    for n_components in (3, 14):
        target = random.normal(size=(24, n_components)).cumsum(axis=0)
        residuals, coded = np.zeros(target.shape, np.int64), np.zeros(target.shape)
        predict_vectors(temporal_order(8), 0.01, residuals, coded, target, "kalman", 1.8)
        whole.update(residuals.tobytes() + coded.tobytes())
    values = np.array([3, -1, 1000, 123456, -99999, 70])
    assert np.array_equal(decode_integers(encode_integers(values), len(values)), values)
    return whole.hexdigest()


@pytest.mark.parametrize(
    "form",
    [{"NUMBA_DISABLE_JIT": "1"}, pytest.param({"GVPIPE_KERNELS": "plain"}, marks=pytest.mark.slow)],
    ids=["python", "plain"],
)
def test_kernels_of_other_forms_give_the_same(form: dict[str, str]) -> None:
    paths = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    run = subprocess.run(
        [sys.executable, "-c", "import test_lanes as t; print(t.digest())"],
        env={**os.environ, **form, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert run.stdout.strip() == digest(), run.stderr
