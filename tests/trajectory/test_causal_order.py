"""Causal orders of which a part is selected."""

from __future__ import annotations

import numpy as np
from sequences import grid
from tubes import surface_of

from gvpipe.trajectory.causal_selection import select_vectors


def test_selected_rows_know_what_they_knew() -> None:
    _, surface = surface_of(grid(12))
    causal = surface.causal
    keep = np.arange(len(causal.order)) < 50
    chosen = select_vectors(causal, keep)
    assert np.array_equal(causal.order[keep][chosen.neighbours], causal.neighbours[: causal.starts[50]])
    assert np.array_equal(chosen.starts, causal.starts[:51])
    assert chosen.blocks[-1] == 50
