"""Temporal order: each frame comes after its causal neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.trajectory.temporal_neighbours import temporal_order


@pytest.mark.parametrize("n_frames", [1, 2, 3, 4, 7, 16, 17, 100])
def test_frame_rows_hold_every_row_after_what_predicts_it(n_frames: int) -> None:
    causal = temporal_order(n_frames)
    assert np.array_equal(np.sort(causal.order), np.arange(3 * n_frames))
    rank, owner = np.argsort(causal.order), np.repeat(np.arange(3 * n_frames), np.diff(causal.starts))
    assert (rank[causal.neighbours] < owner).all() and (causal.neighbours % 3 == causal.order[owner] % 3).all()
    assert causal.blocks[-1] == 3 * n_frames
