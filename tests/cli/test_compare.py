"""``gvpipe compare``: which frames, clips and triangles of either side."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_files import two_clips

import gvpipe
from gvpipe.foundation.errors import TopologyChange
from gvpipe.metrics import surface_comparison
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence

Run = Callable[..., Any]


@pytest.fixture
def pair(sequence: MeshSequence, tmp_path: Path) -> tuple[Path, Path]:
    """A sequence, and one that is off by as many units as the number of the frame."""
    off = np.arange(len(sequence), dtype=np.float32)[:, None, None] * np.array([1, 0, 0], np.float32)
    gvpipe.write(sequence, tmp_path / "a.npz")
    gvpipe.write(replace(sequence, positions=sequence[:] + off), tmp_path / "b.npz")
    return tmp_path / "a.npz", tmp_path / "b.npz"


def errors(run: Run, *arguments: object) -> list[float]:
    """The largest error of each frame."""
    ended = run("compare", *arguments, "--json")
    assert ended.status == 0, ended.err
    return [frame["max"] for frame in json.loads(ended.out)["frames"]]


def test_frames(run: Run, pair: tuple[Path, Path], sequence: MeshSequence, tmp_path: Path) -> None:
    """A span of both, or of the reference alone where the other side holds that span."""
    assert errors(run, *pair, "--frames", "3:6") == pytest.approx([3, 4, 5], rel=1e-5)
    assert errors(run, *pair, "--frames", "9:") == pytest.approx([9, 10], rel=1e-5)
    gvpipe.write(gvpipe.read(pair[1], frames=(3, 6)), tmp_path / "span.npz")
    assert errors(run, pair[0], tmp_path / "span.npz", "--frames", "3:6") == pytest.approx([3, 4, 5], rel=1e-5)
    ended = run("compare", *pair, "--frames", "5:2")
    assert ended.status == 1 and f"{pair[0]}: frames 5:2 asked for; 0 <= start < stop <= {len(sequence)} is needed" in ended.err


def test_frames_of_one_topology(run: Run, sequence: MeshSequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frame 2 of both sides has other triangles; the others are compared."""
    for name in ("a", "b"):
        gvpipe.write(sequence, tmp_path / name / "%02d.ply")
        gvpipe.write(replace(sequence, positions=sequence[:1], faces=sequence.faces[:-1]), tmp_path / name / "02.ply")
    assert errors(run, tmp_path / "a", tmp_path / "b", "--frames", "3:6") == [0, 0, 0]
    monkeypatch.setattr(surface_comparison, "SAMPLES", 500)
    monkeypatch.setattr(surface_comparison, "GRID", 32)
    ended = run("compare", tmp_path / "a", tmp_path / "b", "--json")
    found = json.loads(ended.out)
    assert ended.status == 0 and found["rmse"] is None and "change" in found["unpaired"]
    assert len(found["surface"]["frames"]) == len(sequence) and found["surface"]["max"] < 1e-6
    assert gvpipe.compare(tmp_path / "a", tmp_path / "b").surface is not None
    capture = Capture([sequence.part(0, 5), sequence.part(5, len(sequence))])
    with_capture = gvpipe.compare(capture, sequence).surface
    assert with_capture is not None and with_capture.max < 1e-6 and len(with_capture.frames) == len(sequence)
    span = json.loads(run("compare", tmp_path / "a", tmp_path / "b", "--frames", "1:4", "--json").out)
    assert len(span["surface"]["frames"]) == 3
    with pytest.raises(TopologyChange):
        gvpipe.compare(tmp_path / "a", tmp_path / "b", surface=False)


def test_point_caches(run: Run, pair: tuple[Path, Path], tmp_path: Path) -> None:
    """One mesh serves both sides."""
    caches = [tmp_path / f"{path.stem}.pc2" for path in pair]
    for path, cache in zip(pair, caches, strict=True):
        gvpipe.write(gvpipe.read(path), cache)
    assert errors(run, *caches, "--mesh", pair[0], "--frames", "1:3") == pytest.approx([1, 2], rel=1e-5)
    assert errors(run, pair[0], caches[0], "--mesh", pair[0]) == [0] * 11
    assert run("compare", *pair, "--mesh", pair[0]).status == 2


def test_clips(run: Run, tmp_path: Path) -> None:
    two_clips(tmp_path / "a.glb")
    run_clip = gvpipe.read(tmp_path / "a.glb", clip="Run")
    gvpipe.write(run_clip, tmp_path / "run.npz")
    assert len(errors(run, tmp_path / "a.glb", tmp_path / "run.npz", "--clip", "Run")) == len(run_clip)
    assert max(errors(run, tmp_path / "run.npz", tmp_path / "a.glb", "--other-clip", "Run")) == 0
    ended = run("compare", tmp_path / "run.npz", tmp_path / "a.glb", "--other-clip", "Rum")
    assert ended.status == 1 and "there are: 'Walk', 'Run'" in ended.err


def test_surfaces(
    run: Run, pair: tuple[Path, Path], sequence: MeshSequence, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a last triangle vertices do not correspond; a note says so, and surfaces are compared."""
    monkeypatch.setattr(surface_comparison, "SAMPLES", 500)
    monkeypatch.setattr(surface_comparison, "GRID", 64)
    gvpipe.write(replace(gvpipe.read(pair[1]), faces=sequence.faces[:-1]), tmp_path / "c.npz")
    frames = ("--frames", "0:2")
    both = json.loads(run("compare", *pair, "--surface", *frames, "--json").out)
    assert both["surface"]["max"] <= both["max"] and both["unpaired"] == ""
    assert both["surface"]["rms_diag"] == pytest.approx(both["surface"]["rms"] / both["surface"]["diagonal"])
    ended = run("compare", pair[0], tmp_path / "c.npz", *frames, "--json")
    alone = json.loads(ended.out)
    assert alone["rmse"] is None and alone["frames"] == [] and "triangles" in alone["unpaired"]
    assert len(alone["surface"]["frames"]) == 2
    assert alone["surface"]["frames"][1]["d1_psnr"] < alone["surface"]["frames"][0]["d1_psnr"]
    assert "Note: surfaces alone are compared: " in ended.err
    shown = run("compare", pair[0], tmp_path / "c.npz", *frames).out
    assert shown.splitlines()[0].startswith("surface rms ") and "rmse" not in shown
    assert run("compare", pair[0], tmp_path / "c.npz", "--frames", "0:1").status == 0
    gvpipe.write(gvpipe.read(pair[0], frames=(0, 3)), tmp_path / "d.npz")
    ended = run("compare", tmp_path / "c.npz", tmp_path / "d.npz")
    assert ended.status == 1 and "equal numbers are needed" in ended.err
