"""FBX by ufbx: a text file made here, and the real files beside the project."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from fbx_files import FBX
from folders import DATA

import gvpipe.io
from gvpipe.errors import InputError

pytest.importorskip("ufbx")


def test_a_moving_node(tmp_path: Path) -> None:
    """One quad rises by one unit a frame, at the file's 24 frames a second."""
    (tmp_path / "a.fbx").write_text(FBX)
    sequence = gvpipe.io.read(tmp_path / "a.fbx")
    assert len(sequence) == 25 and sequence.fps == 24 and sequence.parts[0].name == "box"
    assert sequence.polygons is not None and sequence.polygons.tolist() == [4]
    assert np.allclose(sequence[:][:, 0], [[0, k, 0] for k in range(25)], atol=1e-5)
    assert sequence.metadata.up_axis == "y" and sequence.metadata.metres_per_unit == pytest.approx(0.01)
    assert len(gvpipe.io.read(tmp_path / "a.fbx", fps=12)) == 13


def test_takes_by_name(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").write_text(FBX)
    assert len(gvpipe.io.read(tmp_path / "a.fbx", clip="Lift")) == 25
    with pytest.raises(InputError, match=r"has no clip 'Lfit'; there are: 'Lift'; did you mean 'Lift'"):
        gvpipe.io.read(tmp_path / "a.fbx", clip="Lfit")


def test_no_mesh(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").write_text(FBX.replace('C: "OO",1,2', ""))
    with pytest.raises(InputError, match="no polygon mesh"):
        gvpipe.io.read(tmp_path / "a.fbx")


def test_missing_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.fbx").write_text(FBX)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[fbx\]'"):
        gvpipe.io.read(tmp_path / "a.fbx")


@pytest.mark.parametrize(
    ("name", "first"),
    [("maya_kenney_character", 0), ("maya_dq_weights", 1), ("maya_blend_inbetween", 1), ("maya_instanced_skin", 0)],
)
def test_against_the_program_that_wrote_it(name: str, first: int) -> None:
    """Vertices are those that Maya exported, within 1e-5 of the diagonal."""
    folder = DATA / "assets" / "fbx" / name
    if not folder.is_dir():
        pytest.skip("no shared data")
    sequence = gvpipe.io.read(next(folder.glob("*.fbx")))
    with np.load(DATA / "reference" / f"{name}_frames.npz") as reference:
        for frame, expected in zip(reference["frames"], reference["positions"], strict=True):
            apart = np.abs(sequence.read_absolute(frame - first, frame - first + 1)[0] - expected).max()
            assert apart < 1e-5 * np.linalg.norm(np.ptp(expected, axis=0))
