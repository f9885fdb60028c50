"""The sample of a long capture makes frames when they are read, and measures a file of it."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from folders import SAMPLES

import gvpipe
from gvpipe.mesh.topology import adjacency, components


def test_frames_do_not_depend_on_what_else_is_read() -> None:
    names = runpy.run_path(str(SAMPLES / "capture.py"))
    sequence: gvpipe.MeshSequence = names["make_capture"](18_000)
    assert sequence.shape == (18_000, 20_000, 3)
    assert np.allclose(sequence.read(9_000, 9_003)[1], sequence.read(9_001, 9_002)[0], atol=1e-6)
    assert components(adjacency(sequence.faces, sequence.n_vertices))[0] == 1
    step = np.linalg.norm(np.diff(sequence.read(9_000, 9_002), axis=0), axis=-1)
    assert 1e-4 < step.max() < 0.2  # it moves, and does not jump


@pytest.mark.slow
def test_a_short_capture_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["capture.py", str(tmp_path / "a.mp4"), "200"])
    runpy.run_path(str(SAMPLES / "capture.py"), run_name="__main__")
    printed = capfd.readouterr().out
    assert "200 frames, 20000 vertices, codec pca" in printed and "first frame after" in printed and "memory" in printed
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]
    assert gvpipe.info(tmp_path / "a.mp4").layout == "stream"
