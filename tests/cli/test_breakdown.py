"""Bars of a file's sections."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Finished
from sequences import waving

import gvpipe
from gvpipe.cli.breakdown import group_sections

Run = Callable[..., Finished]


def test_sections_of_segments_are_one_bar() -> None:
    sections = {"mesh": 5, "basis.0": 1, "coefficients.0": 7, "basis.1": 2, "video": 3, "clip.0": 4}
    assert group_sections(sections) == {"mesh": 5, "basis x 2": 3, "coefficients.0": 7, "video": 3, "clip.0": 4}


def test_bars_are_as_long_as_their_share(run: Run, tmp_path: Path) -> None:
    """In the encode report and in info alike; a whole file would be 40 characters."""
    gvpipe.write(waving(10, 30), tmp_path / "w.npz")
    encoded = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--codec", "pca", "--segment", 10)
    told = run("info", tmp_path / "w.mp4")
    rows = [line for line in told.out.splitlines() if " bytes " in line]
    assert rows == [line for line in encoded.out.splitlines() if " bytes " in line and " bpvf" in line]
    assert any(line.strip().startswith("basis x 3") for line in rows)
    size = (tmp_path / "w.mp4").stat().st_size
    total = 0.0
    for line in rows:
        count, bpvf = int(line.split(" bytes")[0].split()[-1]), float(line.split(" bpvf")[0].split()[-1])
        assert bpvf == pytest.approx(8 * count / 3000, abs=1e-4)
        length = len(line.partition(" bpvf")[2].strip())
        assert math.isclose(length, 40 * count / size, abs_tol=1.01)
        total += bpvf
    assert total == pytest.approx(8 * size / 3000, abs=1e-3)
