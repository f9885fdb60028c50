"""Point caches: bytes as their formats say, the mesh from another file, bad headers refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from mesh_files import same_bits
from scenes import FACES, scene

from gvpipe import io
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence

SUFFIXES = [".pc2", ".mdd", ".npy"]


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    io.write(MeshSequence(scene().read(0, 1), FACES), tmp_path / "mesh.npz")
    return tmp_path / "mesh.npz"


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_positions_come_back(tmp_path: Path, mesh: Path, suffix: str) -> None:
    given = scene()
    io.write(given, tmp_path / f"a{suffix}")
    read = io.read(tmp_path / f"a{suffix}", fps=24, mesh=mesh)
    assert same_bits(read.read(0, len(read)), given.read(0, len(given)))
    assert same_bits(read.read(2, 4), given.read(2, 4))
    assert same_bits(read.faces, given.faces)
    assert read.metadata.start_time == (0 if suffix == ".npy" else 0.5)


def test_mdd_says_its_rate_and_pc2_does_not(tmp_path: Path, mesh: Path) -> None:
    io.write(scene(), tmp_path / "a.mdd")
    io.write(scene(), tmp_path / "a.pc2")
    assert io.read(tmp_path / "a.mdd", mesh=mesh).fps == 24
    read = io.read(tmp_path / "a.pc2", mesh=mesh)
    assert read.fps == 30
    assert any("has no frame rate" in note for note in read.notes)


def test_bytes(tmp_path: Path) -> None:
    one = MeshSequence(np.array([[[1, 2, 3]]], np.float32), np.zeros((0, 3), np.int32), 25)
    io.write(one, tmp_path / "a.pc2")
    io.write(one, tmp_path / "a.mdd")
    head = b"POINTCACHE2\0" + struct.pack("<iiffi", 1, 1, 0.0, 1.0, 1)
    assert (tmp_path / "a.pc2").read_bytes() == head + struct.pack("<3f", 1, 2, 3)
    assert (tmp_path / "a.mdd").read_bytes() == struct.pack(">iif3f", 1, 1, 0.0, 1, 2, 3)


def test_all_of_the_mesh_is_kept(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    given = scene()
    io.write(given.part(0, 1), tmp_path / "mesh.usdc")
    io.write(given, tmp_path / "a.mdd")
    read = io.read(tmp_path / "a.mdd", mesh=tmp_path / "mesh.usdc")
    assert read.parts == given.parts
    assert set(read.attributes) >= set(given.attributes)
    assert len(read.materials) == len(given.materials)
    assert np.array_equal(read[3], given[3])


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_no_mesh_and_another_mesh(tmp_path: Path, suffix: str) -> None:
    io.write(scene(), tmp_path / f"a{suffix}")
    with pytest.raises(InputError, match="holds positions alone; name a file with its triangles too"):
        io.read(tmp_path / f"a{suffix}")
    io.write(MeshSequence(np.zeros((1, 4, 3)), [[0, 1, 2]]), tmp_path / "other.npz")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="has 9 vertices, its mesh .*other.npz has 4"):
        io.read(tmp_path / f"a{suffix}", mesh=tmp_path / "other.npz")
    with pytest.raises(InputError, match="other.npz has triangles of its own; mesh='a.obj' is for .pc2, .mdd, .npy"):
        io.read(tmp_path / "other.npz", mesh="a.obj")


HEAD = struct.Struct("<12siiffi")
BAD = {
    "other.pc2": (b"v 0 0 0\n" * 20, "is not a PC2 point cache"),
    "newer.pc2": (HEAD.pack(b"POINTCACHE2\0", 2, 1, 0, 1, 1) + bytes(12), "of version 2; version 1 is understood"),
    "negative.pc2": (HEAD.pack(b"POINTCACHE2\0", 1, -1, 0, 1, 1), "1 samples of -1 vertices"),
    "cut.pc2": (HEAD.pack(b"POINTCACHE2\0", 1, 1000, 0, 1, 1000) + bytes(64), "1000 samples of 1000 vertices, 12000032 bytes"),
    "huge.pc2": (HEAD.pack(b"POINTCACHE2\0", 1, 2**31 - 1, 0, 1, 2**31 - 1), "but has 32"),
    "other.mdd": (b"v 0 0 0\n" * 20, "it is another format or cut short"),
    "negative.mdd": (struct.pack(">ii", -5, 3), "-5 samples of 3 vertices"),
    "pickle.npy": (
        b"\x93NUMPY\x01\x00\x2e\x00{'descr': '|O', 'fortran_order': False, 'shape': (1,)}\n",
        "cannot be read as .npy",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files(tmp_path: Path, mesh: Path, name: str) -> None:
    data, message = BAD[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=name) as caught:
        io.read(tmp_path / name, mesh=mesh)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_array_of_another_shape(tmp_path: Path, mesh: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((4, 9)))
    with pytest.raises(InputError, match=r"has shape \(4, 9\) and type float64"):
        io.read(tmp_path / "a.npy", mesh=mesh)


def test_position_that_is_not_finite(tmp_path: Path, mesh: Path) -> None:
    positions = scene().read(0, 6).copy()
    positions[4, 2, 1] = np.nan
    np.save(tmp_path / "a.npy", positions)
    read = io.read(tmp_path / "a.npy", mesh=mesh)
    with pytest.raises(InputError, match="frame 4, vertex 2 is"):
        read.read(0, 6)
