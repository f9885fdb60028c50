"""Base frames of several steps: what is kept of one serves another one alone if its points are the same ones."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from sequences import waving

import gvpipe
from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.base.base_frame import begin
from gvcodecs.mcgv.encode_job import Job
from gvpipe.coding.codec import Memo
from gvpipe.foundation.progress import silent
from gvpipe.model.sequence import MeshSequence


def with_still_twins() -> MeshSequence:
    """A waving sheet, and triangles that stand still, whose corners merge with each other's one after the other."""
    sheet = waving(6, 8)
    frames = sheet.read(0, 8)
    n = frames.shape[1]
    draw = np.random.default_rng(0)
    apart = np.geomspace(1e-5, 0.1, 20)[:, None, None] * np.array([1.0, 0, 0])
    pair = draw.random((20, 1, 3)) * 3 + np.array([0, 0, 2.0])
    corners = np.concatenate([pair, pair + apart, pair + np.array([0, 0.5, 0.1])], axis=1).reshape(-1, 3)
    still = np.broadcast_to(corners, (8, 60, 3))
    faces = np.concatenate([sheet.faces, n + np.arange(60).reshape(-1, 3)]).astype(np.int32)
    return replace(sheet, positions=np.concatenate([frames, still], axis=1).astype(np.float32), faces=faces)


def test_base_frames_of_one_name_have_the_same_points() -> None:
    """Vertices that stand still merge with the step, and so number the others anew, though there are as many."""
    job = Job(Mcgv(), with_still_twins(), Memo(), silent)
    found: dict[str, list[int]] = {}
    counts = set()
    for step in np.geomspace(1e-3, 1.0, 12):
        start = begin(job, float(step), 1e-3)
        counts.add(len(start.base))
        assert found.setdefault(start.key, start.sources.tolist()) == start.sources.tolist()
    assert len(counts) == 1 and len(found) > 1


def test_encodes_where_steps_change_far(tmp_path: Path) -> None:
    sequence = with_still_twins()
    for quality in (20, 50, 80):
        gvpipe.encode(sequence, tmp_path / "a.mp4", "mcgv", quality=quality, clusters=8)
        assert gvpipe.decode(tmp_path / "a.mp4").n_frames == 8
