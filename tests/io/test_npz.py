"""Archives of NumPy: exact, read by NumPy itself, and refused when damaged."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mesh_files import FACES, POSITIONS, fast, grid, same_bits

from gvpipe import io
from gvpipe.errors import InputError
from gvpipe.sequence import MeshSequence


@fast
@given(POSITIONS, st.floats(0.5, 1000))
def test_npz_round_trip(tmp_path: Path, positions: Any, fps: float) -> None:
    io.write(MeshSequence(positions, FACES, fps), tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz")
    assert same_bits(read.positions, positions)
    assert same_bits(read.faces, FACES)
    assert read.fps == fps


def test_npz_attributes_and_numpy_reads_it(tmp_path: Path) -> None:
    sequence = grid()
    n, corners = sequence.n_vertices, 3 * len(sequence.faces)
    rng = np.random.default_rng(0)
    kept = {
        "uv": rng.random((corners, 2), np.float32),
        "normal": rng.random((n, 3), np.float32),
        "color": rng.integers(0, 256, (n, 4), np.uint8),
    }
    io.write(grid(attributes=kept), tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz", fps=12)
    assert read.fps == 12
    assert all(same_bits(read.attributes[name], kept[name]) for name in kept)
    with np.load(tmp_path / "a.npz") as archive:
        assert set(archive.files) == {"vertices", "faces", "fps", *kept}
    first = (tmp_path / "a.npz").read_bytes()
    io.write(grid(attributes=kept), tmp_path / "b.npz")
    assert (tmp_path / "b.npz").read_bytes() == first


def test_npz_float64_and_no_fps(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", vertices=np.ones((2, 3, 3)) / 3, faces=FACES.astype(np.uint64))
    read = io.read(tmp_path / "a.npz")
    assert read.fps == 30
    assert same_bits(read.positions, np.full((2, 3, 3), 1 / 3, np.float32))


OK = {"vertices": np.zeros((2, 3, 3), np.float32), "faces": FACES}


BAD_ARCHIVES = {
    "no vertices": ({"faces": FACES}, "no array 'vertices' (it holds faces)"),
    "no faces": ({"vertices": OK["vertices"]}, "no array 'faces'"),
    "flat": ({**OK, "vertices": np.zeros((3, 3))}, "'vertices' has shape (3, 3)"),
    "text": ({**OK, "vertices": np.full((1, 3, 3), "a")}, "'vertices' has shape (1, 3, 3) and type <U1"),
    "objects": ({**OK, "vertices": np.full((1, 3, 3), None)}, "cannot be read as .npz (Object arrays"),
    "faces": ({**OK, "faces": FACES[:, :2]}, "faces have shape (3, 2)"),
    "index": ({**OK, "faces": FACES + 1}, "vertex indices must lie in 0..2"),
    "fps": ({**OK, "fps": np.arange(3)}, "'fps' has shape (3,)"),
    "fps 0": ({**OK, "fps": 0}, "fps is 0"),
    "uv": ({**OK, "uv": np.zeros((3, 3))}, "'uv' has shape (3, 3)"),
    "uv rows": ({**OK, "uv": np.zeros((4, 2))}, "'uv' has 4 rows"),
    "nan": ({**OK, "vertices": np.full((2, 3, 3), np.nan)}, "frame 0, vertex 0 is [nan, nan, nan]"),
    "too large": ({**OK, "vertices": np.full((2, 3, 3), 1e300)}, "float32 can hold"),
}


@pytest.mark.parametrize(("arrays", "message"), BAD_ARCHIVES.values(), ids=BAD_ARCHIVES.keys())
def test_npz_errors(tmp_path: Path, arrays: Any, message: str) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InputError) as error:
        io.read(tmp_path / "a.npz")
    assert message in str(error.value)
    assert str(tmp_path / "a.npz") in str(error.value)
    assert "\n" not in str(error.value)


def test_npz_damaged(tmp_path: Path) -> None:
    io.write(grid(2, 2), tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for stop in range(0, len(whole), 7):
        (tmp_path / "b.npz").write_bytes(whole[:stop])
        with pytest.raises(InputError, match=r"is not an .npz archive, or is cut short"):
            io.read(tmp_path / "b.npz")
    np.save(tmp_path / "c.npy", FACES)
    os.rename(tmp_path / "c.npy", tmp_path / "c.npz")
    with pytest.raises(InputError, match=r"is not an \.npz archive"):
        io.read(tmp_path / "c.npz")
    with pytest.raises(InputError, match="no such file"):
        io.read(tmp_path / "d.npz")


def test_npz_flipped_bytes(tmp_path: Path) -> None:
    io.write(grid(2, 2), tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for at in range(0, len(whole), 11):
        (tmp_path / "b.npz").write_bytes(whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :])
        with contextlib.suppress(InputError):  # a flip in a field that zip readers ignore does no harm
            assert same_bits(io.read(tmp_path / "b.npz").positions, grid(2, 2).positions)
