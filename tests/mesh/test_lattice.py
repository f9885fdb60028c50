"""Lattices: points come back within half a step."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gvpipe.mesh.lattice import Lattice


@settings(max_examples=120)
@given(st.integers(0, 2**32 - 1), st.integers(1, 20), st.sampled_from([1e-30, 1e-3, 1.0, 1e6, 1e30]))
def test_lattice(seed: int, bits: int, scale: float) -> None:
    """Indices fill 0..2^bits - 1 along the longest side, points come back within half a step, lattice points exactly."""
    points = np.random.default_rng(seed).normal(size=(20, 3)) * scale * [1, 0.1, 3]
    lattice = Lattice.over(points, bits)
    indices = lattice.quantise(points)
    assert indices.min() == 0 and indices.max() == 2**bits - 1
    assert np.abs(lattice.points_at(indices) - points).max() <= lattice.step / 2 * (1 + 1e-6)
    assert np.array_equal(lattice.quantise(lattice.points_at(indices)), indices)


def test_lattice_of_one_place() -> None:
    lattice = Lattice.over(np.full((3, 3), 7.5), 12)
    assert np.array_equal(lattice.points_at(lattice.quantise(np.full((3, 3), 7.5))), np.full((3, 3), 7.5))


@settings(max_examples=120)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e2, 1e4, 1e5, 1e7]))
def test_no_index_is_below_0_far_from_the_origin(seed: int, away: float) -> None:
    """Though the origin is a short number, and steps are finer than float32 there."""
    points = (np.random.default_rng(seed).random((20, 3)) + away).astype(np.float32)
    lattice = Lattice.spaced(points, 1e-5)
    assert lattice.quantise(points).min() >= 0
