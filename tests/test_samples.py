"""The stored samples are what the script makes, and what their descriptions say."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from folders import SAMPLES

import gvpipe
from gvpipe.mesh.topology import adjacency, components, unique_edges


def test_ball_frames_are_what_the_script_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SAMPLES))
    script = runpy.run_path(str(SAMPLES / "make_samples.py"))
    script["write_obj_frames"](tmp_path, script["make_bounce"]())
    made = sorted(tmp_path.glob("*.obj"))
    assert [path.name for path in made] == [f"ball_{i:04d}.obj" for i in range(1, 25)]
    for path in made:  # rounded on writing, so that other versions of numpy write the same
        assert path.read_bytes() == (SAMPLES / "ball_frames" / path.name).read_bytes()
    for module in ("animation", "bounce", "cloth", "creature", "fox", "gait", "implicit", "polygonise"):
        sys.modules.pop(module, None)


@pytest.mark.parametrize(("name", "closed", "frames"), [("cloth", False, 110), ("creature", True, 102)])
def test_sample_is_one_piece_that_moves(name: str, closed: bool, frames: int) -> None:
    sequence = gvpipe.read(SAMPLES / f"{name}.npz")
    assert len(sequence) == frames
    assert components(adjacency(sequence.faces, sequence.n_vertices))[0] == 1
    sides = 3 * len(sequence.faces)
    n_edges = len(unique_edges(sequence.faces))
    assert (2 * n_edges == sides) == closed
    positions = sequence.read(0, frames)
    assert np.abs(np.diff(positions, axis=0)).max(axis=(1, 2)).min() > 0
    assert (SAMPLES / f"{name}.npz").stat().st_size < 2_000_000
