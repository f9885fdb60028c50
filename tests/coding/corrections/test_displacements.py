"""Displacements as bytes: groups come back."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gvpipe.coding.corrections.bound import (
    SECTION,
)
from gvpipe.coding.corrections.displacements import Displacements, decode_group, encode_group


@given(st.integers(1, 12), st.integers(1, 30), st.floats(0, 1), st.integers(0, 99))
def test_groups_round_trip(n_frames: int, n_vertices: int, share: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices, frames = np.nonzero(rng.random((n_vertices, n_frames)) < share)
    found = Displacements(frames, vertices, rng.integers(-40, 40, (len(frames), 3)) ** 3)
    back = decode_group(encode_group(found, n_frames), n_frames, n_vertices, SECTION)
    for name in ("frames", "vertices", "steps"):
        assert np.array_equal(getattr(found, name), getattr(back, name))
