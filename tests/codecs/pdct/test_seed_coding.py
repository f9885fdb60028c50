"""Seed triangles as bytes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gvcodecs.pdct.seed_coding import decode_seeds, encode_seeds
from gvpipe.container.cursor import Cursor


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_seeds_come_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    base = rng.integers(-100, 70_000, (3, 3, 3))
    points = base + rng.integers(-300, 300, (7, 3, 3, 3)).cumsum(axis=0)
    assert np.array_equal(decode_seeds(Cursor(encode_seeds(points, base), "x"), 7, base, "x"), points)
