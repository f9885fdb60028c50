"""FBX by ufbx: a text file made here, and the real files beside the project."""

from __future__ import annotations

import importlib.util
import struct
from pathlib import Path

import numpy as np
import pytest
from fbx_files import FBX, with_cache, with_texture, write_mc
from folders import DATA
from PIL import Image
from scipy.spatial import KDTree

import gvpipe.io
from gvpipe.foundation.errors import InputError

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


@pytest.mark.usefixtures("new_processes")
def test_takes_by_name(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").write_text(FBX)
    assert len(gvpipe.io.read(tmp_path / "a.fbx", clip="Lift")) == 25
    with pytest.raises(InputError, match=r"has no clip 'Lfit'; there are: 'Lift'; did you mean 'Lift'"):
        gvpipe.io.read(tmp_path / "a.fbx", clip="Lfit")


def test_no_mesh(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").write_text(FBX.replace('C: "OO",1,2', ""))
    with pytest.raises(InputError, match="no polygon mesh"):
        gvpipe.io.read(tmp_path / "a.fbx")


SLIDING = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) + np.arange(25)[:, None, None] * np.array([0.5, 0, 0])


@pytest.mark.parametrize("kind", ["pc2", "mc"])
def test_geometry_caches_move(tmp_path: Path, kind: str) -> None:
    """A cache slides by half a unit a frame, and its node rises by one."""
    if kind == "pc2":
        head = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 4, 0.0, 1.0, 25)
        (tmp_path / "c.pc2").write_bytes(head + SLIDING.astype("<f4").tobytes())
        (tmp_path / "a.fbx").write_text(with_cache("c.pc2"))
    else:
        write_mc(tmp_path / "c.mc", SLIDING)
        (tmp_path / "a.fbx").write_text(with_cache("c.xml", 2, "quad"))
    read = gvpipe.io.read(tmp_path / "a.fbx")
    rising = np.arange(25)[:, None, None] * np.array([0, 1, 0])
    assert np.allclose(read.read(0, 25), SLIDING + rising, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "words"),
    [("../c.pc2", "lies outside the file's folder"), ("/etc/passwd", "lies outside"), ("gone.pc2", "'gone.pc2' is missing")],
)
def test_geometry_caches_lie_beside_the_file(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "c.pc2").write_bytes(bytes(40))
    (tmp_path / "in" / "a.fbx").write_text(with_cache(name))
    with pytest.raises(InputError, match=words):
        gvpipe.io.read(tmp_path / "in" / "a.fbx")


def test_links_in_place_of_samples_are_not_followed(tmp_path: Path) -> None:
    """The .xml lies beside the file, the samples of Maya's cache do not."""
    folder = tmp_path / "in"
    folder.mkdir()
    write_mc(tmp_path / "c.mc", SLIDING)
    (tmp_path / "c.xml").rename(folder / "c.xml")
    (folder / "c.mc").symlink_to(tmp_path / "c.mc")
    (folder / "a.fbx").write_text(with_cache("c.xml", 2, "quad"))
    with pytest.raises(InputError, match=r"a\.fbx .*: its geometry cache 'c\.mc' lies outside the file's folder"):
        gvpipe.io.read(folder / "a.fbx")


def test_damaged_cache(tmp_path: Path) -> None:
    (tmp_path / "c.pc2").write_bytes(b"POINTCACHE2\0" + b"x" * 50)
    (tmp_path / "a.fbx").write_text(with_cache("c.pc2"))
    with pytest.raises(InputError, match=r"a\.fbx cannot be read as FBX: Failed to load geometry cache"):
        gvpipe.io.read(tmp_path / "a.fbx")


def test_textures_lie_beside_the_file(tmp_path: Path) -> None:
    """A picture is read from the file's folder; what is elsewhere or missing becomes a note."""
    (tmp_path / "in").mkdir()
    Image.new("RGB", (4, 4)).save(tmp_path / "in" / "a.png")
    Image.new("RGB", (4, 4)).save(tmp_path / "b.png")
    for name, found in (("a.png", 1), ("../b.png", 0), ("/etc/passwd", 0)):
        (tmp_path / "in" / "a.fbx").write_text(with_texture(name))
        read = gvpipe.io.read(tmp_path / "in" / "a.fbx")
        assert len(read.images) == found and read.materials[0].name == "paint"
        assert any("was left out" in note for note in read.notes) == (not found)


@pytest.mark.parametrize(("name", "first"), [("maya_cache_sine", 1), ("max_cache_box", 0)])
def test_caches_of_other_programs(name: str, first: int) -> None:
    """Vertices are those that Maya (its own cache) and 3ds Max (PC2) exported; Max's have four digits and another order."""
    folder = DATA / "assets" / "pointcache"
    if not folder.is_dir():
        pytest.skip("no shared data")
    read = gvpipe.io.read(next(folder.glob(f"*/{name}_7500_binary.fbx")))
    reference = np.load(next((DATA / "reference").glob(f"{name}*_frames.npz")))
    for frame, expected in zip(reference["frames"], reference["positions"], strict=True):
        apart, near = map(np.asarray, KDTree(read.read_absolute(frame - first, frame - first + 1)[0]).query(expected))
        assert apart.max() < 1e-5 * np.linalg.norm(np.ptp(expected, axis=0)) and len(np.unique(near)) == len(expected)


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
