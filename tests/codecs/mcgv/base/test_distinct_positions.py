"""The base frame's lattice keeps positions apart."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import awkward

from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.base.base_lattice import choose_lattice
from gvcodecs.mcgv.base.distinct_positions import keep_apart
from gvpipe.mesh.lattice import Lattice
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.welding import find_points


@pytest.mark.parametrize("name", awkward())
def test_base_frame_tells_places_apart(name: str) -> None:
    """However coarse the quality: nearly as many lattice points as places of frame 0 that 16 bits tell apart."""
    sequence: MeshSequence = awkward()[name]
    first = sequence.read(0, 1)[0][np.unique(find_points(sequence), return_index=True)[1]]
    counts, steps = [], []
    for codec in (Mcgv(prediction="blended", quality=0), Mcgv(prediction="blended", base_bits=16)):
        lattice = choose_lattice(codec, first, 1e3)
        steps.append(lattice.step)
        counts.append(len(np.unique(keep_apart(lattice, first), axis=0)))
    assert counts[0] >= 0.99 * counts[1]
    assert steps[0] >= steps[1] * (1 - 1e-4)  # 2**16 and 2**16 - 1 steps along the longest side


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(0.05, 4.0))
@settings(deadline=None)
def test_points_get_lattice_points_of_their_own(seed: int, n: int, spread: float) -> None:
    """Different ones while there is room; nearest ones if no point is near another; never further off than a step."""
    draw = np.random.default_rng(seed)
    first = np.concatenate([[[0, 0, 0], [64, 64, 64]], 30 + spread * draw.standard_normal((n, 3))]).astype(np.float32)
    first = np.concatenate([first, first[2 : 2 + n // 8]])  # points that part later
    lattice = Lattice((0.0, 0.0, 0.0), 1.0)
    points = keep_apart(lattice, first)
    nearest = lattice.quantise(first)
    assert (points.min() >= 0) and (points <= nearest.max(axis=0)).all()
    assert np.abs(points - nearest).max() <= 1
    cells, counts = np.unique(nearest, axis=0, return_counts=True)
    alone = (nearest[:, None] == cells[counts == 1]).all(axis=2).any(axis=1)
    assert np.array_equal(points[alone], nearest[alone])
    if counts.max() <= 4:
        assert len(np.unique(points, axis=0)) == len(points)
